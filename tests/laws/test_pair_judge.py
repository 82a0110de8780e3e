"""Law: a pair from dictionaries has the verdict and the report of an explanation, however often and in whatever order it is asked for."""

from __future__ import annotations

import pickle
import sys
from datetime import timedelta
from random import Random
from threading import Thread
from typing import TYPE_CHECKING, Any, Final

import pytest

import cqos_core as cqos
from cqos_dds.pack import PACK as DDS
from cqos_mqtt.pack import PACK as MQTT
from cqos_ros2.pack import PACK as ROS2
from tests.effort import EXPLORE
from tests.made_up_protocol import POST, pair_system

if TYPE_CHECKING:
    from cqos_core.packs import Policy, RulePack

PACKS: Final = (POST, DDS, MQTT, ROS2)
SEEDS: Final = 60 if EXPLORE else 1
TEXTS: Final = {
    "count": ("1", "2", 5, "0", True),
    "duration": ("1s", "2s", "infinite", timedelta(seconds=2), "7"),
    "names": ("[]", "[a]", ["a", "b"], ("a*",)),
    "text": ("x", "y"),
    "flag": ("true", False, 1, 0, "maybe"),
}


def a_setting(random: Random, policy: Policy) -> Any:
    words = (*getattr(policy.domain, "names", ()), *policy.words)
    return random.choice(words or TEXTS.get(policy.domain.kind, ("x",)))


def settings(random: Random, pack: RulePack, level: str, most: int) -> dict[str, Any]:
    policies = [each for each in pack.policies if each.level == level and not each.derived]
    chosen = random.sample(policies, min(random.randrange(most + 1), len(policies)))
    return {random.choice((each.name, *each.aliases)): a_setting(random, each) for each in chosen}


def a_side(random: Random, pack: RulePack) -> dict[str, Any]:
    found = settings(random, pack, "endpoint", 5)
    unusual = random.random()
    if unusual < 0.05:
        found["profile"] = random.choice((*pack.presets, "nothing", None))
    elif unusual < 0.1:
        found["misspelt"] = "1"
    return found


def general(pack: RulePack, offered: Any, requested: Any, around: tuple[Any, Any, Any]) -> cqos.PairReport:
    """Explain a pair in a system of its own; a profile that is None is none."""
    offers, requests = (
        {key: value for key, value in each.items() if value is not None} for each in (offered, requested)
    )
    system = pair_system(pack.id, offers, requests, *around)
    return cqos.explain(system, publisher="publisher", subscriber="subscriber", packs=[pack])


@pytest.mark.explored
@pytest.mark.parametrize("seed", range(SEEDS))
@pytest.mark.parametrize("pack", PACKS, ids=lambda pack: pack.id)
def test_every_verdict_and_report_is_that_of_an_explanation(pack, seed):
    random = Random(seed)  # noqa: S311 - no secrets
    options = settings(random, pack, "option", seed % 3)
    topic = settings(random, pack, "topic", (seed + 1) % 2)
    needs = {"latest": True} if seed % 2 == 1 else {}
    around = (options, topic, needs)
    judge = cqos.PairJudge(pack.id, options, topic, [pack], needs)
    sides = [({}, {}), *((a_side(random, pack), a_side(random, pack)) for _ in range(7))]
    pairs = [(offered, requested) for offered, _ in sides for _, requested in sides]
    random.shuffle(pairs)
    expected = [general(pack, *each, around) for each in pairs]
    for _ in range(2):
        for each, report in zip(pairs, expected, strict=True):
            assert judge.verdict(*each) == report.verdict, each
            assert judge.verdict(*map(judge.profile, each)) == report.verdict
            assert judge.verdict(judge.profile(each[0]), each[1]) == report.verdict
    for each, report in list(zip(pairs, expected, strict=True))[: None if EXPLORE else 12]:
        now = cqos.check_pair(pack.id, *each, options, topic, [pack], needs)
        assert (now, repr(now)) == (report, repr(report))
        assert pickle.loads(pickle.dumps(now)) == report  # noqa: S301 - made here


def test_a_number_is_no_flag_however_often_it_was_seen():
    judge = cqos.PairJudge("ros2", {"rmw": "cyclonedds"})
    for _ in range(3):
        assert judge.verdict({"depth": 1}, {"depth": 1}) == "compatible"
        assert judge.verdict({"depth": 1}, {"depth": True}) == "unknown"
        assert judge.verdict({"depth": True}, {"depth": 1}) == "unknown"


@pytest.mark.parametrize("seen", [0, 3])
def test_values_differ_as_their_texts_do(seen):
    def verdicts(value: Any) -> list[Any]:
        reports = [cqos.check_pair("post", {"copies": value}, {"copies": value}, packs=[POST]) for _ in range(seen + 1)]
        assert len({report.verdict for report in reports}) == 1
        return [finding.message for finding in reports[-1].findings]

    assert verdicts(True) == verdicts("true") != verdicts(1)
    assert verdicts(1) == verdicts("1")


def test_later_changes_of_a_dictionary_are_seen_by_later_calls_only():
    offered: dict[str, Any] = {"care": "plain"}
    requested = {"care": "signed"}
    judge = cqos.PairJudge("post", packs=[POST])
    for _ in range(3):
        report = cqos.check_pair("post", offered, requested, packs=[POST])
    prepared = judge.profile(offered)
    offered["care"] = "insured"
    assert [finding.code for finding in report.findings] == ["POST101"]
    assert judge.verdict(prepared, requested) == report.verdict == "incompatible"
    assert judge.verdict(offered, requested) == cqos.check_pair("post", offered, requested, packs=[POST]).verdict
    assert judge.verdict(offered, requested) == "compatible"


def test_what_is_no_setting_is_refused_every_time():
    judge = cqos.PairJudge("ros2")
    for _ in range(2):
        assert judge.verdict({"depth": 1}, {"depth": 1}) == "compatible"
        with pytest.raises(TypeError, match="no setting"):
            judge.verdict({"depth": 1.0}, {})  # type: ignore[dict-item]
        with pytest.raises(TypeError, match="must map"):
            cqos.PairJudge("ros2", "cyclonedds")  # type: ignore[arg-type]
        with pytest.raises(cqos.CqosError, match="no rule pack"):
            cqos.PairJudge("ros3")
        with pytest.raises(cqos.CqosError, match="another judge"):
            judge.verdict(cqos.PairJudge("dds").profile({}), {})


def test_threads_that_share_a_judge_get_their_own_findings():
    found: list[tuple[str, list[str]]] = []

    def ask(number: int, depth: str) -> None:
        for each in range(60):
            offered = {"reliability": "reliable", "depth": depth.format(number * 1_000 + each)}
            report = cqos.check_pair("ros2", offered, {"depth": "7"})
            found.append((depth, [finding.code for finding in report.findings]))

    before = sys.getswitchinterval()
    sys.setswitchinterval(1e-6)
    try:
        threads = [Thread(target=ask, args=(number, depth)) for number, depth in enumerate(("x{}", "{}", "{}"))]
        for each in threads:
            each.start()
        for each in threads:
            each.join()
    finally:
        sys.setswitchinterval(before)
    assert len(found) == 180
    assert {("CQ203" in codes) == (depth == "x{}") for depth, codes in found} == {True}
