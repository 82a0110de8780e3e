"""Rule packs in YAML files: the same value as one written in Python, and mistakes with their lines."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import pytest
from hypothesis import given
from hypothesis import strategies as st

from cqos_core import check, check_pair
from cqos_core.files.source_files import read_path
from cqos_core.language.domains import Choice, Count, Duration, Flag, Names, Text
from cqos_core.language.parser import parse
from cqos_core.language.policy import Derived, PerRole, Policy, by_option
from cqos_core.language.values import Anything, FromPeers
from cqos_core.model.problems import InputError, Problem
from cqos_core.model.settings import Setting
from cqos_core.model.source import Source
from cqos_core.model.system import Endpoint, Participant, System
from cqos_core.packs.catalogue import describe_pack
from cqos_core.packs.pack import RulePack
from cqos_core.packs.pack_yaml import read_pack
from cqos_core.packs.presets import Convention, Dialect, Preset
from cqos_core.packs.property_panel import Panel
from cqos_core.packs.rule import forbids, matched_if, requires
from cqos_core.packs.timing import Timing
from tests.behaviour.model_text import model

if TYPE_CHECKING:
    import random

EXAMPLES = Path(__file__).parent.parent / "examples" / "opcua"

# One pack, twice

FILE = """
cqos_pack: 1
id: mail
title: Mail
summary: Letters.
source: made up
policies:
  care:
    kind: choice
    values: [plain, signed, insured]
    default: plain
    doc: How letters are treated.
    clause: "1"
    aliases: [treatment]
    affixes: [care_]
    synonyms: {registered: signed}
    words:
      usual: {by_option: carrier, cases: {bike: plain}, otherwise: {publisher: signed, subscriber: plain}}
      best: {publisher: insured, subscriber: {from_peers: strongest_if_all, alone: insured}}
      odd: {unknown: nobody knows}
  delay: {kind: duration, default: infinite, words: {none: infinite}, zero: none, promise: true, stronger: lower,
          enforced: {carrier: {pigeon: "no"}}}
  copies: {kind: count, minimum: 1, maximum: 9, unlimited: [all], unit: letters, default: {publisher: 2, subscriber: 3}}
  sealed: {kind: flag, default: false, derived: true, roles: [publisher, subscriber]}
  streets: {kind: names, default: "[]"}
  stamp: {kind: text}
  pause: {kind: duration, unit: ms, level: topic}
  urgent: {kind: flag, level: topic, default: no}
  carrier: {kind: choice, values: [bike, train, pigeon], ordered: false, level: option, assume: [bike, train],
            fallback: bike}
presets:
  standard: {settings: {copies: 4}}
  valuable: {settings: {care: insured, sealed: true}, doc: Valuable letters., aliases: [VALUE], needs: {carrier: train}}
base_preset: standard
panel:
  groups: {Treatment: [care, sealed]}
  advanced: [streets]
  labels: {care: How it is treated}
  values: {care: {signed: The receiver signs., usual: As usual.}}
  value_labels: {care: {signed: With a signature}}
  roles: {copies: [publisher]}
dialects:
  yaml: {}
  form: {names: {sorgfalt: care}, codes: {care: {"1": signed}}, bare_unit: s, zero_is_unset: true, ignore: [colour],
         writes: {care: sorgfalt, copies: ""}, words: [usual]}
conventions:
  - {pattern: "*/urgent", settings: {urgent: true}, doc: Cannot wait.}
  - {pattern: archive, external: true}
rules:
  - requires: offered(care) >= requested(care)
    code: MAIL101
    name: care-below-requested
    because: letters are treated worse than the reader asks for
    clause: "1"
    aliases: [MAIL001]
  - requires: offered(delay) <= requested(delay)
    code: MAIL102
    name: delay-above-requested
    because: letters may come too late
    doubt: true
  - matched_if: overlaps(offered(streets), requested(streets)) | (offered(streets) == requested(streets))
    code: MAIL401
    name: streets-split
    because: they have no street in common
    always: true
  - forbids: (care == "insured") & ~sealed & stated(care)
    code: MAIL301
    name: insured-unsealed
    says: "{endpoint} is open"
    because: nobody insures what is open
    severity: error
    role: publisher
    creation: true
    fixes: [sealed]
    help: seal it
not_checked: [whether it rains]
"""

TWIN = RulePack(
    "mail",
    "Mail",
    summary="Letters.",
    source="made up",
    policies=(
        Policy(
            "care",
            Choice("plain", "signed", "insured", affixes=("care_",), synonyms={"registered": "signed"}),
            "plain",
            "How letters are treated.",
            "1",
            aliases=("treatment",),
            words={
                "usual": by_option("carrier", PerRole("signed", "plain"), bike="plain"),
                "best": PerRole("insured", FromPeers("insured", "strongest_if_all")),
                "odd": Anything("nobody knows"),
            },
        ),
        Policy(
            "delay",
            Duration(),
            "infinite",
            words={"none": "infinite"},
            zero="none",
            promise=True,
            stronger="lower",
            enforced={"carrier": {"pigeon": "no"}},
        ),
        Policy("copies", Count(1, 9, unlimited=("all",), unit="letters"), {"publisher": "2", "subscriber": "3"}),
        Policy("sealed", Flag(), "false", derived=Derived()),
        Policy("streets", Names(), "[]"),
        Policy("stamp", Text()),
        Policy("pause", Duration(bare_unit="ms"), level="topic"),
        Policy("urgent", Flag(), "no", level="topic"),
        Policy(
            "carrier",
            Choice("bike", "train", "pigeon", ordered=False),
            level="option",
            assume=("bike", "train"),
            fallback="bike",
        ),
    ),
    presets={
        "standard": Preset({"copies": "4"}),
        "valuable": Preset(
            {"care": "insured", "sealed": "true"}, "Valuable letters.", ("carrier", "train"), aliases=("VALUE",)
        ),
    },
    base_preset="standard",
    dialects={
        "yaml": Dialect(),
        "form": Dialect(
            {"sorgfalt": "care"},
            {"care": {"1": "signed"}},
            "s",
            True,
            frozenset({"colour"}),
            {"care": "sorgfalt", "copies": ""},
            ("usual",),
        ),
    },
    panel=Panel(
        {"Treatment": ("care", "sealed")},
        ("streets",),
        {"care": "How it is treated"},
        {"care": {"signed": "The receiver signs.", "usual": "As usual."}},
        {"care": {"signed": "With a signature"}},
        {"copies": ("publisher",)},
    ),
    conventions=(
        Convention("*/urgent", {"urgent": "true"}, doc="Cannot wait."),
        Convention("archive", external=True),
    ),
    rules=(
        requires(
            parse("offered(care) >= requested(care)"),
            code="MAIL101",
            name="care-below-requested",
            because="letters are treated worse than the reader asks for",
            clause="1",
            aliases=("MAIL001",),
        ),
        requires(
            parse("offered(delay) <= requested(delay)"),
            code="MAIL102",
            name="delay-above-requested",
            because="letters may come too late",
            doubt=True,
        ),
        matched_if(
            parse("overlaps(offered(streets), requested(streets)) | (offered(streets) == requested(streets))"),
            code="MAIL401",
            name="streets-split",
            because="they have no street in common",
            always=True,
        ),
        forbids(
            parse('(care == "insured") & ~sealed & stated(care)'),
            code="MAIL301",
            name="insured-unsealed",
            says="{endpoint} is open",
            because="nobody insures what is open",
            severity="error",
            role="publisher",
            creation=True,
            fixes=("sealed",),
            help="seal it",
        ),
    ),
    not_checked=("whether it rains",),
)


def source(text: str) -> Source:
    return Source("pack.yaml", text.encode())


def test_a_pack_in_a_file_describes_itself_like_its_twin_in_python():
    assert describe_pack(read_pack(source(FILE))) == describe_pack(TWIN)


def test_the_former_name_of_a_matching_condition_is_read_alike():
    assert describe_pack(read_pack(source(FILE.replace("  - matched_if:", "  - meets:")))) == describe_pack(TWIN)


def test_what_is_null_in_a_file_is_not_stated():
    text = FILE.replace("    doubt: true", "    doubt: true\n    severity: null\n    forbids: null", 1)
    assert describe_pack(read_pack(source(text))) == describe_pack(TWIN)


def test_a_severity_by_option_in_a_file_is_that_of_python():
    text = FILE.replace(
        "severity: error", "severity: {by_option: tone, cases: {soft: note}, otherwise: error}"
    ).replace("presets:\n", "  tone: {kind: choice, values: [soft, loud], level: option, default: soft}\npresets:\n", 1)
    assert read_pack(source(text)).rules[3].severity == by_option("tone", "error", soft="note")
    described = {rule["code"]: rule for rule in describe_pack(read_pack(source(text)))["rules"]}
    assert described["MAIL301"]["severity_by"] == {
        "option": "tone",
        "severities": {"soft": "note", "loud": "error"},
    }


def test_definitions_in_a_file_are_those_of_python():
    text = FILE.replace("rules:\n", 'define:\n  open: ~sealed\n  risky: (care == "insured") & open\nrules:\n', 1)
    text = text.replace('(care == "insured") & ~sealed & stated(care)', "risky & stated(care)")
    pack = read_pack(source(text))
    assert [str(rule.condition) for rule in pack.rules][3] == "risky & stated(care)"
    assert {name: node.text() for name, node in pack.definitions.items()} == {
        "risky": '(care == "insured") & open',
        "open": "~sealed",
    }
    assert pack.rules == TWIN.rules


def test_every_key_of_a_pack_in_a_file_means_what_it_means_in_python():
    written = read_pack(source(FILE))
    for mine, other in zip(written.policies, TWIN.policies, strict=True):
        assert vars(mine.domain) == vars(other.domain)
        assert (mine.words, mine.assume, mine.fallback, mine.zero, mine.promise) == (
            *(other.words, other.assume, other.fallback, other.zero, other.promise),
        )
        assert (mine.stronger, mine.derived) == (other.stronger, other.derived)
    assert written.rules == TWIN.rules
    assert (written.presets, written.dialects, written.conventions) == (TWIN.presets, TWIN.dialects, TWIN.conventions)
    assert written.panel == TWIN.panel


settings = st.fixed_dictionaries(
    {},
    optional={
        "care": st.sampled_from(["plain", "Registered", "insured", "usual", "best", "odd", "nonsense"]),
        "delay": st.sampled_from(["1s", "2s", "0s", "none", "5"]),
        "copies": st.sampled_from(["1", "all", "99"]),
        "sealed": st.sampled_from(["true", "false"]),
        "streets": st.sampled_from(["[]", "[a]", "[a, b]"]),
        "colour": st.just("red"),
    },
)


@st.composite
def systems(draw):
    system = System(protocol="mail")
    carrier = draw(st.sampled_from([None, "bike", "pigeon", "plane"]))
    system.options = {"mail": {} if carrier is None else {"carrier": Setting(carrier)}}
    for number in range(draw(st.integers(1, 4))):
        name = f"e{number}"
        system.participants[name] = Participant(name)
        stated = {key: Setting(text) for key, text in draw(settings).items()}
        role = draw(st.sampled_from(["publisher", "subscriber"]))
        dialect = draw(st.sampled_from(["yaml", "form"]))
        system.endpoints.append(
            Endpoint(id=name, role=role, topic="a/urgent", participant=name, settings=stated, dialect=dialect)
        )
    return system


@given(systems())
def test_both_give_the_same_report(system):
    assert check(system, packs=[read_pack(source(FILE))]) == check(system, packs=[TWIN])


def test_the_example_of_a_fourth_protocol_gives_exactly_the_error_that_it_announces():
    """`examples/opcua`: one of the three pairs does not work."""
    pack = read_pack(read_path(str(EXAMPLES / "opcua_pack.yaml")))
    report = check(EXAMPLES / "press_line.yaml", packs=[pack])
    assert report.pair_count == 3
    assert sorted(str(group.verdict) for group in report.groups) == ["compatible", "compatible", "incompatible"]
    (error,) = [finding for finding in report.findings if finding.severity == "error"]
    assert error.code == "OPC101"
    assert (error.sides[0].members, error.sides[1].members) == (
        ("line_controller/subscriber/press/force",),
        ("press/publisher/press/force",),
    )
    assert [(remedy.role, remedy.policy, remedy.value, remedy.kind) for remedy in error.remedies] == [
        ("publisher", "keep_alive_time", "500ms", "configuration"),
        ("subscriber", "message_receive_timeout", "1s", "configuration"),
    ]
    assert str(error.place).startswith(str(EXAMPLES / "press_line.yaml:"))


def test_each_rule_of_the_example_speaks_and_is_silent():
    pack = read_pack(read_path(str(EXAMPLES / "opcua_pack.yaml")))

    def found(offered, requested):
        return {finding.code for finding in check_pair("opcua", offered, requested, packs=[pack]).findings}

    assert found({}, {}) == set()
    for code, offered, requested in [
        ("OPC101", {"keep_alive_time": "2s"}, {"message_receive_timeout": "1999ms"}),
        ("OPC102", {"security_mode": "sign"}, {}),
        ("OPC103", {}, {"encoding": "json"}),
        ("OPC104", {}, {"delivery_guarantee": "at_least_once"}),
        ("OPC201", {"key_frame_count": 10}, {"complete_within": "9s"}),
        ("OPC301", {"keep_alive_time": "999ms"}, {}),
    ]:
        assert found(offered, requested) == {code}
    assert found({"keep_alive_time": "2s"}, {"message_receive_timeout": "2s"}) == set()
    assert found({"key_frame_count": 10}, {"complete_within": "10s"}) == set()


# Mistakes and their lines


def problems(text: str) -> tuple[Problem, ...]:
    with pytest.raises(InputError) as refused:
        read_pack(source(text))
    for problem in refused.value.problems:
        assert problem.place is not None
        assert problem.place.source == "pack.yaml"
    return refused.value.problems


def lines(text: str) -> list[tuple[int | None, str]]:
    return [(problem.place.line if problem.place else None, problem.message) for problem in problems(text)]


WRONG = {
    "an unknown key": (
        FILE.replace("promise: true", "promises: true"),
        "promise: true",
        "`promises` is no key here; did you mean `promise`?",
    ),
    "an unknown key of a rule": (FILE.replace("doubt: true", "doubts: true"), "doubt:", "did you mean `doubt`?"),
    "an unknown key of the pack": (FILE.replace("title: Mail", "titel: Mail"), "title:", "did you mean `title`?"),
    "an unknown kind": (
        FILE.replace("kind: count", "kind: number"),
        "kind: count",
        "`policies.copies.kind` must be `choice`, `duration`, `count`, `flag`, `names` or `text`, found `number`",
    ),
    "a choice without values": (
        FILE.replace("    values: [plain, signed, insured]\n", ""),
        "  care:",
        "a choice lists its `values`",
    ),
    "two sentences": (
        FILE.replace("    doubt: true", '    forbids: care == "plain"'),
        "- requires: offered(delay)",
        "a rule has exactly one of `requires`, `forbids`, `matched_if` and `gives`",
    ),
    "no sentence": (
        FILE.replace("requires: offered(care) >= requested(care)\n    ", ""),
        "- requires: offered(care)",
        "exactly one of",
    ),
    "a sentence that is none": (
        FILE.replace("offered(delay) <= requested(delay)", "offered(delay) and requested(delay)"),
        "- requires: offered(delay)",
        "use & and | instead of `and` and `or`",
    ),
    "a sentence over an unknown policy": (
        FILE.replace("offered(delay) <= requested(delay)", "offered(delays) <= requested(delay)"),
        "- requires: offered(delay)",
        "`offered(delays)` names no policy at endpoint level",
    ),
    "a definition that cannot be read": (
        FILE.replace("rules:\n", "define:\n  open: not sealed\nrules:\n", 1),
        "rules:",
        "`define.open`: use ~(…) instead of `not`",
    ),
    "a code that is none": (
        FILE.replace("code: MAIL102", "code: M2"),
        "- requires: offered(delay)",
        "rule code `M2` must",
    ),
    "a code used twice": (
        FILE.replace("code: MAIL102", "code: MAIL101"),
        "- requires: offered(delay)",
        "`MAIL101` names both MAIL101 and MAIL101",
    ),
    "a default that is no value": (
        FILE.replace("default: infinite", "default: 5"),
        "  delay:",
        "policy `delay`: `5` has no unit",
    ),
    "a preset with a value that is none": (
        FILE.replace("sealed: true}, doc", "sealed: maybe}, doc"),
        "  valuable:",
        "preset `valuable`: `sealed`: `maybe` is neither true nor false",
    ),
    "a word by an unknown option": (
        FILE.replace("by_option: carrier", "by_option: carriers"),
        "  care:",
        "policy `care`: `carriers` is no option",
    ),
    "a word that stands for itself": (
        FILE.replace("{none: infinite}", "{none: none}"),
        "  delay:",
        "policy `delay`: word `none` stands for itself",
    ),
    "a unit of nothing": (FILE.replace("unit: ms", "unit: moons"), "  pause:", "`moons` is no unit of time"),
    "a word without a meaning": (
        FILE.replace("{unknown: nobody knows}", "{unknowm: nobody}"),
        "odd:",
        "`policies.care.words.odd` must be a text, a map with `from_peers`, a map with `publisher`, ",
    ),
    "a word whose meaning is not whole": (
        FILE.replace("{unknown: nobody knows}", "{from_peers: any}"),
        "odd:",
        "`policies.care.words.odd` lacks the key `alone`",
    ),
    "a meaning within another that is none": (
        FILE.replace("alone: insured}}", "alon: insured}}"),
        "best:",
        "`alon` is no key here; did you mean `alone`?",
    ),
    "a case that means nothing": (
        FILE.replace("{bike: plain}", "{bike: [plain]}"),
        "usual:",
        "`policies.care.words.usual.cases.bike` must be a text, a map with `from_peers`, a map with `publisher`, ",
    ),
    "a key of a meaning": (
        FILE.replace("odd: {", "odd: {alone: a, "),
        "odd:",
        "`alone` is no key here",
    ),
    "two options that have a preset": (
        FILE.replace("needs: {carrier: train}", "needs: {carrier: train, other: a}"),
        "  valuable:",
        "`presets.valuable.needs` must be a map with one entry, found a map",
    ),
    "an id with a capital": (
        FILE.replace("id: mail", "id: Mail"),
        "id:",
        "`id` must be lower-case letters, digits and `_` after a letter, found `Mail`",
    ),
    "a severity that is none": (
        FILE.replace("severity: error", "severity: loud"),
        "severity",
        "`rules.3.severity` must be `error`, `warning` or `note`, found `loud`",
    ),
    "a default of no role": (
        FILE.replace("default: {publisher: 2", "default: {publishr: 2"),
        "copies:",
        "`publishr` is no key here; did you mean `publisher`?",
    ),
    "a list for a default": (
        FILE.replace("default: {publisher: 2, subscriber: 3}", "default: [2]"),
        "copies:",
        "`policies.copies.default` must be a text, a number or a flag, found a list",
    ),
    "a false version": (FILE.replace("cqos_pack: 1", "cqos_pack: 2"), "cqos_pack", "`cqos_pack` must be 1, found `2`"),
    "no reason": (
        FILE.replace("because: letters may come too late", "because: ''"),
        "- requires: offered(delay)",
        "reason",
    ),
    "a list for a map": (
        FILE.replace("presets:\n", "presets: []\nmore:\n"),
        "presets",
        "`presets` must be a map, found a list",
    ),
    "a missing key": (
        FILE.replace("kind: count, ", ""),
        "  copies:",
        "`policies.copies` lacks the key `kind`",
    ),
    "a text for a number": (
        FILE.replace("kind: count, minimum: 1", "kind: count, minimum: few"),
        "kind: count",
        "`policies.copies.minimum` must be a whole number, found `few`",
    ),
    "a list for a value": (
        FILE.replace("sealed: true}, doc", "sealed: [yes]}, doc"),
        "  valuable:",
        "`presets.valuable.settings.sealed` must be a text, a number or a flag, found a list",
    ),
}


@pytest.mark.parametrize(("text", "written", "message"), WRONG.values(), ids=WRONG)
def test_a_mistake_is_reported_with_its_line(text, written, message):
    """The line is that of the original text, or of what replaced it."""
    assert text != FILE
    found = [line for line, said in lines(text) if message in said]
    assert found, lines(text)
    original = [number for number, line in enumerate(FILE.splitlines(), 1) if written.strip() in line]
    assert found[0] in {*original, *(number + 1 for number in original)}, (found, original)


@pytest.mark.parametrize(
    ("old", "new", "marked"),
    [
        ("offered(delay) <= requested(delay)", "offered(delay) and requested(delay)", None),
        ("offered(delay) <= requested(delay)", "offered(delays) <= requested(delay)", None),
        ("values: [plain, signed, insured]", "values: [Plain, signed, insured]", "[Plain, signed, insured]"),
        ("default: infinite", "default: 5", "5"),
    ],
)
def test_a_mistake_is_reported_at_the_value_that_has_it(old, new, marked):
    text = FILE.replace(old, new)
    (place,) = {problem.place for problem in problems(text) if problem.place is not None}
    line = text.splitlines()[(place.line or 0) - 1]
    assert line[(place.column or 0) - 1 :].startswith(new if marked is None else marked)


def test_a_wrong_value_is_not_reported_of_the_default_again():
    text = FILE.replace("values: [plain, signed, insured]", "values: [Plain, signed, insured]")
    assert [said for _, said in lines(text) if "policy `care`" in said] == [
        "policy `care`: value `Plain` must be written in the pack as `plain`; files may write both"
    ]


def test_all_mistakes_are_reported_at_once():
    text = FILE.replace("default: infinite", "default: 5").replace("sealed: true}, doc", "sealed: maybe}, doc")
    text = text.replace("offered(care) >=", "offered(cares) >=").replace("by_option: carrier", "by_option: carriers")
    assert len(lines(text)) == 4
    assert len(lines(FILE.replace("{unknown: nobody knows}", "{from_peers: some}"))) == 2  # and `alone` is missing
    text = FILE.replace("kind: count", "kind: number").replace("title: Mail", "titel: Mail")
    assert len(lines(text)) == 2  # and not that the title is missing


@pytest.mark.parametrize(
    "meaning", ["{from_peers: any, alone: [a]}", "{unknowm: a}", "[a]", "true", "{publisher: {}, subscriber: plain}"]
)
@pytest.mark.parametrize(
    "around", ["{}", "{{publisher: plain, subscriber: {}}}", "{{by_option: carrier, cases: {{bike: {}}}}}"]
)
def test_a_meaning_that_is_none_is_one_mistake_however_deep_it_stands(around, meaning):
    found = problems(FILE.replace("odd: {", f"odd: {around.format(meaning)}  # {{"))
    assert len({problem.place for problem in found}) == 1
    assert all("Model" not in problem.message and "[key]" not in problem.message for problem in found)


@pytest.mark.parametrize(
    "text",
    [
        "",
        "[]",
        "a: b: c",
        "---\n---\n",
        "cqos_pack: 1\n---\ncqos_pack: 1",
        "\x00",
        "{" * 5000,
        "*a",
        "a: &a [*a]",
        "- [a",
    ],
)
def test_what_is_no_pack_is_refused(text):
    problems(text)


def mutated(rng: random.Random) -> bytes:
    """The file with a few lines lost, doubled, swapped or spoilt."""
    written = FILE.splitlines(keepends=True)
    for _ in range(rng.randint(1, 4)):
        at, other = rng.randrange(len(written)), rng.randrange(len(written))
        match rng.randrange(6):
            case 0:
                written[at] = ""
            case 1:
                written[at] *= 2
            case 2:
                written[at], written[other] = written[other], written[at]
            case 3:
                words = written[at].split(" ")
                words[rng.randrange(len(words))] = rng.choice(
                    ["[]", "{}", "-1", "1e9", "~", "true", "&a *a", "no", "é:", "\t"]
                )
                written[at] = " ".join(words)
            case 4:
                written[at] = written[at].replace(":", rng.choice([": [", ": {", " ", ": '"]), 1)
            case 5:
                cut = rng.randrange(len(written[at]) + 1)
                written[at] = written[at][:cut] + rng.choice("\0\r\x85{}[]&*#'\"%@`|>") + written[at][cut:]
    return "".join(written).encode()


@given(st.randoms(use_true_random=False))
def test_any_file_is_a_pack_or_a_list_of_problems(rng):
    data = mutated(rng)
    try:
        pack = read_pack(Source("pack.yaml", data))
    except InputError as error:
        found = error.problems
    else:
        found = ()
        # What is accepted can be used.
        describe_pack(pack)
        if any(policy.name == "care" for policy in pack.policies):
            check_pair(pack.id, {"care": "usual", "delay": "0s"}, {"care": "best"}, packs=[pack])
    assert all(problem.message and problem.place is not None for problem in found)
    # pydantic says what a value should be, in words of Python
    assert not any(" should " in problem.message for problem in found)


# Time

TIMED = """
cqos_pack: 1
id: radio
title: Radio
policies:
  beat: {kind: duration, default: infinite}
  care: {kind: choice, values: [gone, held], default: gone}
  fact: {kind: duration, level: topic}
rules:
  - {requires: offered(beat) <= requested(beat), code: RAD101, name: too-slow, because: a telegram is missed}
timing: {gap: beat, kept: {care: [held]}}
"""


def test_a_pack_file_says_which_policies_say_something_about_time():
    pack = read_pack(Source("radio.yaml", TIMED.encode()))
    assert pack.timing == Timing(gap="beat", kept=("care", ("held",)))
    drawing = model({"A": "s: start R/PT6H\n p: throw x beat=2s\n s -> p -> e", "B": "c: start x"}, protocol="radio")
    report = check(drawing, importer="bpmn", packs=[pack])
    assert [(each.code, each.sides[0].members) for each in report.findings if each.code.startswith("BP")] == [
        ("BP101", ("p",))
    ]


@pytest.mark.parametrize(
    ("stated", "message"),
    [
        ("{gap: beats}", "`gap` names `beats`, which is no policy"),
        ("{gap: care}", "`gap` names `care`, but needs a duration of endpoints"),
        ("{gap: fact}", "`gap` names `fact`, but needs a duration of endpoints"),
        ("{depth: beat}", "`depth` names `beat`, but needs a count of endpoints"),
        ("{latched: care}", "`latched` names `care`, but needs a policy of topics"),
        ("{kept: {care: [kept]}}", "`kept`: "),
        ("{kept: care}", "`timing.kept` must be a map, found `care`"),
        ("{gaps: beat}", "`gaps` is no key here; did you mean `gap`?"),
    ],
)
def test_what_says_nothing_about_time_is_reported_with_its_line(stated, message):
    with pytest.raises(InputError) as raised:
        read_pack(Source("radio.yaml", TIMED.replace("{gap: beat, kept: {care: [held]}}", stated).encode()))
    (problem,) = raised.value.problems
    assert message in problem.message
    assert problem.place is not None
    assert problem.place.line == TIMED.splitlines().index("timing: {gap: beat, kept: {care: [held]}}") + 1
