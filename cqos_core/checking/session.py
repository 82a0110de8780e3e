"""A system kept open while it is edited: after an edit only the topics are judged again that it touches.

A session's report equals that of a fresh check, always.
"""

from __future__ import annotations

from collections import Counter, deque
from contextlib import suppress
from copy import deepcopy
from dataclasses import fields, replace
from operator import attrgetter
from typing import TYPE_CHECKING, Any, Final, NamedTuple

from cqos_core.checking.checker import assemble, check_system, judge_topics, made
from cqos_core.checking.edits import Edits
from cqos_core.checking.quick import Quick, quick_way
from cqos_core.checking.stated import StatedEndpoints, copied
from cqos_core.checking.trial import tried_out, unused_profiles
from cqos_core.files.reading import faults, faults_of
from cqos_core.matching.pipeline import Context, Pipeline, context
from cqos_core.model.changes import Changes, Counts, Difference, counted
from cqos_core.model.exact_places import exact_places
from cqos_core.model.memory import uncollected
from cqos_core.model.problems import InputError
from cqos_core.model.report import Report, Verdict
from cqos_core.model.system import NAMED, Participant, Setting, System

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Sequence

    from cqos_core.checking.topic import TopicResult
    from cqos_core.matching.pairing import TopicKey
    from cqos_core.model.report import Finding, Group
    from cqos_core.model.system import Endpoint
    from cqos_core.packs.pack import RulePack
    from cqos_core.resolving.resolved import Resolved

_RULES: Final = frozenset({"checks", "accept", "severities"})
_REMEMBERED: Final = 100
"""How many revisions a session can go back to."""


class _Revision(NamedTuple):
    """What one call of `Session.changes` found: findings and groups that came and went, and the counts before and after."""

    number: int
    findings: Difference
    groups: Difference
    before: Counts
    counts: Counts


class Session(Edits):
    """Holds one system open for edits.

    Attributes:
        judged: how many topics the last `report` or `changes` judged anew, for those who want to see that it is few.
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
            InputError: it is none that can be checked; every fault is listed.
        """
        if system is not None and (wrong := faults(system)):
            raise InputError(wrong)
        system = system or System()
        self._endpoints = StatedEndpoints(system.endpoints)
        self._rest = deepcopy(replace(system, endpoints=[]))
        self._context: Context = context(packs, protocol)
        if most_endpoints is not None:
            self._context = replace(self._context, most_endpoints=most_endpoints)
        self._results: dict[TopicKey, TopicResult] = {}
        self._topics: dict[TopicKey, list[Resolved]] = {}
        self._quick: Quick | None = None
        # Reports without exact places: one that waits to be made, and that of the general way.
        self._whole: Report | None = None
        self._last = Report(Verdict.UNKNOWN)
        self._stale = True
        self._opened = False
        self._touched: dict[str, None] = {}
        self._uses = Counter[tuple[str, str]]()
        self._counts = Counts()
        self._pending = _Revision(0, Difference(), Difference(), self._counts, self._counts)
        self._revisions = deque[_Revision](maxlen=_REMEMBERED)
        self.judged = 0

    @property
    def system(self) -> System:
        """A copy of the system as it now stands."""
        return replace(deepcopy(self._rest), endpoints=[copied(each) for each in self._endpoints])

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
            self._endpoints.remove_of(value)
        if what in _RULES:  # an accepted exception divides groups, so all topics are judged again
            self._results = {}
        self._stale = self._stale or what not in {"name", "endpoint"}
        self._whole = None

    def _edit_endpoint(self, verb: str, value: Any) -> None:
        name = value.id if verb == "put" else value
        before = self._endpoints.find(name)
        several = name in self._endpoints.twice
        if verb == "put":
            if wrong := [*faults_of(value, self._rest.participants)]:
                raise InputError(wrong)
            self._endpoints.put(value)
            self._uses.update(_uses(value))
        else:
            self._endpoints.remove(value)
        self._touched[name] = None
        if before is not None:
            gone = _uses(before[1])
            self._uses.subtract(gone)
            # A profile that is no longer used is tried by itself.
            self._stale = self._stale or several or any(self._uses[use] <= 0 for use in gone)

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
        if self._whole is None and self._quick is not None:
            self._whole = self._quick.report(self._stated(), self._context)
        whole = self._whole or replace(self._last, system=self._rest.name)
        return exact_places(whole, self._rest.sources)

    def changes(self, since: int | None = None) -> Changes:
        """Check what has changed, and return what that changes in the report.

        An edit of an endpoint costs what it touches, however large the system is. Other edits cost about a check.

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
            self._pending = _Revision(last, Difference(), Difference(), self._counts, self._counts)
        if since is None:
            return self._read(last, [pending])
        steps = [each for each in self._revisions if each.number > since]
        if not 0 <= since <= last or len(steps) != last - since:
            raise KeyError(since)
        return self._read(last, steps or [pending])

    def _read(self, number: int, steps: Sequence[_Revision]) -> Changes:
        findings, groups = Difference(), Difference()
        for each in steps:
            findings.follow(each.findings)
            groups.follow(each.groups)
        sources = self._rest.sources

        def placed(found: Sequence[Finding]) -> Sequence[Finding]:
            return exact_places(Report(Verdict.UNKNOWN, findings=tuple(found)), sources).findings

        added, removed = findings.read(placed, attrgetter("code", "topic", "message"))
        added_groups, removed_groups = groups.read(lambda found: found, attrgetter("topic", "publishers"))
        return Changes(number, added, removed, added_groups, removed_groups, steps[-1].counts, steps[0].before)

    def resolved(self, names: Iterable[str]) -> list[tuple[Endpoint, Sequence[Resolved]]] | None:
        """Return endpoints of the last `report` or `changes` with what they amount to; None where that takes resolving all."""
        if self._quick is None:
            return None
        found = (self._endpoints.find(name) for name in names)
        return [(each[1], self._quick.parts(each[1].id)) for each in found if each is not None]

    def _stated(self) -> System:
        return replace(self._rest, endpoints=[*self._endpoints])

    def _follow(self) -> None:
        """Judge what edits have touched since the last time."""
        self.judged = 0
        touched, self._touched = self._touched, {}
        if not self._stale and touched:
            step = self._quick.follow(touched) if self._quick is not None else None
            self._stale = step is None
            if step is not None and self._quick is not None:
                self.judged = len(step.topics)
                gone, came, old, new = self._quick.findings.change(step)
                self._pending.findings.add(gone, came)
                self._pending.groups.add(old, new)
                self._counts = self._quick.findings.counts
        if self._stale:
            self._afresh()

    def _afresh(self) -> None:
        """Resolve all endpoints again, and judge the topics that this makes others."""
        known = self._known() if self._opened else ([], [])
        whole = self._stated()
        self._uses = Counter(use for each in self._endpoints for use in _uses(each))
        with uncollected(len(whole.endpoints)):
            tried = tried_out(whole, self._context.default_protocol)
            if tried is not whole or unused_profiles(whole, self._context.default_protocol) is not None:
                self._quick, self._results, self._topics = None, {}, {}
                self._last = made(check_system(tried, self._context))
                self.judged = self._last.topics
            else:
                self._judge(whole)
        now = self._known()
        if self._opened:
            self._pending.findings.add(known[0], now[0])
            self._pending.groups.add(known[1], now[1])
        self._counts = self._quick.findings.counts if self._quick is not None else counted(self._last)
        self._whole = None
        if not self._opened:
            self._pending = self._pending._replace(before=self._counts)
        self._opened, self._stale = True, False

    def _judge(self, whole: System) -> None:
        results, topics = self._results, self._topics

        def judged(key: TopicKey, endpoints: Sequence[Resolved], judge: Callable[[], TopicResult]) -> TopicResult:
            known = results.get(key)
            if known is None or _contents(topics[key]) != _contents(endpoints):
                self.judged += 1
                known = judge()
            return known

        pipeline = Pipeline(whole, self._context)
        found = judge_topics(pipeline, judged)
        self._results, self._topics = found.results, dict(pipeline.topics)
        self._quick = quick_way(pipeline, found, self._topics, self._endpoints)
        if self._quick is None:
            result = pipeline.resolver.result
            self._last = made(assemble(pipeline.system, result, found.results, self._context, found.problems))

    def _known(self) -> tuple[Sequence[Finding], Sequence[Group]]:
        """All findings and groups, as they were found last."""
        if self._quick is not None:
            return self._quick.findings.all, self._quick.groups
        return self._last.findings, self._last.groups


_BESIDE_SETTINGS: Final = attrgetter(*(each.name for each in fields(Participant) if each.name != "settings"))
"""What a participant says beside its settings, which are in its layers."""


def _uses(endpoint: Endpoint) -> list[tuple[str, str]]:
    """The profiles that an endpoint names, each with its role."""
    return [(ref.name, endpoint.role) for ref in endpoint.profiles]


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
