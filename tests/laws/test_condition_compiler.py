"""Law: compiled conditions say of random values and worlds what the conditions themselves say, of every pack."""

from __future__ import annotations

import itertools
from collections import Counter
from gc import collect
from random import Random
from typing import TYPE_CHECKING, Any, Final
from weakref import ref

import pytest

from cqos_core.language import repeated_conditions
from cqos_core.language.bound_condition import NO_SIGNAL, Signal
from cqos_core.language.condition_compiler import CommonValues, Question, compile_conditions
from cqos_core.language.domains import Text
from cqos_core.language.values import KNOWN, UNREAD, Anything, Depends, WrittenValue
from cqos_core.matching import pair_guarantees, rule_set
from cqos_core.matching.judge import (
    PairJudgement,
    Violation,
    _reporting,
    about_one,
    ask,
    ask_end,
    failed_match_conditions,
    judge_endpoint,
    judge_pair,
    over_both,
    passed_over,
    verdict_of,
    worst,
)
from cqos_core.model.finding import Verdict
from cqos_core.model.problems import InvalidValueError
from cqos_core.packs.guarantee import FAULTS, RESTARTS_IN, Faults
from cqos_core.resolving.qos_profile import _PROFILES, intern
from cqos_dds.pack import PACK as DDS
from cqos_mqtt.pack import PACK as MQTT
from cqos_ros2.pack import PACK as ROS2
from tests.effort import EXPLORE
from tests.made_up_protocol import POST
from tests.random_rules import any_rules

if TYPE_CHECKING:
    from collections.abc import Iterator

    from cqos_core.language.policy import Policy
    from cqos_core.packs.pack import RulePack
    from cqos_core.resolving.qos_profile import QosProfile

PACKS: Final = (any_rules(150), POST, DDS, MQTT, ROS2)
SEEDS: Final = 40 if EXPLORE else 1
TEXTS: Final = {
    "count": ("1", "2", "5"),
    "duration": ("0s", "1s", "2s", "3s", "infinite"),
    "names": ("[]", "[a]", "[a, b]", "[a*, c]"),
    "text": ("x", "y", "a//b"),
    "flag": ("true", "false"),
}


def plain(random: Random, policy: Policy) -> Any:
    words = [each for each in TEXTS.get(policy.domain.kind, ()) if can_be(policy, each)]
    known = [policy.domain.parse(each) for each in words] or [*policy.domain.candidates()]
    return random.choice(known)


def another(random: Random, policy: Policy) -> Any:
    """Return a value of a policy, also of a list of faults."""
    if isinstance(policy.domain, Faults):
        return tuple(random.sample(FAULTS, random.randrange(len(FAULTS))))
    return plain(random, policy)


def can_be(policy: Policy, text: str) -> bool:
    try:
        policy.domain.parse(text)
    except InvalidValueError:
        return False
    return True


def a_value(random: Random, pack: RulePack, policy: Policy, opened: float) -> Any:
    if random.random() >= opened:
        return plain(random, policy)
    one, other = plain(random, policy), plain(random, policy)
    option = random.choice(("one", "other"))
    cases = (("a", one), ("b", other), ("c", Anything("that is open")))
    return random.choice((Anything("it is not known"), Depends(option, cases[:2]), Depends(option, cases)))


def a_profile(random: Random, pack: RulePack, opened: float, shared: dict[int, Any]) -> QosProfile:
    needs = dict(pack.needs.values()) if random.random() < 0.5 else {}
    values = [
        shared[at] if at in shared else needs.get(at, a_value(random, pack, policy, opened))
        for at, policy in enumerate(pack.policies)
    ]
    words = [how_written(random, policy, opened) for policy in pack.policies]
    return intern(pack, (*values, *words))


def how_written(random: Random, policy: Policy, opened: float) -> WrittenValue | None:
    words = [*policy.words, *getattr(policy.domain, "names", ()), "1"]
    if random.random() < opened:
        return UNREAD
    return random.choice((None, WrittenValue(policy.word(random.choice(words)), here=random.random() < 0.5)))


def profiles(pack: RulePack, seed: int, number: int = 24) -> list[QosProfile]:
    """Profiles whose options are mostly the same, as in a system; some values are open, and more of some profiles."""
    random = Random(seed)  # noqa: S311 - no secrets
    options = [at for at, policy in enumerate(pack.policies) if policy.level in {"option", "topic"}]
    found = []
    for opened in (0.0, 0.03, 0.2):
        shared = {at: a_value(random, pack, pack.policies[at], opened) for at in options}
        found += [a_profile(random, pack, opened, shared) for _ in range(number // 3)]
    return found


@pytest.mark.explored
@pytest.mark.parametrize("seed", range(SEEDS))
@pytest.mark.parametrize("pack", PACKS, ids=lambda pack: pack.id)
def test_every_exact_bit_is_the_answer_and_every_other_one_may_be(pack, seed):
    rules = pack.judging_rules
    reporting, exact = compile_conditions([Question(each.bound, each.rule.kind == "forbids") for each in rules])
    decided = 0
    found = profiles(pack, seed, 24 if EXPLORE else 15)
    for a in found:
        for b in found:
            known = (a.known, b.known)
            bits = reporting(*known)
            for position, each in enumerate(rules):
                if any(known[0][at] != known[1][at] for at in each.bound.options):
                    continue
                signal = Signal(((known[0], 1),)) if each.bound.aggregate_uses else NO_SIGNAL
                says = ask(each, known[0], known[1], signal)
                if exact >> position & 1:
                    assert bool(bits >> position & 1) is (says is not None), each.rule.code
                    decided += 1
                elif not bits >> position & 1:
                    assert says is None, each.rule.code
    assert decided > 1000


@pytest.fixture(
    params=((0, 0), (10**9, 0), (10**9, 10**9)), ids=("for what they have in common", "for all", "not at all")
)
def always(request, monkeypatch):
    """Compile rules for what two profiles have in common, when they are first asked; for all; and never."""
    forget = (over_both, about_one, judge_pair, failed_match_conditions, judge_endpoint, _reporting)
    monkeypatch.setattr(rule_set, "_WORTH_A_FUNCTION", request.param[0])
    monkeypatch.setattr(rule_set, "_WORTH_COMPILING", request.param[1])
    monkeypatch.setattr(rule_set, "_MOST_FUNCTIONS", 10**9)
    for each in forget:
        each.cache_clear()
    yield
    for each in forget:
        each.cache_clear()


def with_much_in_common(
    random: Random, pack: RulePack, opened: float
) -> tuple[CommonValues, Iterator[tuple[QosProfile, QosProfile]]]:
    """Return the open values and options of two profiles, and pairs that have the same ones."""
    ends = []
    for _ in range(2):
        shared = {at: a_value(random, pack, each, opened) for at, each in enumerate(pack.policies)}
        words = [how_written(random, each, opened) for each in pack.policies]
        ends.append([*shared.values(), *words])
    at = [
        frozenset(
            index
            for index, value in enumerate(values)
            if (type(value) not in KNOWN if index < len(pack.policies) else value is UNREAD)
            or (index < len(pack.policies) and pack.policies[index].level == "option")
        )
        for values in ends
    ]

    def another(side: int) -> QosProfile:
        values = (
            value
            if index in at[side]
            else plain(random, pack.policies[index])
            if index < len(pack.policies)
            else how_written(random, pack.policies[index - len(pack.policies)], 0)
            for index, value in enumerate(ends[side])
        )
        return intern(pack, tuple(values))

    common = CommonValues(tuple(ends[0]), tuple(ends[1]), (at[0], at[1]))
    return common, ((another(0), another(1)) for _ in itertools.count())


@pytest.mark.explored
@pytest.mark.parametrize("seed", range(SEEDS))
@pytest.mark.parametrize("pack", PACKS, ids=lambda pack: pack.id)
def test_what_profiles_have_in_common_is_a_constant(pack, seed):
    random = Random(seed)  # noqa: S311 - no secrets
    rules = pack.judging_rules
    undecided = [each.rule.kind == "requires" for each in rules]
    decided = silent = 0
    for opened in (0.05, 0.2):
        common, others = with_much_in_common(random, pack, opened)
        questions = [
            Question(each.bound, each.rule.kind == "forbids", u, common)
            for each, u in zip(rules, undecided, strict=True)
        ]
        reporting, exact = compile_conditions(questions)
        for a, b in itertools.islice(others, 30 if EXPLORE else 15):
            bits = reporting(a.known, b.known)
            for position, each in enumerate(rules):
                signal = Signal(((a.values, 1),), ((b.values, 1),)) if each.bound.aggregate_uses else NO_SIGNAL
                says = ask(each, a.values, b.values, signal)
                if bits >> position & 1:
                    if exact >> position & 1:
                        assert says is not None, each.rule.code
                        assert says.outcome.result is (each.rule.kind == "forbids"), each.rule.code
                        decided += 1
                elif each.rule.kind == "meets":
                    assert says is None or says.outcome.result is None, each.rule.code
                else:
                    assert says is None, each.rule.code
                    silent += not each.bound.is_plain(a.values)
    assert decided
    assert silent


@pytest.mark.explored
@pytest.mark.parametrize("seed", range(SEEDS))
@pytest.mark.parametrize("pack", PACKS[2:], ids=lambda pack: pack.id)
def test_rules_of_guarantees_answer_alike_once_they_are_compiled(pack, seed, monkeypatch):
    monkeypatch.setattr(repeated_conditions, "WORTH_A_FUNCTION", 1)
    random = Random(seed)  # noqa: S311 - no secrets
    found = Counter[bool | None]()
    for opened in (0.05, 0.2):
        _, others = with_much_in_common(random, pack, opened)
        one, other = next(others)
        here, there = (frozenset((*each.frame.open, *each.frame.options)) for each in (one, other))
        asked = repeated_conditions.RepeatedConditions((here, there))
        for a, b in itertools.islice(others, 20 if EXPLORE else 8):
            for each in itertools.chain(*pack.guaranteed.values()):
                said = ask(each, a.values, b.values)
                result = True if said is None else None if each.rule.doubt else said.outcome.result
                each.bound.memory.clear()
                answered = asked.of(each.bound, a.values, b.values)
                assert (None if answered is False and each.rule.doubt else answered) is result, each.rule.code
                found[result] += 1
    assert len(found) == 3, found


@pytest.mark.explored
@pytest.mark.parametrize("seed", range(SEEDS))
@pytest.mark.parametrize("pack", PACKS[2:], ids=lambda pack: pack.id)
def test_guarantees_of_pairs_whose_rules_answer_alike_are_equal(pack, seed, monkeypatch):
    monkeypatch.setattr(pair_guarantees, "WORTH_A_FUNCTION", 1)
    pair_guarantees._alike.cache_clear()
    pair_guarantees.guarantees_of.cache_clear()
    pair_guarantees._GIVEN.clear()
    found = []
    random = Random(seed)  # noqa: S311 - no secrets
    may_change = [at for at, each in enumerate(pack.policies) if each.level != "option"]
    beside_rules = [pack.vocabulary.indices["need", RESTARTS_IN.name], pack.find("broker", pack.implementations.option)]
    beside_rules = [at for at in beside_rules if at is not None]
    for opened in (0.0, 0.1):
        _, others = with_much_in_common(random, pack, opened)
        for one, b in itertools.islice(others, 30 if EXPLORE else 2):
            # Most guarantees do not read the one value in which two of these differ; some rest on it without a rule that reads it.
            others_at = (random.choice(may_change), *beside_rules)
            for a in (one, *(one.with_values({at: another(random, pack.policies[at])}) for at in others_at)):
                for each in pair_guarantees.guarantees_of(a, b):
                    afresh = pair_guarantees._give(each.word, a, b)
                    given = (each.value, each.lost, each.cells)
                    assert given == (afresh.value, afresh.lost, afresh.cells), each.word.name
                    found.append(id(each))
    assert len(set(found)) < len(found)


def one_by_one(publisher: QosProfile, subscriber: QosProfile) -> PairJudgement:
    """Ask every rule of pairs in its general form."""
    spoken: list[Violation] = []
    refused = False
    for bound in publisher.pack.by_scope.get("pair", ()):
        if bound.rule.guarantee:
            refused = refused or Verdict.INCOMPATIBLE in [verdict_of(s) for s in spoken if not s.bound.rule.guarantee]
        if passed_over(bound, publisher, subscriber) or (bound.rule.guarantee and refused):
            continue
        each = ask(bound, publisher.values, subscriber.values)
        spoken += () if each is None else (each,)
    return PairJudgement(worst(map(verdict_of, spoken)), tuple(spoken))


@pytest.mark.explored
@pytest.mark.parametrize("seed", range(SEEDS))
@pytest.mark.parametrize("pack", PACKS, ids=lambda pack: pack.id)
@pytest.mark.usefixtures("always")
def test_pairs_and_ends_are_judged_as_one_by_one(pack, seed):
    found = profiles(pack, seed, 12 if EXPLORE else 9)
    spoken = 0
    for a in found:
        for b in found:
            assert judge_pair(a, b) == one_by_one(a, b)
            general = [each.bound.judge(a.values, b.values).result for each in pack.by_scope["meets"]]
            met = [each for each, result in zip(pack.by_scope["meets"], general, strict=True) if result is False]
            assert failed_match_conditions(a, b) == tuple(met)
            spoken += len(judge_pair(a, b).violations)
        for role in ("publisher", "subscriber"):
            rules = [each for each in pack.by_scope.get("endpoint", ()) if each.role in {None, role}]
            said = [each for rule in rules if (each := ask_end(rule, a, role)) is not None]
            assert judge_endpoint(a, role, False) == tuple(said)
            spoken += len(said)
    assert spoken


@pytest.mark.explored
@pytest.mark.parametrize("seed", range(SEEDS))
@pytest.mark.parametrize("pack", PACKS, ids=lambda pack: pack.id)
@pytest.mark.usefixtures("always")
def test_a_rule_over_topics_that_is_passed_over_has_nothing_to_say(pack, seed):
    signals = pack.by_scope.get("signal", ())
    found = profiles(pack, seed, 12)
    for a in found:
        for b in found:
            sides = [(((each.values, 2),) if each else ()) for each in (a, b if a is not b else None)]
            kept = set()
            for each, role in ((a, "publisher"), (b, "subscriber")):
                rules = about_one(pack, role, False)
                reporting = rules.that_report(each, each, rules.bits["signal"])
                kept |= {id(bound) for at, bound in enumerate(rules.rules) if reporting >> at & 1}
            for bound in signals:
                if id(bound) not in kept:
                    for each in (a, b):
                        said = ask(bound, each.values, each.values, Signal(sides[0], sides[1]))
                        assert said is None or (said.unknown and said.failed is None)


@pytest.mark.parametrize("pack", PACKS, ids=lambda pack: pack.id)
def test_a_profile_is_kept_as_long_as_it_is_used(pack):
    one, *_ = profiles(pack, 0)
    index = next(at for at, policy in enumerate(pack.policies) if isinstance(policy.domain, Text))
    new = one.with_values({index: "x" * 20_000})
    assert one.with_values({index: "x" * 20_000}) is new
    gone = ref(new)
    del new
    collect()
    assert gone() is None


@pytest.mark.explored
@pytest.mark.parametrize("seed", range(SEEDS))
@pytest.mark.parametrize("pack", PACKS, ids=lambda pack: pack.id)
def test_a_profile_with_values_of_another_is_the_one_with_all_these_values(pack, seed):
    random = Random(seed)  # noqa: S311 - no secrets
    found = profiles(pack, seed)
    for profile, other in zip(found, (*found[1:], found[0]), strict=True):
        every = range(len(profile.values))
        for changed in (random.sample(every, random.randint(0, 5)) for _ in range(20)):
            values = tuple((other if at in changed else profile).values[at] for at in every)
            _PROFILES.clear()
            made = profile.with_values({at: values[at] for at in changed})
            assert intern(pack, values, profile.beside, profile.refused) is made
            _PROFILES.clear()
            whole = intern(pack, values, profile.beside, profile.refused)
            parts = ("pack", "known", "frame", "values", "beside", "refused", "unread")
            assert all(getattr(whole, each) == getattr(made, each) for each in parts)
