"""The values of endpoints, and where each comes from, as `explain` says it."""

from __future__ import annotations

import re
from dataclasses import replace
from typing import TYPE_CHECKING, Literal

from cqos_core import Endpoint, Participant, System, explain

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping, Sequence

    from cqos_core import Fact, PairReport
    from cqos_core.packs import Policy, RulePack


def facts(
    system: System, of: str | None = None, *, packs: Iterable[RulePack] = (), beside: Participant | None = None
) -> dict[str, Fact]:
    """Return what is explained of the values of an endpoint, the first where none is named, by policy; see `explained`."""
    end = next(each for each in system.endpoints if of in {None, each.id})
    return side(explained(system, end, packs=packs, beside=beside), end.role)


def explained(
    system: System, end: Endpoint, *, packs: Iterable[RulePack] = (), beside: Participant | None = None
) -> PairReport:
    """Return an endpoint beside the first partner on its topic; where it has none, beside one that states nothing, of ``beside``."""
    partner = next((each for each in system.endpoints if each.role != end.role and each.topic == end.topic), None)
    if partner is None:
        role: Literal["publisher", "subscriber"] = "subscriber" if end.role == "publisher" else "publisher"
        owner = beside or Participant("another")
        partner = Endpoint(id="another", role=role, topic=end.topic, participant=owner.id, protocol=end.protocol)
        participants = system.participants | {owner.id: owner}
        system = replace(system, endpoints=[*system.endpoints, partner], participants=participants)
    first, second = sorted((end, partner), key=lambda each: each.role)
    return explain(system, publisher=first.id, subscriber=second.id, packs=packs)


def rows(system: System, pack: RulePack, policies: Sequence[str]) -> dict[str, str]:
    """Return the values of these policies of every endpoint, `?` for one that is not known or depends on peers."""
    found: dict[str, str] = {}
    for end in system.endpoints:
        report = explained(system, end)
        assert not [each for each in report.findings if each.code in {"CQ202", "CQ203", "CQ209"}], "all is read"
        values = side(report, end.role)
        found[end.id] = " ".join(_known(pack.policy(name), values) for name in policies)
    return found


def _known(policy: Policy, values: Mapping[str, Fact]) -> str:
    fact = values[policy.name]
    known = policy.domain.read(fact.value) is not None and not fact.origin.startswith("settled")
    return fact.value if known else "?"


def side(report: PairReport, role: str) -> dict[str, Fact]:
    """Return the values of one end of an explained pair, by policy."""
    sides = ((each.policy, each.offered if role == "publisher" else each.requested) for each in report.policies)
    return {policy: fact for policy, fact in sides if fact is not None}


def stated(found: Mapping[str, Fact]) -> dict[str, str]:
    """Return the values among these that somebody stated, and that count."""
    unstated = ("default", "ignored by the middleware")
    return {policy: fact.value for policy, fact in found.items() if fact.origin not in unstated}


def profile_values(
    profile: str, *files: bytes | System, role: str = "publishes", topic: str = "t", protocol: str = "dds"
) -> dict[str, str]:
    """Return what an endpoint of a system file gets from a profile of these files, by policy, where it is no default.

    A value that is not known is `unknown`, with the cause where a finding names it.
    """
    one, other = ("publishes", "subscribes") if role == "publishes" else ("subscribes", "publishes")
    design = (
        f"cqos: 1\nprotocol: {protocol}\nparticipants:\n"
        f'  p: {{{one}: {{{topic}: {{id: end, profile: "{profile}"}}}}}}\n  q: {{{other}: {{{topic}: {{id: other}}}}}}\n'
    )
    ends = ("end", "other") if role == "publishes" else ("other", "end")
    report = explain(design.encode(), *files, publisher=ends[0], subscriber=ends[1])
    causes = {
        policy: f"unknown ({cause})"
        for finding in report.findings
        if "end" in finding.endpoints
        for policy, cause in re.findall(r"`(\S+)` is not known: (.*)", finding.message)
    }
    return stated(side(report, "publisher" if role == "publishes" else "subscriber")) | causes
