"""A session: a system kept open while it is edited. After an edit only its topics are judged again.

A session's report equals that of a fresh check, always.
"""

from __future__ import annotations

from collections import deque
from contextlib import suppress
from copy import deepcopy
from dataclasses import fields, replace
from itertools import chain
from operator import attrgetter
from typing import TYPE_CHECKING, Any, Final, NamedTuple, TypeVar

from cqos_core.checking.checker import assemble, check_system, judge_topics
from cqos_core.checking.hypothetical_pairs import unused_profiles, with_profiles_tried
from cqos_core.checking.open_check import OpenCheck, may_stay_open
from cqos_core.checking.system_editor import SystemEditor
from cqos_core.files.system_faults import faults, faults_of
from cqos_core.matching.pipeline import CheckContext, Pipeline, context
from cqos_core.model.changes import Changes, Counts, NetChange, counted
from cqos_core.model.exact_columns import with_exact_columns
from cqos_core.model.finding import Verdict
from cqos_core.model.garbage_collection import gc_paused
from cqos_core.model.grouping import grouped
from cqos_core.model.problems import InputError
from cqos_core.model.report import Report
from cqos_core.model.settings import Setting
from cqos_core.model.system import NAMED, Participant, System

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Sequence

    from cqos_core.checking.topic_check import TopicResult
    from cqos_core.matching.topic_groups import TopicKey
    from cqos_core.model.finding import Finding
    from cqos_core.model.system import Endpoint
    from cqos_core.packs.pack import RulePack
    from cqos_core.resolving.resolved_endpoint import Resolved

_T = TypeVar("_T")
_RULES: Final = frozenset({"checks", "accept", "severities"})
_REMEMBERED: Final = 100
"""Revisions that a session can go back to."""


class _Revision(NamedTuple):
    """The result of one call of `Session.changes`: added and removed findings and groups, and the counts before and after."""

    number: int
    findings: NetChange
    groups: NetChange
    before: Counts
    counts: Counts


class Session(SystemEditor):
    """Holds one system open for edits.

    Attributes:
        judged: the number of topics that the last `report` or `changes` judged.
    """

    def __init__(
        self,
        system: System | None = None,
        *,
        protocol: str | None = None,
        packs: Iterable[RulePack] = (),
        most_endpoints: int | None = None,
    ) -> None:
        """Open ``system``, or an empty one; the session keeps a copy; bridges may make so many endpoints of it.

        Raises:
            InputError: the system cannot be checked; every fault is listed.
        """
        if system is not None and (wrong := faults(system)):
            raise InputError(wrong)
        system = system or System()
        self._endpoints = grouped((each.id, _copied(each)) for each in system.endpoints)
        self._rest = deepcopy(replace(system, endpoints=[]))
        self._context: CheckContext = context(packs, protocol)
        if most_endpoints is not None:
            self._context = replace(self._context, most_endpoints=most_endpoints)
        self._results: dict[TopicKey, TopicResult] = {}
        self._topics: dict[TopicKey, list[Resolved]] = {}
        self._last: OpenCheck | Report = Report(Verdict.UNKNOWN)
        self._report: Report | None = None  # of the last check, without exact places
        self._stale = True
        self._opened = self._stayed = False
        self._touched: dict[str, None] = {}
        self._counts = Counts()
        self._pending = _Revision(0, NetChange(), NetChange(), self._counts, self._counts)
        self._revisions = deque[_Revision](maxlen=_REMEMBERED)
        self.judged = 0

    @property
    def system(self) -> System:
        """A copy of the system as it now stands."""
        whole = self._stated()
        return replace(deepcopy(self._rest), endpoints=[_copied(each) for each in whole.endpoints])

    def edit(self, kind: str, value: Any) -> None:
        """Do one edit; those of endpoints touch their topics only, after others all endpoints are resolved again.

        Raises:
            KeyError: the system has no entry of the name to remove.
            InputError: the endpoint cannot be checked.
        """
        if not self._opened:
            with suppress(InputError):  # what is opened may be too much for a check, until it is edited
                self._follow()
        verb, _, what = kind.partition("_")
        if what == "endpoint":
            self._edit_endpoint(verb, value)
        elif what == "option":
            self._set_option(*value)
        elif verb == "set":
            setattr(self._rest, what, deepcopy(value))
        else:
            entries = getattr(self._rest, f"{what}s")
            if verb == "put":
                entries[getattr(value, NAMED[f"{what}s"])] = deepcopy(value)
            else:
                del entries[value]
        if kind == "remove_participant":
            left = ((name, [e for e in alike if e.participant != value]) for name, alike in self._endpoints.items())
            self._endpoints = {name: alike for name, alike in left if alike}
        if what in _RULES:  # an accepted exception divides groups, so all topics are judged again
            self._results = {}
        self._stale = self._stale or what not in {"name", "endpoint"}
        self._report = None

    def _edit_endpoint(self, verb: str, value: Any) -> None:
        name = value.id if verb == "put" else value
        if verb == "put":
            if wrong := [*faults_of(value, self._rest.participants)]:
                raise InputError(wrong)
            # The first one of its id gives way.
            self._endpoints[name] = [_copied(value), *self._endpoints.get(name, [])[1:]]
        else:
            del self._endpoints[name]
        self._touched[name] = None

    def _set_option(self, pack: str, name: str, text: str | None) -> None:
        options = self._rest.options.setdefault(pack, {})
        if text is None:
            options.pop(name, None)
        else:
            options[name] = Setting(text)
        if not options:
            del self._rest.options[pack]

    def report(self) -> Report:
        """Check what has changed, and report on the whole system.

        Raises:
            InputError: bridges make too many endpoints.
        """
        self._follow()
        if self._report is None:
            last = self._last.report() if isinstance(self._last, OpenCheck) else self._last
            self._report = replace(last, system=self._rest.name)
        return with_exact_columns(self._report, self._rest.sources)

    def changes(self, since: int | None = None) -> Changes:
        """Check what has changed, and return what that changes in the report.

        An edit of an endpoint costs little if it changes only findings of its topics. Other edits cost about a check.

        Args:
            since: the revision of earlier changes, of the last hundred; None: the last call, or the opening of the session.

        Raises:
            KeyError: the session does not know the revision, or no longer.
            InputError: bridges make too many endpoints.
        """
        self._follow()
        pending, last = self._pending._replace(counts=self._counts), self._pending.number
        if pending.findings or pending.groups or pending.before != self._counts:
            last += 1
            pending = pending._replace(number=last)
            self._revisions.append(pending)
            self._pending = _Revision(last, NetChange(), NetChange(), self._counts, self._counts)
        if since is None:
            return self._read(last, [pending])
        steps = [each for each in self._revisions if each.number > since]
        if not 0 <= since <= last or len(steps) != last - since:
            raise KeyError(since)
        return self._read(last, steps or [pending])

    def _read(self, number: int, steps: Sequence[_Revision]) -> Changes:
        findings, groups = NetChange(), NetChange()
        for each in steps:
            findings.follow(each.findings)
            groups.follow(each.groups)
        sources = self._rest.sources

        def placed(found: Sequence[Finding]) -> Sequence[Finding]:
            return with_exact_columns(Report(Verdict.UNKNOWN, findings=tuple(found)), sources).findings

        added, removed = findings.read(placed, attrgetter("code", "topic", "message"))
        added_groups, removed_groups = groups.read(lambda found: found, attrgetter("topic", "publishers"))
        return Changes(number, added, removed, added_groups, removed_groups, steps[-1].counts, steps[0].before)

    def resolved(self, names: Iterable[str]) -> list[tuple[Endpoint, Sequence[Resolved]]] | None:
        """Return endpoints of the last `report` or `changes`, each with its resolved ones; None if all would have to be resolved."""
        if not isinstance(self._last, OpenCheck) or not self._stayed:
            return None
        stated = (self._endpoints[name][0] for name in names if name in self._endpoints)
        return [(each, self._last.parts(each.id)) for each in stated]

    def _stated(self) -> System:
        return replace(self._rest, endpoints=[*chain.from_iterable(self._endpoints.values())])

    def _follow(self) -> None:
        """Judge the topics of edits since the last time."""
        self.judged = 0
        touched, self._touched = self._touched, {}
        if not self._stale and touched:
            self._stale = not self._put(touched)
        if self._stale:
            self._afresh()

    def _put(self, touched: Iterable[str]) -> bool:
        """Put edited endpoints into the open check; return whether the edit changes nothing else."""
        if not isinstance(self._last, OpenCheck) or not self._endpoints:
            return False
        findings = self._last.findings
        step = self._last.put({name: self._endpoints.get(name, ()) for name in touched})
        if step is None:
            return False
        self._pending.findings.add(*_apart(findings, self._last.findings))
        self._pending.groups.add(step.gone, step.came)
        self._counts, self.judged, self._stayed = self._last.counts, step.judged, True
        return True

    def _afresh(self) -> None:
        """Resolve all endpoints again, and judge the topics that this makes others."""
        before, whole = self._last, self._stated()
        with gc_paused(len(whole.endpoints)):
            self._last = self._checked(whole)
        self._counts = self._last.counts if isinstance(self._last, OpenCheck) else counted(self._last)
        if self._opened:
            self._pending.findings.add(*_apart(before.findings, self._last.findings))
            self._pending.groups.add(*_apart(before.groups, self._last.groups))
        else:
            self._pending = self._pending._replace(before=self._counts)
        self._opened, self._stale, self._stayed = True, False, False

    def _checked(self, whole: System) -> OpenCheck | Report:
        """Check a system; topics whose input is unchanged keep their results."""
        results, topics, default = self._results, self._topics, self._context.default_protocol
        tried = with_profiles_tried(whole, default)
        if tried.hypothetical or unused_profiles(whole, default) is not None:
            report = check_system(tried, self._context)
            self._results, self._topics, self.judged = {}, {}, report.topics
            return report

        def judged(key: TopicKey, endpoints: Sequence[Resolved], judge: Callable[[], TopicResult]) -> TopicResult:
            known = results.get(key)
            if known is None or _contents(topics[key]) != _contents(endpoints):
                self.judged += 1
                known = judge()
            return known

        pipeline = Pipeline(whole, self._context)
        found = judge_topics(pipeline, judged)
        self._results, self._topics = found.results, dict(pipeline.topics)
        if may_stay_open(pipeline):
            return OpenCheck(pipeline, found, self._topics, self._stated)
        return assemble(pipeline.system, pipeline.resolver.result, found.results, self._context, found.problems)


def _apart(before: Iterable[_T], now: Iterable[_T]) -> tuple[list[_T], list[_T]]:
    """Return the items that are only in the first collection, and those only in the second."""
    old, new = set(map(id, before)), set(map(id, now))
    return [each for each in before if id(each) not in new], [each for each in now if id(each) not in old]


def _copied(endpoint: Endpoint) -> Endpoint:
    """Return a copy, whose settings are its own; it is never changed after that."""
    settings, overlay, needs = dict(endpoint.settings), dict(endpoint.overlay), dict(endpoint.needs)
    return replace(endpoint, settings=settings, overlay=overlay, needs=needs)


_BESIDE_SETTINGS: Final = attrgetter(*(each.name for each in fields(Participant) if each.name != "settings"))
"""The fields of a participant beside its settings, which are in its layers."""


def _contents(endpoints: Sequence[Resolved]) -> list[tuple[object, ...]]:
    """All that the check of a topic reads of its endpoints."""
    return [content(each) for each in sorted(endpoints, key=attrgetter("id"))]


def content(resolved: Resolved) -> tuple[object, ...]:
    """All that the check of a topic reads of an endpoint."""
    return (
        resolved.id,
        resolved.endpoint,
        resolved.shown,
        resolved.profile,
        resolved.layers,
        resolved.external,
        resolved.bridge,
        resolved.starts_after,
        resolved.participant.layers,
        frozenset(resolved.participant.requiring),
        _BESIDE_SETTINGS(resolved.participant.participant),
    )
