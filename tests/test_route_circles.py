"""Circles of routes, found without anybody who publishes: against names that are followed one by one."""

from __future__ import annotations

from itertools import product

import pytest
from hypothesis import given
from hypothesis import strategies as st

from cqos_core import Bridge, Participant, Route
from cqos_core.model.common_texts import Allowed, common_text
from cqos_core.model.re2_patterns import any_name_matcher
from tests.made_up_protocol import codes, only, place, settings
from tests.test_bridge_values import bridged, check, end

TOWNS = ("1", "2", "3")
TOPICS = ("*", "a/*", "b/*", "a/a/*", "*/c", "a/c", "b/c")
EXPRESSIONS = ((), ("[^/]*/c",), ("a/.*", "b/c"), (".{3}",), ("(?:a|b)(?:/c)?",))


def route(source, target, only=(), but=()):
    """A route between a topic in one town and one in another."""
    (here, topic), (there, name) = source, target
    ends = end("subscriber", f"{here}-{there}", topic), end("publisher", f"{there}-{here}", name)
    return Route(*ends, place(2), only, but)


def system_of(*bridges):
    """Bridges between towns; the sides of a bridge are in the town that their names begin with."""
    made = [Bridge(f"bridge{number}", tuple(routes), (), place(2)) for number, routes in enumerate(bridges)]
    sides = {side.participant for each in made for one in each.routes for side in (one.source, one.target)}
    towns = {side: Participant(side, settings=settings(town=side[0])) for side in sides}
    return bridged(bridges=made, abroad=(), participants=towns)


def loops(*bridges):
    return [each.message for each in check(system_of(*bridges)).findings if each.code == "CQ503"]


def test_bridges_of_everything_both_ways_are_a_loop_without_a_publisher():
    both = [route(("1", "*"), ("2", "*")), route(("2", "*"), ("1", "*"))]
    finding = only(check(system_of(both, both)), "CQ503")
    assert finding.severity == "error"
    assert finding.message == (
        "what is published on `*`, such as `x`, comes back over bridges: `x` → bridge0 → `x` → bridge1 → `x`"
    )
    assert loops(both) == []


@pytest.mark.parametrize(
    ("there", "back", "closed"),
    [
        ("a/*", "b/*", True),
        ("a/*", "c/*", False),
        ("b/*", "b/*", False),
        ("b/c/*", "b/*", False),
    ],
)
def test_prefixes_close_a_loop_or_keep_it_open(there, back, closed):
    """There from `a` to `b`; back from what is named here to `a`, or to what is named first."""
    found = loops(
        [route(("1", "a/*"), ("2", "b/*"))],
        [route(("2", back), ("1", there if there != "b/c/*" else "a/c/*"))],
    )
    assert bool(found) is closed


def test_a_chain_over_three_closes_under_the_names_that_all_carry():
    chain = [
        [route(("1", "*"), ("2", "*"), ("[^/]*/state",))],
        [route(("2", "*"), ("3", "up/*"))],
        [route(("3", "up/site/*"), ("1", "site/*"))],
    ]
    (message,) = loops(*chain)
    assert message.startswith("what is published on `site/*`, such as `site/state`, comes back over bridges: ")
    chain[2] = [route(("3", "up/site/*"), ("1", "site/*"), (), (".*/state",))]
    assert loops(*chain) == []


@pytest.mark.parametrize(
    ("only", "but"),
    [
        (".*", r"^rti/[^/]*$"),
        ("^sensors/.*$", "x"),
        ("(?i)SENSORS/.*", "x"),
        ("(?s:.*)", "x"),
        (r"(?P<town>\w+)/.*", "x"),
        (r"\x41.*", "x"),
        ("[[:alpha:]]+", "x"),
        (r"\Asensors/.*\z", "x"),
        (r"\bsensors\b.*", "x"),
        ("[a-z]{200}", "x"),
        (r"\p{Lu}.*", r"\p{Lu}"),
        (r"\QA.b\E.*", "x"),
    ],
)
def test_a_loop_is_found_however_its_expressions_are_written(only, but):
    both = [route(("1", "*"), ("2", "*"), (only,), (but,)), route(("2", "*"), ("1", "*"), (only,), (but,))]
    assert len(loops(both, both)) == 1
    other = [route(("1", "*"), ("2", "*"), (only,), (but,)), route(("2", "*"), ("1", "*"), (but,), (only,))]
    assert loops(other, other) == []


def test_one_direction_is_no_loop():
    assert loops(*[[route((town, "*"), (after, "*"))] for town, after in ("12", "13", "23")]) == []


@st.composite
def routes(draw):
    """A route between two different towns; names with a part that goes over keep it."""
    here, there = draw(st.permutations(TOWNS))[:2]
    source = draw(st.sampled_from(TOPICS))
    target = draw(st.sampled_from([each for each in TOPICS if ("*" in each) == ("*" in source)]))
    gates = draw(st.sampled_from(EXPRESSIONS)), draw(st.sampled_from(((), (), (".*/.*/.*",))))
    return route((here, source), (there, target), *(gates if "*" in source else ((), ())))


def after(name, one):
    """The name that a route makes of a name, None if it does not carry it."""
    before, star, behind = one.source.topic.partition("*")
    if not star:
        return one.target.topic if name == before else None
    if len(name) < len(before + behind) or not (name.startswith(before) and name.endswith(behind)):
        return None
    if (one.only and not any_name_matcher(one.only)(name)) or any_name_matcher(one.but)(name):
        return None
    return one.target.topic.replace("*", name[len(before) : len(name) - len(behind)], 1)


def goes_round(bridges, name, first):
    """Whether a name comes back over other bridges to the route that took it first."""
    waiting = [(first[1].target.participant[0], after(name, first[1]), first[0])]
    seen = set(waiting)
    for town, now, by in waiting:
        if now is None or len(now) > 9:
            continue
        for number, each in enumerate(bridges):
            for one in each:
                if number == by or one.source.participant[0] != town:
                    continue
                if one is first[1] and now == name:
                    return True
                state = (one.target.participant[0], after(now, one), number)
                if state not in seen:
                    seen.add(state)
                    waiting.append(state)
    return False


EVERY_NAME = ["/".join(each) for length in (1, 2, 3) for each in product("abcx", repeat=length)]


@given(st.lists(st.lists(routes(), min_size=1, max_size=2), min_size=2, max_size=3))
def test_a_loop_is_found_if_and_only_if_a_name_goes_round(bridges):
    expected = any(
        goes_round(bridges, name, (number, one))
        for number, each in enumerate(bridges)
        for one in each
        for name in EVERY_NAME
        if after(name, one) is not None
    )
    assert ("CQ503" in codes(check(system_of(*bridges)))) is expected


@pytest.mark.parametrize(
    ("expressions", "found"),
    [
        (("a{2,3}b+?", "(?:aaa|c)[^c]{2}"), "aaabb"),
        ((r"\d+", "[a-z]+"), None),
        ((r"[\w-]+\.x", r"y.*"), "y.x"),
        (("(?i)a",), "A"),
        (("a*", "b*"), None),
        (("^sensors/.*$", ".*/y"), "sensors/y"),
        ((r"\Aa|b\z", "[^a]"), "b"),
        (("a^b|a$b|c", "."), "c"),
        (("(?s:a.b)", "(?P<name>a)(?<other>.)b"), "axb"),
        (("(?i:A(?-i)B)c", "[a-z]B[a-z]"), "aBc"),
        ((r"\x41\x{42}\103", "[A-C]{3}"), "ABC"),
        (("[[:alpha:]]+[[:^alpha:]_]", ".1"), "x1"),
        ((r"x\b/\by", "..?y"), "x/y"),
        ((r"x\B.", r"x\b.|xy"), "xy"),
        ((r"x\b\w",), None),
        (("a{200}", "a{100,}"), "a" * 200),
        (("a{b?", "a."), "a{"),
        ((r"\pL/status", r"[^/]*/.*"), "x/status"),  # not read here, so guessed
        ((r"\p{Greek}+",), "\u03b1"),
        ((r"\pN", r"[a-z]"), None),
    ],
)
def test_a_text_that_several_expressions_allow(expressions, found):
    text = common_text(Allowed("", "", (each,), ()) for each in expressions)
    assert text == found
    assert text is None or all(any_name_matcher((each,))(text) for each in expressions)
