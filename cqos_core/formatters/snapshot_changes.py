"""Changes of a running system between two snapshots, as text lines."""

from __future__ import annotations

import time
from collections import Counter
from typing import TYPE_CHECKING, Final

from cqos_core.checking.checker import check_system
from cqos_core.formatters.terminal import clean
from cqos_core.language.policy import ENDPOINT
from cqos_core.model.finding import Verdict, plural

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from cqos_core.matching.pipeline import CheckContext
    from cqos_core.model.report import Report
    from cqos_core.model.system import Endpoint, Role, System
    from cqos_core.packs.pack import RulePack

_VERBS: Final = {"publisher": "publishes", "subscriber": "subscribes"}


def watch_changes(look: Callable[[], System], context: CheckContext, pause: Callable[[], object]) -> Iterator[str]:
    """Take snapshots of a system; yield its state at first, then each change, with the time of day.

    Args:
        look: takes a snapshot.
        context: the packs to check it with.
        pause: waits between two snapshots; a true result ends the loop.
    """
    before: set[str] | None = None
    ended: object = False
    while not ended:
        now = set(system_lines(look(), context))
        lines = [f"+ {each}" for each in sorted(now - (before or set()))]
        lines += [f"- {each}" for each in sorted((before or set()) - now)]
        if lines or before is None:
            yield "\n".join([time.strftime("%H:%M:%S"), *(lines or ["nothing is there yet"])]) + "\n"
        before = now
        ended = pause()


def system_lines(system: System, context: CheckContext) -> Iterator[str]:
    """Yield one line for each endpoint, each finding above a note, and each subscriber that loses publishers."""
    report = check_system(system, context)
    for each in system.endpoints:
        owner = system.participants.get(each.participant)
        protocol = each.protocol or (owner and owner.protocol) or system.protocol
        yield _endpoint(each, context.find_pack(protocol) if protocol else None)
    for finding in report.findings:
        if finding.severity != "note":
            yield clean(f"{finding.severity}[{finding.code}] {finding.message}")
    yield from subscriber_losses(report)


def subscriber_losses(report: Report) -> Iterator[str]:
    """Yield the subscribers with incompatible pairs, each with the number of publishers that it loses."""
    publishers: Counter[tuple[str, str]] = Counter()
    lost: Counter[tuple[str, str]] = Counter()
    for group in report.groups:
        for subscriber in group.subscribers:
            publishers[group.topic, subscriber] += len(group.publishers)
            if group.verdict is Verdict.INCOMPATIBLE:
                lost[group.topic, subscriber] += len(group.publishers)
    for (topic, subscriber), count in sorted(lost.items()):
        of = publishers[topic, subscriber]
        what = "gets nothing" if count == of else f"loses {count} of {plural(of, 'publisher')}"
        yield clean(f"{subscriber} {what} on {topic}")


def _endpoint(endpoint: Endpoint, pack: RulePack | None) -> str:
    """Return a line with an endpoint and its values other than defaults."""
    stated = ", ".join(
        f"{name} {each.text}"
        for name, each in endpoint.settings.items()
        if not each.unknown and each.text != _default(pack, name, endpoint.role)
    )
    kind = _VERBS[endpoint.role] if endpoint.kind == "message" else endpoint.kind.replace("_", " ")
    return clean(f"{endpoint.participant} {kind} {endpoint.topic}{f' ({stated})' if stated else ''}")


def _default(pack: RulePack | None, name: str, role: Role) -> str | None:
    index = None if pack is None else pack.find(ENDPOINT, name)
    return None if pack is None or index is None else pack.policies[index].default_for(role)
