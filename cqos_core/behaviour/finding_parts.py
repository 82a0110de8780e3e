"""Makes findings about behaviour, and the fixes in them."""

from __future__ import annotations

from types import MappingProxyType
from typing import TYPE_CHECKING, Final

from cqos_core.language.domains import Duration
from cqos_core.language.policy import ENDPOINT
from cqos_core.model.codes import CODES
from cqos_core.model.finding import Finding, Remedy, Severity, Side
from cqos_core.model.system import PUBLISHER, SUBSCRIBER
from cqos_core.resolving.finding_facts import fact

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping, Sequence

    from cqos_core.language.values import Plain
    from cqos_core.model.finding import Verdict
    from cqos_core.resolving.resolved_endpoint import Resolved


THROWN: Final = "thrown here"

CAUGHT: Final = "caught here"


def time_text(nanoseconds: int) -> str:
    """Return a duration in the spelling of system files."""
    return Duration().format(nanoseconds)


def behaviour_finding(
    code: str,
    message: str,
    ends: Sequence[Resolved],
    *,
    policies: Iterable[str] = (),
    beside: Iterable[Side] = (),
    assumed: Iterable[str] = (),
    worlds: Mapping[str, Verdict] = MappingProxyType({}),
    severity: Severity | None = None,
    fix: Remedy | None = None,
) -> Finding:
    """Return a finding about endpoints of one role.

    Args:
        code: of `CODES`.
        message: one sentence.
        ends: the endpoints; the first one shows its values of ``policies``.
        policies: names of policies; empty ones are passed over.
        beside: further sides.
        assumed: assumptions of the claim.
        worlds: the verdict of each value of an option on which the claim depends.
        severity: if it is not that of the code.
        fix: of `draft_fix`.
    """
    info = CODES[code]
    ends = sorted(ends, key=lambda each: each.id)
    first = ends[0]
    indices = (first.pack.vocabulary.indices[ENDPOINT, name] for name in policies if name)
    own = [fact(first, first.profile, index) for index in indices]
    members = tuple(dict.fromkeys(each.id for each in ends))
    side = Side(first.role, members, THROWN if first.role == PUBLISHER else CAUGHT, tuple(own), first.endpoint.place)
    return Finding(
        code=code,
        name=info.name,
        severity=severity or Severity(info.severity),
        message=message,
        topic=first.shown,
        sides=(side, *beside),
        notes=tuple(f"assumed: {each}" for each in assumed),
        because=info.reason,
        help=info.help,
        worlds=worlds,
        remedies=() if fix is None else (fix,),
    )


def draft_fix(ends: Sequence[Resolved], policy: str, value: Plain) -> Remedy | None:
    """Return a fix that changes a policy of some endpoints; its other effects are judged later."""
    first = ends[0]
    if (ENDPOINT, policy) not in first.pack.vocabulary.indices:
        return None
    members = tuple(sorted({each.id for each in ends}))
    return Remedy(
        role=PUBLISHER if first.role == PUBLISHER else SUBSCRIBER,
        members=members,
        policy=policy,
        value=first.pack.policy(policy).domain.format(value),
        kind="configuration",
        text="",
    )
