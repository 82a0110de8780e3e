"""Law: a fix fixes. Its edits applied to the text, and the text read back: the finding is gone, and no error is new."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import pytest
import yaml
from hypothesis import given, settings
from hypothesis import strategies as st

from cqos_core import InputError, Severity, check
from cqos_core.api import context
from cqos_core.files.edited_files import apply_edits
from cqos_core.packs import Choice, Count, Duration, Flag
from cqos_core.testing import load_cases
from tests.effort import EXAMPLES, EXPLORE

if TYPE_CHECKING:
    from collections.abc import Iterator

    from cqos_core import Finding, Remedy, Report
    from cqos_core.packs import Policy, RulePack
    from cqos_core.testing import Case

ROOT: Final = Path(__file__).parents[2]
CASES: Final = {"ros2": "plugins/ros2", "dds": "plugins/dds_full", "mqtt": "plugins/mqtt"}
WHERE: Final = context()
EVERY: Final = 1 if EXPLORE else 20
"""One of so many cases is tried; `dev.py explore` tries all."""


def checked(data: bytes) -> Report:
    return check(data)


def errors(report: Report) -> set[tuple[str, str | None, str]]:
    return {
        (each.code, each.topic, member)
        for each in report.findings
        if each.severity is Severity.ERROR
        for side in each.sides
        for member in side.members
    }


def still_there(finding: Finding, remedy: Remedy, after: Report) -> bool:
    """Whether the finding is there again, of endpoints that the remedy has changed."""
    for each in after.findings:
        members = {side.role: set(side.members) for side in each.sides}
        same = each.code == finding.code and each.topic == finding.topic
        met = all(members.get(side.role, set()) & set(side.members) for side in finding.sides)
        if same and met and set().union(*members.values()) & set(remedy.members):
            return True
    return False


def law(text: str, before: Report) -> Iterator[str]:
    """Yield what is wrong with the fixes of a system with its report."""
    data = text.encode()
    for finding in before.findings:
        for remedy in finding.remedies:
            if not remedy.edits:
                continue
            edited = apply_edits({"<bytes>": data}, remedy.edits)
            if edited.left or not edited.texts:
                yield f"{finding.code}, {remedy.text}: not applied, {edited.left}"
                continue
            try:
                after = checked(edited.texts["<bytes>"])
            except InputError as error:
                yield f"{finding.code}, {remedy.text}: the text is refused, {error}"
                continue
            if still_there(finding, remedy, after):
                yield f"{finding.code}, {remedy.text}: it is still there"
            # Only for an error may other pairs get worse; they are counted, and the text mentions them.
            if not (remedy.breaks and finding.severity is Severity.ERROR) and (new := errors(after) - errors(before)):
                yield f"{finding.code}, {remedy.text}: new errors {sorted(map(str, new))}"


def unquoted(value: Any) -> Any:
    """Return maps and lists that a case writes as text as what they are."""
    if isinstance(value, str) and value[:1] in {"{", "["}:
        return yaml.load(value, Loader=yaml.BaseLoader)  # noqa: S506 - makes text only
    return value


def text_of(case: Case) -> str:
    """Write a case as a system file."""
    content = case.content
    if "system" in content:
        return written(content["system"])
    pack = WHERE.find_pack(case.pack)
    assert pack is not None
    topic = {**content.get("topic", {}), "external": True}
    name = topic.pop("name", "topic")
    participants: dict[str, Any] = {}
    for who, key, alone in (("p", "offered", "publisher"), ("s", "requested", "subscriber")):
        stated = content.get(key, content.get(alone))
        if stated is None:
            continue
        own = {n for n in stated if pack.find("endpoint", n) is None and pack.find("participant", n) is not None}
        endpoint = {n: unquoted(value) for n, value in stated.items() if n not in own}
        if who == "s" and content.get("needs"):
            endpoint["needs"] = content["needs"]
        verb = "publishes" if who == "p" else "subscribes"
        participants[who] = {**{n: unquoted(stated[n]) for n in own}, verb: {name: endpoint}}
    options = {case.pack: content.get("options", {})}
    system = {"cqos": 1, "protocol": case.pack, "options": options, "topics": {name: topic}}
    return written({**system, "participants": participants})


def written(system: dict[str, Any]) -> str:
    dumper = getattr(yaml, "CSafeDumper", yaml.SafeDumper)  # many times as fast, where it was built
    return str(yaml.dump(system, Dumper=dumper, sort_keys=False))


def reports(pack: str, every: int = 1) -> Iterator[tuple[Case, str, Report]]:
    """Yield the cases of a pack as system files with their reports; those that state what a file cannot are left out."""
    for case in load_cases(ROOT / CASES[pack] / "tests/cases", pack)[::every]:
        text = text_of(case)
        try:
            yield case, text, checked(text.encode())
        except InputError:
            continue


@pytest.mark.explored
@pytest.mark.parametrize("pack", CASES)
def test_every_fix_of_the_cases_fixes(pack):
    wrong = [f"{case}: {said}" for case, text, report in reports(pack, EVERY) for said in law(text, report)]
    assert not wrong, "\n".join(wrong)


def test_a_change_of_several_participants_says_that_it_is_of_them():
    (case,) = [
        each
        for each in load_cases(ROOT / CASES["mqtt"] / "tests/cases/MQTT506.yml", "mqtt")
        if each.name == "the Will waits, and the broker says how long it takes"
    ]
    (finding,) = [each for each in checked(text_of(case).encode()).findings if each.code == "MQTT506"]
    assert "set keep_alive `58s` of the participant on sensor/publisher/t and 1 more" in [
        remedy.text for remedy in finding.remedies
    ]


def value_of(policy: Policy) -> st.SearchStrategy[str] | None:
    """Some values of a policy, in the spelling of a system file."""
    domain = policy.domain
    if isinstance(domain, (Choice, Flag)):
        return st.sampled_from([domain.format(value) for value in domain.candidates()])
    if isinstance(domain, Duration):
        return st.sampled_from(["1s", "2s", "10s", "infinite"])
    if isinstance(domain, Count):
        return st.sampled_from(["1", "5", "20"])
    return None


def settings_of(pack: RulePack, level: str, role: str) -> st.SearchStrategy[dict[str, str]]:
    values = {
        policy.name: value
        for policy in pack.policies
        if policy.level == level and role in policy.roles and not policy.derived
        if policy.default is not None and (value := value_of(policy)) is not None
    }
    return st.lists(st.sampled_from(sorted(values)), max_size=4, unique=True).flatmap(
        lambda names: st.fixed_dictionaries({name: values[name] for name in names})
    )


@st.composite
def random_systems(draw: Any, pack: RulePack) -> str:
    participants: dict[str, Any] = {}
    for number in range(draw(st.integers(2, 4))):
        role = draw(st.sampled_from(["publisher", "subscriber"]))
        topic = draw(st.sampled_from(["t", "u"]))
        verb = "publishes" if role == "publisher" else "subscribes"
        participants[f"p{number}"] = {verb: {topic: draw(settings_of(pack, "endpoint", role))}}
    return written({"cqos": 1, "protocol": pack.id, "participants": participants})


@pytest.mark.parametrize("name", CASES)
@settings(max_examples=EXAMPLES // 2)
@given(st.data())
def test_every_fix_of_random_systems_fixes(name, data):
    pack = WHERE.find_pack(name)
    assert pack is not None
    text = data.draw(random_systems(pack))
    wrong = list(law(text, checked(text.encode())))
    assert not wrong, "\n".join([text, *wrong])
