"""The library as callers use it."""

from __future__ import annotations

import ast
import importlib
import json
import pickle
import re
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor
from copy import deepcopy
from dataclasses import fields, is_dataclass, replace
from datetime import timedelta
from pathlib import Path
from typing import Any

import pytest

import cqos_core as cqos
from cqos_core.api import context
from cqos_core.language.domains import as_text
from cqos_core.language.parser import parse
from cqos_core.language.values import INFINITE
from cqos_core.language.vocabulary import Function
from cqos_core.packs.rule import requires
from tests.made_up_protocol import POST, RULES, checked, codes, only, participant, reader, world, writer

FILE = """\
cqos: 1
system: office
protocol: post
profiles:
  fast: {delay: 1s}
participants:
  a: {publishes: {box: {id: w, care: plain}}}
  b:
    subscribes: {box: {id: r, profile: fast, care: signed}}
"""
PACKS = [POST]


@pytest.fixture
def file(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    path = tmp_path / "system.yaml"
    path.write_text(FILE)
    return path


def test_the_library_as_the_design_shows_it(file: Path):
    report = cqos.check("system.yaml", packs=PACKS)
    assert report.verdict == "incompatible"
    assert [finding.code for finding in report.findings] == ["POST101", "POST102"]
    assert [(group.publishers, group.subscribers, group.codes) for group in report.groups] == [
        (("w",), ("r",), ("POST101", "POST102")),
    ]
    assert list(report.pairs) == [cqos.Pair("box", "w", "r", cqos.Verdict.INCOMPATIBLE)]
    pair = cqos.check_pair("post", offered={"care": "plain"}, requested={"care": "signed"}, packs=PACKS)
    assert (pair.verdict, [finding.code for finding in pair.findings]) == ("incompatible", ["POST101"])


def test_paths_bytes_and_systems_give_the_same_verdict(file: Path):
    for given in ("system.yaml", file, FILE.encode(), cqos.read(file)):
        assert codes(cqos.check(given, packs=PACKS)) == ["POST101", "POST102"]


def test_places_have_exact_columns(file: Path):
    finding = only(cqos.check("system.yaml", packs=PACKS), "POST101")
    assert [str(fact.place) for side in finding.sides for fact in side.facts] == [
        "system.yaml:9:52",
        "system.yaml:7:38",
    ]


def test_two_inputs_of_bytes_keep_their_own_places():
    first = "cqos: 1\nprotocol: post\nparticipants:\n  a: {publishes: {box: {id: w, care: plain}}}\n"
    second = f"# {'x' * 30}\n\n\n{first}".replace("a:", "b:").replace("publishes", "subscribes")
    second = second.replace("id: w, care: plain", "id: r, care:  signed")
    finding = only(cqos.check(first.encode(), second.encode(), packs=PACKS), "POST101")
    assert [str(fact.place) for side in finding.sides for fact in side.facts] == ["<bytes 2>:7:40", "<bytes>:4:38"]


def test_a_folder_is_one_system(file: Path):
    (file.parent / "more.yaml").write_text(FILE.replace("id: w", "id: w2").replace("id: r", "id: r2"))
    (file.parent / "notes.txt").write_text("not for us")
    assert cqos.check(file.parent, packs=PACKS).pair_count == 4


def test_reports_are_printed_for_people_and_shown_so_in_notebooks(file: Path):
    report = cqos.check("system.yaml", packs=PACKS)
    verdict, first, _ = str(report).splitlines()
    assert verdict == "office: incompatible, 1 pair judged"
    assert first == f"{report.findings[0].place}: error[POST101] {report.findings[0].message}"
    pair = cqos.explain("system.yaml", publisher="w", subscriber="r", packs=PACKS)
    assert str(pair).splitlines()[:2] == ["incompatible", first]

    class Cell(list[str]):
        text = list.append

    cell = Cell()
    for each in (report, pair):
        each._repr_pretty_(cell, False)
    assert cell == [str(report), str(pair)]


def test_findings_can_be_put_into_sets(file: Path):
    report = cqos.check("system.yaml", packs=PACKS)
    again = cqos.check("system.yaml", packs=PACKS)
    assert {*report.findings} == {*again.findings}
    assert len({report, again}) == 1


def test_threads_that_check_at_once_get_what_one_gets():
    systems = [
        world(writer("box", care=care, delay=f"{number}s"), reader("box", care="signed", delay="3s"))
        for care in ("plain", "signed")
        for number in range(6)
    ]
    alone = [cqos.check(system, packs=PACKS) for system in systems]
    interval = sys.getswitchinterval()
    sys.setswitchinterval(1e-6)
    try:
        with ThreadPoolExecutor(8) as threads:
            together = list(threads.map(lambda system: cqos.check(system, packs=PACKS), systems * 5))
    finally:
        sys.setswitchinterval(interval)
    assert together == alone * 5


def test_what_is_returned_travels_to_other_processes(file: Path):
    report, system = cqos.check("system.yaml", packs=PACKS), cqos.read("system.yaml")
    pair = cqos.check_pair("post", {"care": "plain"}, {"care": "signed"}, packs=PACKS)
    for each in (report, system, pair):
        assert pickle.loads(pickle.dumps(each)) == each  # noqa: S301 - our own bytes


def test_all_unreadable_inputs_are_reported_at_once(file: Path):
    with pytest.raises(cqos.InputError) as raised:
        cqos.check("gone.yaml", b"\x00", "system.yaml", b"cqos: 1\ncolour: red", packs=PACKS)
    assert [problem.code for problem in raised.value.problems] == ["CQ001", "CQ003", "CQ006"]
    assert "gone.yaml: cannot be read" in str(raised.value)
    with pytest.raises(cqos.InputError, match="there is nothing to read"):
        cqos.check()


def test_all_mistakes_in_a_system_of_the_caller_are_reported_at_once():
    system = cqos.System(protocol="post", participants={"a": cqos.Participant("a"), "c": cqos.Participant("b")})
    system.endpoints = [
        cqos.Endpoint(id="w", role="publisher", topic="box", participant="d"),
        cqos.Endpoint(id="x", role="pub", topic="box", participant="a"),  # type: ignore[arg-type]
        cqos.Endpoint(id="r", role="subscriber", topic="box", participant="a", settings={"care": "signed"}),  # type: ignore[dict-item]
    ]
    expected = [
        "endpoint `w` belongs to participant `d`, which is not there (known: a, c)",
        "endpoint `x` has the role `pub` (allowed: publisher, subscriber)",
        "`care` of endpoint `r` is 'signed', which is no `Setting` (settings hold their text: `Setting('reliable')`)",
        "participant `b` is kept under another id, `c`",
    ]
    for use in (cqos.read, cqos.Session, lambda given: cqos.check(given, packs=PACKS)):
        with pytest.raises(cqos.InputError) as raised:
            use(system)
        assert [str(problem) for problem in raised.value.problems] == expected


def test_the_systems_of_the_caller_stay_as_they_are(file: Path):
    systems = [
        world(writer("box"), participant("p", town=1)),
        world(reader("box", care="signed"), participant("p", town=2)),
    ]
    before = deepcopy(systems)
    first = cqos.check(*systems, packs=PACKS, options={"post": {"carrier": "bike"}}, protocol="post")
    assert systems == before
    assert cqos.check(*systems, packs=PACKS, options={"post": {"carrier": "bike"}}, protocol="post") == first


def test_options_of_the_caller_win_in_whatever_spelling():
    system = world(writer("box", care="usual"), reader("box", care="signed"), options={"carrier": "bike"})
    assert codes(cqos.check(system, packs=PACKS)) == ["POST101"]
    assert codes(cqos.check(system, packs=PACKS, options={"post": {"CARRIER": "train"}})) == []
    own = replace(system, participants={**system.participants, "writer": participant("writer", carrier="bike")})
    assert codes(cqos.check(own, packs=PACKS, options={"post": {"carrier": "train"}})) == ["POST101"]


def test_options_that_would_do_nothing_are_refused(file: Path):
    for use in (cqos.check, lambda given, **more: cqos.diff(given, given, **more)):
        with pytest.raises(cqos.CqosError, match="there is no rule pack `pots`; did you mean `post`"):
            use(file, packs=iter(PACKS), options={"pots": {"carrier": "bike"}})
        with pytest.raises(TypeError, match=r"options are by rule pack, as in .*'carrier': 'bike'"):
            use(file, packs=PACKS, options={"carrier": "bike"})  # type: ignore[dict-item]
        with pytest.raises(TypeError, match=r"as in \{'post': \{'carrier': 'bike'\}\}"):
            use(file, packs=PACKS, options={"post.carrier": "bike"})  # type: ignore[dict-item]


def test_what_is_no_input_is_refused_with_what_is(file: Path):
    for use in (cqos.check, cqos.read):
        with pytest.raises(TypeError, match="a path, bytes or a System, found list; pass several one by one"):
            use([file, file])  # type: ignore[arg-type]
        with pytest.raises(TypeError, match="a path, bytes or a System, found dict"):
            use({"cqos": 1})  # type: ignore[arg-type]


def test_a_protocol_of_the_caller_is_for_what_states_none(file: Path):
    file.write_text(FILE.replace("protocol: post\n", ""))
    assert codes(cqos.check(file, packs=PACKS)) == ["CQ201", "CQ404"]
    assert codes(cqos.check(file, packs=PACKS, protocol="post")) == ["POST101", "POST102"]


# Values as Python has them


@pytest.mark.parametrize(
    ("value", "text"),
    [
        ("2s", "2s"),
        (5, "5"),
        (True, "true"),
        (False, "false"),
        (INFINITE, "infinite"),
        (timedelta(seconds=2), "2000000000ns"),
        (timedelta(microseconds=1), "1000ns"),
        (timedelta(days=1, microseconds=1), "86400000001000ns"),
        (timedelta.max, "86399999999999999999000ns"),
        (timedelta(seconds=-1), "-1000000000ns"),
        (["a", "b c"], '[a, "b c"]'),
        ((), "[]"),
    ],
)
def test_python_values_have_a_spelling(value, text):
    assert as_text(value) == text


@pytest.mark.parametrize("value", [1.5, None, {"a": 1}, b"x", object()])
def test_what_has_no_spelling_is_refused(value: Any):
    with pytest.raises(TypeError, match="is no setting"):
        as_text(value)


def pair(offered: Any = None, requested: Any = None, **more: Any) -> cqos.PairReport:
    return cqos.check_pair("post", offered, requested, packs=PACKS, **more)


def test_settings_of_a_pair_may_be_python_values():
    assert pair({"delay": timedelta(seconds=2)}, {"delay": "2s"}).verdict == "compatible"
    assert pair({"delay": timedelta(seconds=2, microseconds=1)}, {"delay": "2s"}).verdict == "incompatible"
    assert pair({"delay": "1d"}, {"delay": INFINITE}).verdict == "compatible"
    assert pair({"copies": 5, "sealed": True, "streets": ["Elm"]}, {"sealed": True, "streets": ["Elm"]}).findings == ()
    negative = pair({"delay": timedelta(seconds=-1)}, {"delay": "1s"})
    assert (negative.verdict, negative.findings[0].code) == ("unknown", "CQ203")


def test_a_pair_may_use_presets_options_and_facts_of_its_topic():
    assert [f.code for f in pair({"profile": "careful"}).findings] == ["POST201"]
    assert pair({"care": "usual"}, {"care": "signed"}).verdict == "unknown"
    assert pair({"care": "usual"}, {"care": "signed"}, options={"carrier": "train"}).verdict == "compatible"
    deep = {"copies": 50}
    assert [f.code for f in pair(deep, topic={"urgent": True}).findings] == ["POST202"]
    assert [f.code for f in pair(deep, topic={"name": "x/urgent"}).findings] == ["POST202"]
    assert pair(deep).findings == ()


def test_a_pair_that_never_meets_is_not_known_to_fit():
    report = pair({"streets": ["Elm"], "care": "plain"}, {"streets": ["Oak"], "care": "signed"})
    assert (report.verdict, [finding.code for finding in report.findings]) == ("unknown", ["POST402"])
    assert "behind it" in report.findings[0].notes[0]


def test_a_pair_of_no_protocol_is_refused():
    with pytest.raises(cqos.CqosError, match=r"there is no rule pack `pots`; did you mean"):
        cqos.check_pair("pots", packs=PACKS)


# Explaining


def explained(
    system: cqos.System, publisher: str = "writer", subscriber: str = "reader", **more: Any
) -> cqos.PairReport:
    return cqos.explain(system, publisher=publisher, subscriber=subscriber, packs=PACKS, **more)


def test_every_policy_is_explained_with_both_values_and_where_they_come_from(file: Path):
    report = cqos.explain("system.yaml", publisher="w", subscriber="r", packs=PACKS)
    lines = {line.policy: line for line in report.policies}
    assert list(lines) == ["care", "delay", "copies", "sealed", "streets", "returned"]
    care, delay = lines["care"], lines["delay"]
    assert care.offered is not None
    assert delay.requested is not None
    assert (care.offered.value, care.offered.origin, care.verdict, care.rules) == (
        *("plain", "explicit", "incompatible", ("POST101",)),
    )
    assert (delay.requested.value, delay.requested.origin, delay.verdict) == ("1s", "profile fast", "incompatible")
    assert (lines["sealed"].verdict, lines["copies"].verdict) == ("compatible", None)


@pytest.mark.parametrize(("topic", "shown"), [({}, None), ({"period": "10ms"}, "10ms")])
def test_a_fact_that_rules_compare_has_a_line_where_it_is_stated(topic, shown):
    report = cqos.check_pair("ros2", {"depth": 5}, {"depth": 2}, topic=topic)
    values = {line.policy: line.requested.value for line in report.policies if line.requested is not None}
    assert values.get("period") == shown
    assert "need.latest" not in values


def test_a_line_is_never_worse_than_the_pair():
    """A rule that leaves doubt makes the pair unknown, and so it makes its policy."""
    doubtful = replace(POST, rules=(replace(RULES[0], doubt=True), *RULES[1:]))
    report = cqos.check_pair("post", {"care": "plain"}, {"care": "signed"}, packs=[doubtful])
    assert report.verdict == "unknown"
    assert [line.verdict for line in report.policies if line.policy == "care"] == ["unknown"]
    certain = cqos.check_pair(
        "post", {"care": "plain", "delay": "2s"}, {"care": "signed", "delay": "1s"}, packs=[doubtful]
    )
    assert certain.verdict == "incompatible"


@pytest.mark.parametrize(
    ("publisher", "subscriber", "message"),
    [
        ("writter", "reader", "there is no publisher `writter`; did you mean `writer`?"),
        ("writer", "nobody", "there is no subscriber `nobody`; known: other, reader"),
        ("reader", "writer", "`reader` is a subscriber, not a publisher"),
        (
            "writer",
            "other",
            "publisher `writer` is on post topic `box` and subscriber `other` on post topic `news`: they never meet",
        ),
    ],
)
def test_a_pair_that_cannot_be_explained_is_refused_with_the_reason(publisher, subscriber, message):
    system = world(writer("box"), reader("box"), reader("news", "other"))
    with pytest.raises(cqos.CqosError) as raised:
        explained(system, publisher, subscriber)
    assert message in str(raised.value)


def test_the_others_on_the_topic_count_where_values_come_from_peers():
    system = world(writer("box", care="insured", sealed=True), reader("box", care="best"))
    assert explained(system).verdict == "compatible"
    system.endpoints.append(writer("box", "plain_one"))
    system.participants["plain_one"] = participant("plain_one")
    assert explained(system).verdict == "compatible"
    assert explained(system, "plain_one").verdict == "unknown"


def test_check_pair_reports_a_failing_rule_too():
    def failing(*_: str) -> bool:
        raise OSError("disk")

    pack = replace(
        POST,
        functions=(*POST.functions, Function("failing", failing)),
        rules=(
            *RULES,
            requires(parse("failing(offered(stamp), requested(stamp))"), code="POST900", name="a", because="b"),
        ),
    )
    report = cqos.check_pair("post", {"stamp": "x"}, {"stamp": "x"}, packs=[pack])
    assert (report.verdict, [finding.code for finding in report.findings]) == ("unknown", ["CQ701"])


# The package


def test_every_public_name_is_there():
    names = vars(cqos)["__all__"]
    assert names == dir(cqos)
    assert all(getattr(cqos, name) is not None for name in names)
    with pytest.raises(AttributeError, match="no attribute `colour`"):
        cqos.colour  # type: ignore[attr-defined] # noqa: B018


def test_public_names_are_those_that_type_checkers_read():
    stub = ast.parse(Path(cqos.__file__).with_suffix(".pyi").read_text(encoding="utf-8"))
    typed = {
        str(name.asname): importlib.import_module(str(node.module))
        for node in ast.walk(stub)
        if isinstance(node, ast.ImportFrom)
        for name in node.names
    }
    assert sorted(typed) == dir(cqos)
    assert [name for name, home in typed.items() if getattr(cqos, name) is not getattr(home, name)] == []


def test_what_public_values_are_made_of_is_public_too():
    homes = [
        vars(importlib.import_module(f"cqos_core.{home}"))
        for home in ("model.finding", "model.report", "model.settings", "model.system")
    ]
    known = {name: each for home in homes for name, each in home.items() if is_dataclass(each)}
    for name in set(known) & set(dir(cqos)):
        words = {word for part in fields(known[name]) for word in re.findall(r"\w+", str(part.type))}
        assert words & set(known) <= set(dir(cqos)), name
    edits = [each for name, each in vars(cqos.Session).items() if name.startswith(("put", "set_"))]
    words = {word for each in edits for hint in each.__annotations__.values() for word in re.findall(r"\w+", hint)}
    assert words & set(known) <= set(dir(cqos))


def test_importing_the_package_imports_nothing_of_it():
    script = "import sys, cqos_core; print([m for m in sys.modules if m.startswith(('cqos_core.', 'yaml', 'lxml', 'pydantic'))])"
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"


def test_packs_of_the_caller_win_over_installed_ones_of_their_id():
    other = replace(POST, id="ros2", title="Not ROS")
    found = context([other]).find_pack("ros2")
    assert found is other
    assert checked(writer("box"), reader("box")).verdict == "compatible"


def test_text_where_settings_are_expected_is_answered_with_how_a_preset_is_named() -> None:
    with pytest.raises(TypeError, match=r"a preset is named by offered=\{'profile': 'sensor_data'\}"):
        cqos.check_pair("ros2", offered="sensor_data")  # type: ignore[arg-type]
    with pytest.raises(TypeError, match="`topic` must map names of settings to values, found 3"):
        cqos.check_pair("ros2", topic=3)  # type: ignore[arg-type]


def test_a_report_is_short_in_a_prompt_a_table_in_a_notebook_and_plain_data_for_programs() -> None:
    pair = cqos.check_pair("ros2", {"reliability": "best_effort"}, {"reliability": "reliable"})
    assert repr(pair) == "<PairReport: incompatible, 1 finding>"
    explained = pair.to_dict()
    assert explained == json.loads(json.dumps(explained))
    assert (explained["verdict"], explained["findings"][0]["code"]) == ("incompatible", "ROS101")
    assert explained["policies"][0]["offered"]["value"]
    assert "<td>ROS101</td>" in pair._repr_html_()
    text = b"cqos: 1\nsystem: <farm>\nprotocol: ros2\nparticipants: {a: {publishes: {t: sensor_data}}, b: {subscribes: {t: {}}}}\n"
    report = cqos.check(text)
    assert repr(report).startswith("<Report '<farm>': incompatible, 1 pair, 1 error, ")
    assert "&lt;farm&gt;: incompatible" in report._repr_html_()
    document = report.to_dict()
    assert document == json.loads(json.dumps(document))
    assert (document["verdict"], document["counts"]["pairs"]) == ("incompatible", 1)


def test_rows_are_flat_and_pandas_takes_them():
    report = cqos.check("examples/smart_agriculture_incompatible.bpmn")
    rows = report.rows()
    assert len(rows) == len(report.findings)
    assert {len(row) for row in rows} == {len(rows[0])}
    assert all(value is None or isinstance(value, (str, int)) for row in rows for value in row.values())
    pandas = pytest.importorskip("pandas")
    assert list(pandas.DataFrame(rows)["code"]) == [each.code for each in report.findings]
    assert list(pandas.DataFrame(report.pairs)["verdict"]) == [each.verdict for each in report.pairs]


def test_a_notebook_shows_the_policies_and_guarantees_of_a_pair():
    pair = cqos.check_pair("ros2", {"reliability": "best_effort"}, {"reliability": "reliable"})
    html = pair._repr_html_()
    assert "<td>reliability</td><td>best_effort</td><td>reliable</td><td>incompatible</td>" in html
    assert "<th>guarantee</th>" in html
    assert "<td>loss_free</td>" in html
