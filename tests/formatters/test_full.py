"""Details of the full form: which values are underlined, with which label, and what is left out."""

from dataclasses import replace

import pytest

from cqos_core import check
from cqos_core.formatters.concise import render_concise
from cqos_core.formatters.full import render_full
from cqos_core.formatters.terminal import cells
from cqos_core.model.finding import Fact, Finding, Remedy, Severity, Side, Verdict
from cqos_core.model.report import Group, Report
from cqos_core.model.settings import Place
from cqos_core.model.style import Style


def finding(**changes):
    return replace(Finding("X101", "bad-thing", Severity.ERROR, "a bad thing"), **changes)


def render(*findings, text="", **style):
    report = Report(Verdict.INCOMPATIBLE, findings=findings)
    return render_full(report, Style(sources={"f.yaml": text.encode()} if text else {}, **style))


def with_fact(line, column, value="v", origin="explicit", members=("a",), label="set here"):
    fact = Fact("policy", value, origin, Place("f.yaml", line, column))
    return finding(sides=(Side("publisher", members, label, (fact,)),))


@pytest.mark.parametrize(
    "before",
    ["", "key: ", "\tkey: ", "  \tkey:\t", "天気: ", "🚜e\u0301: ", "שלום: ", "\x1b\u202e: ", "x: " * 40],
)
def test_carets_stand_under_the_value(before):
    text = f"{before}value # rest"
    lines = render(with_fact(1, len(before) + 1, "value"), text=text, width=60).split("\n")
    shown, underline = lines[2], lines[3]
    assert cells(shown[: shown.index("value")]) == underline.index("^")
    assert underline.endswith("^^^^^ set here")


def test_no_arrow_leads_nowhere():
    text = render(finding(sides=(Side("system", ()),)))
    assert text.split("\n")[:2] == ["error[X101] bad-thing: a bad thing", "  see: cqos rule X101"]


def test_line_numbers_share_a_gutter():
    text = "a: v\n" * 1200
    lines = render(with_fact(3, 4), with_fact(1111, 4), text=text).split("\n")
    assert [line for line in lines if "| a: v" in line] == ["   3 | a: v", "1111 | a: v"]
    assert {line.index("-->") for line in lines if "-->" in line} == {4}


@pytest.mark.parametrize(
    ("members", "expected"),
    [
        (("a",), "a ."),
        (("a", "b", "c"), "a, b, c ."),
        (("a", "b", "c", "d"), "a, b and 2 more ."),
        (tuple(f"m{n}" for n in range(20_000)), "m0, m1 and 19998 more ."),
    ],
)
def test_members(members, expected):
    assert f"  {expected} policy" in render(with_fact(1, 4, members=members), text="a: v")


@pytest.mark.parametrize(
    ("value", "origin", "said"),
    [
        ("v", "explicit", "set here"),
        ("w", "explicit", "set here: w"),
        ("v", "profile p", "set here, from profile p"),
        ("w", "profile p", "set here: w (from profile p)"),
        ("w", "preset p", "set here: w (preset p)"),
        ("w", "default", "set here: w (default)"),
        ("w", "option ros2.rmw", "set here: w (from option ros2.rmw)"),
        ("w", "overlay", "set here: w (from an overlay)"),
        ("w", "settled from best_available", "set here: w (settled from best_available)"),
        ("w", "ignored by the middleware", "set here: w (ignored by the middleware)"),
    ],
)
def test_the_label_of_a_value_names_its_origin(value, origin, said):
    assert f"   ^ {said}\n" in render(with_fact(1, 4, value, origin), text="a: v")


def test_a_line_too_long_to_be_shown_whole_is_shown_once_for_what_stands_at_one_place():
    default = [Fact(name, "v", "preset p", Place("f.yaml", 1, 202)) for name in ("depth", "history")]
    other = Fact("lease", "v", "explicit", Place("f.yaml", 1, 210))
    text = render(
        finding(sides=(Side("publisher", ("a",), "here", (*default, other)),)), text="x: " * 67 + "scan: # y: v" * 20
    )
    assert [line.split()[:2] for line in text.splitlines() if "f.yaml" in line] == [
        ["-->", "f.yaml:1:202"],
        [":::", "f.yaml:1:210"],
    ]
    assert "a . depth, history" in text


def test_the_label_repeats_a_value_inside_a_longer_word():
    assert "set here: volatile\n" in render(with_fact(1, 4, "volatile"), text="a: non-volatile")


def test_a_value_without_any_place_is_shown():
    bare = finding(sides=(Side("publisher", ("a",), "offered here", (Fact("policy", "v", "default"),)),))
    assert "  --> a . policy  offered here: v (default)\n" in render(bare)


def test_an_untold_value_says_only_itself():
    assert "   ^ w\n" in render(with_fact(1, 4, "w", label=""), text="a: v")


def test_a_place_past_the_end_of_the_source_has_no_excerpt():
    assert "  --> f.yaml:9:4  a . policy  set here: v\n" in render(with_fact(9, 4), text="a: v")


def test_remedies_that_cost_nothing_share_a_line():
    def remedy(text, kind="configuration", breaks=0):
        return Remedy("publisher", ("a",), "p", "v", kind, text, 1, breaks)

    text = render(
        finding(
            remedies=(
                remedy("do A"),
                remedy("do B"),
                remedy("do C", breaks=1),
                remedy("do D", "needs_code"),
            )
        )
    )
    assert "  help: do A, or do B\n  help: or do C (makes 1 other pair worse)\n" in text
    assert "  help: or do D (the program must keep this promise)\n" in text


def test_an_only_remedy_needs_no_or():
    remedy = Remedy("publisher", ("a",), "p", "v", "needs_code", "do D")
    assert "  help: do D (the program must keep this promise)\n" in render(finding(remedies=(remedy,)))


@pytest.mark.parametrize(
    ("worlds", "said"),
    [
        ({"ros2.rmw=b": "compatible", "ros2.rmw=a": "compatible"}, "fits with a, b"),
        ({"ros2.rmw=a": "incompatible", "ros2.rmw=b": "compatible"}, "fits with b; not with a"),
        ({"ros2.rmw=a": "unknown"}, "cannot be known with a"),
        (
            {"ros2.rmw=a": "compatible", "dds.vendor=a": "incompatible"},
            "fits with ros2.rmw=a; not with dds.vendor=a",
        ),
        (
            {"ros2.rmw=a, start order=x": "compatible", "ros2.rmw=a, start order=y": "incompatible"},
            "fits with ros2.rmw=a, start order=x; not with ros2.rmw=a, start order=y",
        ),
    ],
)
def test_worlds(worlds, said):
    verdicts = {name: Verdict(verdict) for name, verdict in worlds.items()}
    assert f"  note: {said}\n" in render(finding(worlds=verdicts))


def test_each_reason_is_shown_once():
    first, second = finding(because="it breaks"), finding(message="again", because="it breaks")
    text = render(first, second, replace(first, because="another reason"))
    assert text.count("why: it breaks") == text.count("why: another reason") == 1


@pytest.mark.parametrize(
    ("changes", "expected"),
    [
        ({}, "compatible: 2 topics, 2 pairs judged, no findings\n"),
        ({"system": "farm"}, "farm: compatible: 2 topics, 2 pairs judged, no findings\n"),
        ({"sources": ("a.yaml",)}, "a.yaml: compatible: 2 topics, 2 pairs judged, no findings\n"),
        ({"sources": ("a.yaml", "b.yaml")}, "a.yaml and 1 more: compatible: 2 topics, 2 pairs judged, no findings\n"),
        (
            {"findings": (finding(severity=Severity.NOTE),)},
            "compatible: 2 topics, 2 pairs judged, 1 note (shown with --show notes)\n",
        ),
        ({"findings": (finding(accepted="known"),)}, "compatible: 2 topics, 2 pairs judged, 1 accepted\n"),
    ],
)
def test_without_anything_to_show_there_is_one_line(changes, expected):
    groups = tuple(Group(topic, ("p",), ("s",), Verdict.COMPATIBLE, "x") for topic in "ab")
    report = replace(Report(Verdict.COMPATIBLE, groups=groups, topics=2), **changes)
    assert render_full(report, Style()) == expected


def test_defaults_beside_a_stated_value_have_no_excerpt():
    place = Place("f.yaml", 1, 4)
    facts = (
        Fact("b", "2", "default", place),
        Fact("a", "v", "explicit", place),
        Fact("c", "3", "default", place),
    )
    text = render(finding(sides=(Side("publisher", ("p",), "set here", facts, place),)), text="a: v")
    assert "  --> f.yaml:1:4  p . a\n" in text
    assert "\n    = also b 2 (default), c 3 (default)\n" in text


def test_only_the_first_place_has_an_arrow():
    facts = tuple(Fact("policy", "v", "explicit", Place("f.yaml", line, 4)) for line in (1, 2))
    both = (
        Side("subscriber", ("s",), "requested here", facts),
        Side("publisher", ("p",), "offered here", facts),
    )
    text = render(finding(sides=both), text="a: v\nb: v")
    assert (text.count("-->"), text.count(":::")) == (1, 3)


def test_a_zero_that_stands_for_something_else_is_not_labelled_as_that():
    text = "cqos: 1\nprotocol: ros2\nparticipants:\n  a: {publishes: {/t: {depth: 0}}}\n  b: {subscribes: {/t: }}\n"
    shown = render_full(check(text.encode()), Style(sources={"<bytes>": text.encode()}))
    assert "depth offered here: `0` means 1" in shown


def test_errors_that_set_no_verdict_stand_beside_it():
    ours = Finding("CQ605", "team-rule", Severity.ERROR, "ours: it is not so")
    group = Group("t", ("p",), ("s",), Verdict.COMPATIBLE, "ros2")
    report = Report(Verdict.COMPATIBLE, (group,), (ours, ours), system="robot", endpoints=2, topics=1)
    last = "robot: compatible, 2 errors: 1 topic, 1 pair judged"
    assert render_full(report, Style()).splitlines()[-1] == last
    assert render_concise(report, Style()).splitlines()[-1] == last
    assert str(report).splitlines()[0] == "robot: compatible, 2 errors, 1 pair judged"
    accepted = replace(report, findings=(replace(ours, accepted="known"),))
    assert render_full(accepted, Style()).splitlines()[-1] == "robot: compatible: 1 topic, 1 pair judged, 1 accepted"


def test_a_fact_of_a_topic_is_not_labelled_as_offered():
    text = b"""cqos: 1
protocol: ros2
topics: {/t: {period: 2s}}
participants: {a: {publishes: {/t: {deadline: 1s}}}, b: {subscribes: {/t: {}}}}
"""
    shown = render_full(check(text), Style(sources={"<bytes>": text}, show=Severity.NOTE))
    assert "set here" in shown
    assert "period offered here" not in shown


def test_both_sides_in_one_line_are_marked_in_one_excerpt():
    text = (
        "{cqos: 1, protocol: ros2, participants: {a: {publishes: {t: {reliability: best_effort}}}, "
        "b: {subscribes: {t: {reliability: reliable}}}}}"
    )
    for width in (80, 100, 200):
        report = check(text.encode())
        shown = render_full(report, Style(width=width, sources={"<bytes>": text.encode()})).splitlines()
        assert sum(line.startswith(" 1 | ") for line in shown) == (2 if width < 100 else 1)
        assert sum("^^^^^^^^" in line for line in shown) == sum("-----------" in line for line in shown) == 1


def test_a_rule_that_was_seen_takes_nine_lines_in_all():
    text = "a: {publishes: {t: best_effort}}\nb: {subscribes: {t: reliable}}\n"

    def clash(name):
        offered = Fact("reliability", "best_effort", "explicit", Place("f.yaml", 1, 20))
        requested = Fact("reliability", "reliable", "explicit", Place("f.yaml", 2, 21))
        sides = (
            Side("subscriber", (f"{name}/s",), "requested here", (requested,)),
            Side("publisher", (f"{name}/p",), "offered here", (offered,)),
        )
        fixes = (
            Remedy("publisher", (), "reliability", "reliable", "configuration", f"offer `reliable` on {name}/x"),
            Remedy("subscriber", (), "reliability", "best_effort", "needs_code", f"request `best_effort` on {name}/x"),
        )
        notes = ("order of reliability: best_effort < reliable",)
        return finding(sides=sides, remedies=fixes, notes=notes, because="nothing is sent again", clause="DDS 1.4")

    first, second, _ = render(clash("a"), clash("b"), text=text).split("\n\n")
    assert second.split("\n") == [
        "error[X101] bad-thing: a bad thing",
        "  --> f.yaml:2:21  b/s . reliability",
        " 2 | b: {subscribes: {t: reliable}}",
        "   |                     ^^^^^^^^ requested here",
        "  ::: f.yaml:1:20  b/p . reliability",
        " 1 | a: {publishes: {t: best_effort}}",
        "   |                    ----------- offered here",
        "  help: offer `reliable` on b/x",
        "  help: or request `best_effort` on b/x (the program must keep this promise)",
    ]
    assert first.split("\n")[9:] == [
        "  note: order of reliability: best_effort < reliable",
        "  why: nothing is sent again",
        "  see: cqos rule X101; DDS 1.4",
    ]


def test_values_of_one_side_that_can_be_read_share_one_label():
    places = [Fact(name, "v", "explicit", Place("f.yaml", 1, column)) for name, column in (("p", 5), ("q", 11))]
    lines = render(finding(sides=(Side("publisher", ("a",), "set here", tuple(places)),)), text="{a: v, b: v}").split(
        "\n"
    )
    assert lines[2:4] == [" 1 | {a: v, b: v}", "   |     ^     ^ set here"]


def test_values_at_one_place_share_one_label():
    defaults = [Fact(name, f"w{name}", "default", Place("f.yaml", 1, 1)) for name in ("p", "q")]
    lines = render(finding(sides=(Side("publisher", ("a",), "set here", tuple(defaults)),)), text="a: ").split("\n")
    assert lines[2:4] == [" 1 | a:", "   | ^ set here: p wp (default), q wq (default)"]
