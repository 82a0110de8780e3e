"""Rule packs as values: what they say of themselves, and that a malformed one is refused where it is written."""

from __future__ import annotations

import json
from dataclasses import replace
from typing import Any

import pytest

from cqos_core.language.domains import Choice, Count, Duration, Flag, Text
from cqos_core.language.expression import define
from cqos_core.language.parser import parse
from cqos_core.language.policy import Derived, PerRole, Policy, by_option
from cqos_core.language.values import Anything, FromPeers, OneOf
from cqos_core.language.vocabulary import Function
from cqos_core.model.problems import PackError
from cqos_core.packs.catalogue import column_form, describe_pack, rule_table
from cqos_core.packs.pack import RulePack
from cqos_core.packs.pack_validation import KEPT
from cqos_core.packs.presets import Convention, Dialect, Preset
from cqos_core.packs.rule import forbids, matched_if, requires
from cqos_core.plugins import load_plugins
from tests.made_up_protocol import CARE, CARRIER, DELAY, POLICIES, POST, RULES, codes, reader, world, writer
from tests.made_up_protocol import checked as check_parts

# What a pack says of itself


def test_a_pack_finds_its_policies_and_rules_by_any_name():
    assert POST.policy("Treatment") is CARE
    assert POST.find("endpoint", "CARE") == 0
    assert POST.find("endpoint", "sorgfalt") is None
    assert POST.find("endpoint", "Sorgfalt", POST.dialects["form"]) == 0
    assert POST.find("topic", "care") is None
    with pytest.raises(KeyError):
        POST.policy("colour")
    found = [POST.rule(name) for name in ("POST101", "post101", "care-below-requested", "post001", "POST999")]
    assert [rule and rule.code for rule in found] == [*(["POST101"] * 4), None]


def test_a_pack_describes_itself_for_machines():
    described = json.loads(json.dumps(describe_pack(POST)))
    care, delay = described["policies"][:2]
    assert (care["name"], care["kind"], care["values"], care["ordered"]) == (
        *("care", "choice", ["plain", "signed", "insured"], True),
    )
    assert (care["default"], care["words"], care["aliases"]) == ("plain", ["usual", "best", "unknown"], ["treatment"])
    assert (delay["kind"], delay["unit"], delay["enforced"]) == ("duration", "ns", {"carrier": {"pigeon": "no"}})
    by_code = {rule["code"]: rule for rule in described["rules"]}
    assert list(by_code) == sorted(rule.code for rule in RULES)
    assert by_code["POST101"]["sentence"] == "offered(care) >= requested(care)"
    assert by_code["POST501"]["scope"] == "signal"
    assert described["presets"]["careful"] == {"care": "insured", "sealed": "true"}
    assert [policy["fact"] for policy in described["policies"] if policy["name"] == "stamp"] == [True]


@pytest.mark.parametrize("name", sorted(load_plugins().packs))
def test_the_packs_that_are_not_validated_at_each_start_are_well_formed(name):
    pack = load_plugins().pack(name)
    assert [replace(each, validated=False).id for each in (pack, *pack.variants.values())]


def test_a_pack_that_says_it_is_validated_binds_its_rules_on_use():
    care = RULES[0]
    assert replace(POST, rules=(care, care), validated=True).policies == POST.policies
    with pytest.raises(PackError):
        replace(POST, rules=(care, care), validated=False)


def test_every_rule_but_those_with_a_function_of_the_packs_own_has_a_column_form():
    assert [bound.rule.code for bound in POST.bound_rules if not column_form(bound)] == ["POST402"]
    with_columns = replace(POST, functions=tuple(replace(each, column=True) for each in POST.functions))
    assert all(column_form(bound) for bound in with_columns.bound_rules)


def table(code: str) -> list[tuple[str, ...]]:
    bound = next(each for each in POST.bound_rules if each.rule.code == code)
    return [tuple(row.values()) for row in rule_table(bound)]


def test_the_table_of_a_pair_rule_is_derived():
    assert table("POST101") == [
        ("plain", "plain", "Yes"),
        ("plain", "signed", "No"),
        ("plain", "insured", "No"),
        ("signed", "plain", "Yes"),
        ("signed", "signed", "Yes"),
        ("signed", "insured", "No"),
        *(("insured", wanted, "Yes") for wanted in ("plain", "signed", "insured")),
    ]
    assert ("insured", "plain", "No") in table("POST201")
    assert table("POST102")[:3] == [("1s", "1s", "Yes"), ("1s", "2s", "Yes"), ("1s", "infinite", "Yes")]


@pytest.mark.parametrize("code", ["POST202", "POST301", "POST401", "POST402", "POST403", "POST501"])
def test_what_cannot_be_enumerated_has_no_table(code):
    assert table(code) == []


# Mistakes

MALFORMED: dict[str, tuple[dict[str, Any], str]] = {
    "an unknown policy in a sentence": (
        {"rules": [requires(parse("offered(colour) == requested(colour)"), code="POST101", name="a", because="b")]},
        "rule POST101 `offered(colour) == requested(colour)`: `offered(colour)` names no policy at endpoint level",
    ),
    "a constant that is no value": (
        {"rules": [forbids(parse("care == 'express'"), code="POST301", name="a", because="b")]},
        "`express` is not one of its values; expected plain < signed < insured",
    ),
    "a code used twice": (
        {"rules": [*RULES[:1], replace(RULES[1], code="POST101")]},
        "`POST101` names both POST101 and POST101",
    ),
    "a name used twice": (
        {"rules": [*RULES[:2], replace(RULES[2], name="care-below-requested")]},
        "`care-below-requested` names both POST101 and POST103",
    ),
    "an alias that is a code": (
        {"rules": [*RULES[:2], replace(RULES[2], aliases=("POST102",))]},
        "`POST102` names both POST102 and POST103",
    ),
    "a fix that the rule does not read": (
        {"rules": [replace(RULES[0], fixes=("care", "delay"))]},
        "rule POST101: `fixes` names `delay`, which the condition does not read",
    ),
    "a fix of a side that the rule does not read": (
        {"rules": [replace(RULES[0], fixes=("offered care", "subscriber care"))]},
        "rule POST101: `fixes` names `subscriber care`, which the condition does not read",
    ),
    "a headline with a word for nothing": (
        {"rules": [replace(RULES[0], says="{publisher} has {offerd care} and {delay}")]},
        "rule POST101: `says` has {offerd care}, which stands for nothing here",
    ),
    "a meeting condition over one endpoint": (
        {"rules": [matched_if(parse("care == 'plain'"), code="POST401", name="a", because="b")]},
        "rule POST401: a meeting condition compares a publisher with a subscriber",
    ),
    "a role that there is not": (
        {"rules": [replace(RULES[5], role="writer")]},
        "role `writer` must be publisher or subscriber",
    ),
    "a policy declared twice": ({"policies": [*POLICIES, CARE]}, "a policy is declared twice"),
    "a spelling of two policies": (
        {"policies": [*POLICIES, Policy("handling", Flag(), aliases=("Treatment",))]},
        "`treatment` spells both policy `care` and policy `handling`",
    ),
    "a key of endpoints": (
        {"policies": [*POLICIES, Policy("label", Flag())]},
        "policy `label`: `label` is a key of the system file with a meaning of its own, so no policy can be set by it",
    ),
    "an alias that is a key of topics": (
        {"policies": [*POLICIES, Policy("outside", Flag(), level="topic", aliases=("External",))]},
        "policy `outside`: `external` is a key of the system file",
    ),
    "a default that is no value": (
        {"policies": [*POLICIES, Policy("a", Duration(), "5")]},
        "policy `a`: `5` has no unit",
    ),
    "a default of one role that is no value": (
        {"policies": [*POLICIES, Policy("a", Flag(), {"publisher": "true", "subscriber": "maybe"})]},
        "policy `a`: `maybe` is neither true nor false",
    ),
    "a level that there is not": (
        {"policies": [*POLICIES, Policy("a", Flag(), level="planet")]},
        "policy `a`: level `planet` must be one of endpoint, topic, participant, broker, option",
    ),
    "a name that no condition can have": (
        {"policies": [*POLICIES, Policy("reply-to", Flag())]},
        "no word of Python; write `reply_to`, and `reply-to` in its `aliases`",
    ),
    "a name that is a word of Python": ({"policies": [*POLICIES, Policy("from.class", Flag())]}, "no word of Python"),
    "a value that would not be read back": (
        {"policies": [*POLICIES, Policy("mode", Choice("None", "Sign And Encrypt"))]},
        "policy `mode`: value `Sign And Encrypt` must be written in the pack as `sign_and_encrypt`",
    ),
    "a value that an affix eats": (
        {"policies": [*POLICIES, Policy("mode", Choice("a", "mode_b", affixes=("mode_",)))]},
        "value `mode_b` must be written in the pack as `b`",
    ),
    "a value listed twice": (
        {"policies": [*POLICIES, Policy("mode", Choice("a", "b", "a"))]},
        "value `a` is listed twice",
    ),
    "a count without numbers": (
        {"policies": [*POLICIES, Policy("a", Count(5, 1))]},
        "there is no number from 5 to 1",
    ),
    "a unit of nothing": ({"policies": [*POLICIES, Policy("a", Duration(bare_unit="moons"))]}, "`moons` is no unit"),
    "a direction of a policy": (
        {"policies": [*POLICIES, Policy("a", Flag(), stronger="up")]},  # type: ignore[arg-type]
        "higher, lower or empty",
    ),
    "a direction without order": ({"policies": [*POLICIES, Policy("a", Text(), stronger="higher")]}, "have an order"),
    "a derived fact": ({"policies": [*POLICIES, Policy("a", Flag(), derived=Derived())]}, "needs the default"),
    "a role of a policy": ({"policies": [*POLICIES, Policy("a", Flag(), roles=("writer",))]}, "roles must be of"),
    "a word that is a value": (
        {"policies": [*POLICIES, Policy("a", Choice("b", "c"), words={"b": "c"})]},
        "policy `a`: word `b` is also a value",
    ),
    "a word in a spelling that is never read": (
        {"policies": [*POLICIES, Policy("a", Flag(), words={"As Usual": "true"})]},
        "word `As Usual` must be written in the pack as `as_usual`",
    ),
    "a word for no value": (
        {"policies": [*POLICIES, Policy("a", Flag(), words={"usual": PerRole("true", "sometimes")})]},
        "policy `a`: `sometimes` is neither true nor false",
    ),
    "a word that stands for itself": (
        {"policies": [*POLICIES, Policy("a", Flag(), words={"one": "two", "two": by_option("carrier", bike="one")})]},
        "policy `a`: word `one` stands for itself",
    ),
    "a zero that stands for itself": (
        {"policies": [*POLICIES, Policy("a", Duration(), words={"none": "0s"}, zero="none")]},
        "policy `a`: word `none` stands for itself",
    ),
    "a zero that is no word": (
        {"policies": [*POLICIES, Policy("a", Duration(), zero="none")]},
        "policy `a`: zero is `none`, which is none of its words (none: state it in `words`)",
    ),
    "a word by an unknown option": (
        {"policies": [*POLICIES, Policy("a", Flag(), words={"usual": by_option("vehicle", bike="true")})]},
        "policy `a`: `vehicle` is no option",
    ),
    "a word by an unknown value of an option": (
        {"policies": [*POLICIES, Policy("a", Flag(), words={"usual": by_option("carrier", plane="true")})]},
        "policy `a`: `plane` is not one of its values; expected bike, train, ship, pigeon",
    ),
    "peers put together in no known way": (
        {"policies": [*POLICIES, Policy("a", Flag(), words={"best": FromPeers("true", "average")})]},
        "policy `a`: peers are put together by `average`",
    ),
    "a lone value that is none": (
        {"policies": [*POLICIES, Policy("a", Flag(), words={"best": FromPeers("maybe", "constant")})]},
        "policy `a`: `maybe` is neither true nor false",
    ),
    "a word for one of values that are none": (
        {"policies": [*POLICIES, Policy("a", Choice("b"), None, level="option", words={"x": OneOf(("b", "c"))})]},
        "policy `a`: `c` is not one of its values",
    ),
    "enforced by an unknown option": (
        {"policies": [*POLICIES, Policy("a", Flag(), enforced={"vehicle": {"bike": "no"}})]},
        "policy `a`: `vehicle` is no option",
    ),
    "enforced in no known way": (
        {"policies": [*POLICIES, Policy("a", Flag(), enforced={"carrier": {"bike": "never", "plane": "no"}})]},
        "policy `a`: `enforced` says `never`; it must be yes, unmatched or no",
    ),
    "an assumption that is no value": (
        {"policies": [*POLICIES, Policy("a", Choice("b"), level="option", assume=("c",), fallback="d")]},
        "policy `a`: `c` is not one of its values",
    ),
    "a preset of an unknown policy": (
        {"presets": {"new": Preset({"colour": "red"})}},
        "preset `new`: `colour` is no endpoint policy",
    ),
    "a preset with a value that is none": (
        {"presets": {"new": Preset({"care": "express"})}},
        "preset `new`: `care`: `express` is not one of its values",
    ),
    "a preset since an unknown time": (
        {"presets": {"new": Preset({}, needs=("year", "y1066"))}},
        "preset `new`: `y1066` is not one of its values",
    ),
    "a preset by an unknown option": (
        {"presets": {"new": Preset({}, needs=("age", "1"))}},
        "preset `new`: `age` is no option",
    ),
    "one name for two presets": (
        {"presets": {**POST.presets, "new": Preset({}, aliases=("Value",))}},
        "`Value` names both preset `careful` and preset `new`",
    ),
    "a base preset that there is not": ({"base_preset": "usual"}, "base preset `usual` is not among the presets"),
    "a dialect of an unknown policy": (
        {"dialects": {"form": Dialect(names={"farbe": "colour"})}},
        "dialect `form`: `farbe` is read as `colour`, which is no policy",
    ),
    "a dialect's name in a spelling that is never read": (
        {"dialects": {"form": Dialect(names={"Farbe": "care"})}},
        "dialect `form`: `Farbe` must be written in the pack as `farbe`; files may write both",
    ),
    "codes of an unknown policy": (
        {"dialects": {"form": Dialect(codes={"colour": {"1": "red"}})}},
        "dialect `form`: `codes` names `colour`, which is no policy",
    ),
    "a code of no value": (
        {"dialects": {"form": Dialect(codes={"care": {"1": "express"}})}},
        "dialect `form`: code of `care`: `express` is not one of its values",
    ),
    "a dialect's unit of nothing": ({"dialects": {"form": Dialect(bare_unit="moons")}}, "`moons` is no unit of time"),
    "a convention about an unknown policy": (
        {"conventions": (Convention("*", {"care": "plain"}),)},
        "convention of `*`: `care` is no topic policy",
    ),
    "a convention with a value that is none": (
        {"conventions": (Convention("*", {"urgent": "very"}),)},
        "convention of `*`: `urgent`: `very` is neither true nor false",
    ),
    "a function with the name of one of the language": (
        {"functions": (*POST.functions, Function("overlaps", lambda: True))},
        "function `overlaps` has a name that is taken",
    ),
    "a definition with the name of a policy": (
        {"rules": [forbids(define("care", CARE == "signed") & (DELAY == "1s"), code="POST301", name="a", because="b")]},
        "`care` names a definition and a policy",
    ),
    "a name of two definitions": (
        {
            "rules": [
                forbids(define("a", CARE == "signed"), code="POST301", name="a", because="b"),
                forbids(define("a", CARE == "plain"), code="POST302", name="b", because="b"),
            ]
        },
        '`a` is defined as `care == "signed"` and as `care == "plain"`',
    ),
    "a variant of an unknown option": ({"variants": {("mode", "raw"): POST}}, "`mode` is no option"),
}


def test_the_keys_that_policies_cannot_have_are_those_of_the_system_file():
    from cqos_core.importers import yaml_form

    forms = {"endpoint": yaml_form.ENDPOINT, "topic": yaml_form.TOPIC, "broker": yaml_form.BROKER}
    # A policy may well be the type, which endpoints hand on to it.
    assert {level: frozenset(form.keys) - {"type"} for level, form in forms.items()} == KEPT


@pytest.mark.parametrize(("changes", "message"), MALFORMED.values(), ids=MALFORMED)
def test_a_malformed_pack_is_refused_when_it_is_made(changes, message):
    changes = {name: tuple(value) if isinstance(value, list) else value for name, value in changes.items()}
    with pytest.raises(PackError) as refused:
        replace(POST, **changes)
    assert str(refused.value).startswith("rule pack `post` is not well formed:\n")
    assert message in str(refused.value)


def test_every_mistake_is_named_at_once():
    with pytest.raises(PackError) as refused:
        RulePack(
            "bad",
            "Bad",
            (Policy("Mode", Choice("A", "B"), "C"), Policy("time", Duration(), "soon", zero="none")),
            (
                requires(parse("offered(mood) > 1"), code="BAD101", name="a", because="b"),
                requires(parse("offered(time) < 5"), code="BAD101", name="a", because="b"),
            ),
            presets={"p": Preset({"x": "y"})},
            base_preset="q",
            dialects={"d": Dialect(names={"t": "u"})},
            conventions=(Convention("*", {"v": "w"}),),
        )
    message = str(refused.value)
    for part in ("`Mode`", "value `A`", "`C` is not one", "`soon`", "zero is", "offered(mood)", "`5` has no unit"):
        assert part in message
    for part in ("`BAD101` names both", "`x` is no", "base preset `q`", "`t` is read as", "`v` is no topic"):
        assert part in message
    where = {at for at, _ in refused.value.mistakes}
    assert where >= {
        ("policies", "Mode"),
        ("policies", "Mode", "values"),
        ("policies", "Mode", "default"),
        ("policies", "time"),
        ("rules", "BAD101"),
        ("rules", "BAD101", "condition"),
        ("presets", "p"),
        ("base_preset",),
    }


@pytest.mark.parametrize(
    ("metadata", "message"),
    [
        ({"code": "post101"}, "must be 2 to 8 capitals and three digits"),
        ({"code": "POST1"}, "must be 2 to 8 capitals and three digits"),
        ({"name": "CareBelow"}, "must be the bad pattern in kebab case"),
        ({"because": ""}, "`because` must be a reason without a final stop"),
        ({"because": "It hurts."}, "`because` must be a reason without a final stop"),
        ({"severity": "fatal"}, "severity `fatal` must be error, warning or note"),
    ],
)
def test_a_rule_without_proper_metadata_is_refused(metadata, message):
    good: dict[str, Any] = {"code": "POST101", "name": "a-b", "because": "c"}
    with pytest.raises(PackError, match=message):
        requires(RULES[0].condition, **{**good, **metadata})


def test_words_may_mean_many_things():
    """The well-formed side of the mistakes above."""
    policy = Policy(
        "mode",
        Choice("a", "b"),
        "usual",
        words={
            "usual": by_option("carrier", bike="other", otherwise=PerRole("a", FromPeers("b", "constant"))),
            "other": Anything("nobody knows"),
        },
    )
    delay = Policy("pause", Duration(), "0s", words={"none": "infinite"}, zero="none")
    replace(POST, policies=(*POLICIES, policy, delay), rules=())


# Severities that depend on an option

STRICTNESS = Policy("strictness", Choice("off", "lax", "strict", ordered=False), "lax", level="option")
BY_STRICTNESS = by_option("strictness", lax="note", strict="error")
STRICT_POST = replace(
    POST,
    policies=(*POLICIES, STRICTNESS),
    rules=(replace(RULES[0], severity=BY_STRICTNESS), replace(RULES[5], severity=BY_STRICTNESS, aliases=("POST391",))),
)


@pytest.mark.parametrize(
    ("strictness", "said", "verdict"),
    [
        ({}, [("POST101", "note"), ("POST301", "note")], "incompatible"),
        ({"strictness": "strict"}, [("POST101", "error"), ("POST301", "error")], "incompatible"),
        ({"strictness": "off"}, [], "compatible"),
    ],
)
@pytest.mark.parametrize("readers", [1, 900])
def test_a_severity_may_depend_on_an_option(strictness, said, verdict, readers):
    """The second number has so many distinct values that they are judged many at once."""
    parts = [writer("a", f"w{at}", delay=f"{at + 1}s") for at in range(2 if readers > 1 else 1)]
    parts += [reader("a", f"r{at}", care="insured", delay=f"{at + 9}s") for at in range(readers)]
    report = check_parts(*parts, options=strictness, packs=[STRICT_POST])
    found = dict.fromkeys((each.code, str(each.severity)) for each in report.findings if each.code.startswith("POST"))
    assert sorted(found) == said
    assert report.verdict == verdict


def test_a_rule_with_several_severities_is_described_once():
    first, second = describe_pack(STRICT_POST)["rules"]
    assert (first["severity"], first["sentence"]) == ("note", "offered(care) >= requested(care)")
    assert first["severity_by"] == {"option": "strictness", "severities": {"lax": "note", "strict": "error"}}
    assert second["severity_by"] == first["severity_by"]
    assert STRICT_POST.rule("POST391") is STRICT_POST.rules[1]
    assert describe_pack(POST)["rules"][0]["severity_by"] is None


@pytest.mark.parametrize(
    ("severity", "message"),
    [
        (by_option("carrier", bike="note"), "`carrier`, which is no option with a default and listed values"),
        (by_option("care", plain="note"), "`care`, which is no option with a default and listed values"),
        (by_option("strictness", slack="note"), "names `slack`, but option `strictness` is one of off, lax, strict"),
        (by_option("strictness", lax="fatal"), "severity `fatal` must be error, warning or note"),
        (by_option("strictness"), "lists no value of option `strictness`"),
    ],
)
def test_a_severity_by_an_unfit_option_is_refused(severity, message):
    with pytest.raises(PackError, match=message):
        replace(STRICT_POST, rules=(replace(RULES[0], severity=severity),))


# Functions of a pack


def failing(*_: object) -> bool:
    raise ZeroDivisionError("division by zero")


def test_a_function_that_fails_is_a_finding_and_the_other_rules_are_judged():
    pack = replace(
        POST,
        functions=(Function("failing", failing),),
        rules=(
            *(rule for rule in RULES if rule.code != "POST402"),
            requires(parse("failing(offered(stamp))"), code="POST901", name="a", because="b"),
            forbids(parse("failing(stamp)"), code="POST902", name="c", because="b"),
        ),
    )

    report = check_parts(
        world(writer("box", stamp="x", care="plain"), reader("box", stamp="x", care="signed")), packs=[pack]
    )
    assert codes(report) == ["CQ701", "CQ701", "POST101"]
    assert [finding.message for finding in report.findings[:2]] == [
        f"rule {code} could not be judged: ZeroDivisionError: division by zero" for code in ("POST901", "POST902")
    ]
    assert report.verdict == "incompatible"


def test_memory_that_is_short_is_no_fault_of_a_function_and_not_remembered_as_one():
    short = True

    def hungry(*_: object) -> bool:
        if short:
            raise MemoryError
        return True

    rule = requires(parse("hungry(offered(stamp))"), code="POST901", name="a", because="b")
    pack = replace(POST, functions=(Function("hungry", hungry),), rules=(rule,))

    asked = world(writer("box", stamp="x"), reader("box", stamp="x"))
    with pytest.raises(MemoryError):
        check_parts(asked, packs=[pack])
    short = False
    assert codes(check_parts(asked, packs=[pack])) == []


# Options that a pack declares


def test_a_pack_may_be_another_one_under_an_option():
    mode = Policy("mode", Choice("strict", "lax", ordered=False), "strict", level="option")
    policies = (*POLICIES, mode)
    lax = replace(POST, policies=policies, rules=RULES[1:])
    pack = replace(POST, policies=policies, variants={("mode", "lax"): lax})

    packs = [pack]
    pair = [writer("box", care="plain"), reader("box", care="signed")]
    assert codes(check_parts(*pair, packs=packs)) == ["POST101"]
    assert codes(check_parts(*pair, packs=packs, options={"mode": "Lax"})) == []


def test_facts_have_no_default_and_policies_read_what_they_print():
    for policy in POLICIES:
        for role in ("publisher", "subscriber"):
            text = policy.default_for(role)
            if text is not None and text not in policy.words:
                assert policy.domain.format(policy.domain.parse(text)) == text
    assert (CARRIER.default, DELAY.default) == (None, "infinite")
    assert isinstance(Text().parse("x"), str)
