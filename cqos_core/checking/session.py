"""A system kept open while it is edited: after an edit only the topics are judged again that it touches.

A session's report equals that of a fresh check, always.
"""

from __future__ import annotations

from copy import deepcopy
from dataclasses import fields, replace
from operator import attrgetter
from typing import TYPE_CHECKING, Any, Final

from cqos_core.checking.checker import check, check_system
from cqos_core.checking.trial import tried_out
from cqos_core.inputs.reading import faults, faults_of
from cqos_core.matching.pipeline import Context, Pipeline, SettingValue, as_text, context, exact_places, resolve_all
from cqos_core.model.problems import InputError
from cqos_core.model.system import NAMED, Participant, Setting, System

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Mapping, Sequence

    from cqos_core.checking.topic import TopicResult
    from cqos_core.matching.pairing import TopicKey
    from cqos_core.model.report import Report
    from cqos_core.model.system import (
        Acceptance,
        Bridge,
        Broker,
        Endpoint,
        ImportNote,
        Overlay,
        Profile,
        TeamRule,
        Topic,
    )
    from cqos_core.packs.pack import RulePack
    from cqos_core.resolving.resolve import Resolver
    from cqos_core.resolving.resolved import Resolved


class Edits:
    """The edits of a system.

    An edit is data: its kind, which is the name of a field of `cqos.v1.Change`, and its value. A session of this process
    raises `InputError` for an endpoint that cannot be checked, and `KeyError` for a name that the system does not have. A
    session of the service raises `ServiceError` instead, when it makes its report, and then does none of the edits.
    """

    def edit(self, kind: str, value: Any) -> None:
        """Do one edit."""
        raise NotImplementedError

    def put(self, endpoint: Endpoint) -> None:
        """Add an endpoint, or replace the one with its id."""
        self.edit("put_endpoint", endpoint)

    def remove(self, endpoint_id: str) -> None:
        """Remove an endpoint."""
        self.edit("remove_endpoint", endpoint_id)

    def put_participant(self, participant: Participant) -> None:
        """Add a participant, or replace the one with its id."""
        self.edit("put_participant", participant)

    def remove_participant(self, participant_id: str) -> None:
        """Remove a participant and its endpoints."""
        self.edit("remove_participant", participant_id)

    def put_profile(self, profile: Profile) -> None:
        """Add a profile, or replace the one of its name."""
        self.edit("put_profile", profile)

    def remove_profile(self, name: str) -> None:
        """Remove a profile."""
        self.edit("remove_profile", name)

    def put_topic(self, topic: Topic) -> None:
        """Set the facts of a topic, in place of its earlier facts."""
        self.edit("put_topic", topic)

    def remove_topic(self, name: str) -> None:
        """Remove the facts of a topic."""
        self.edit("remove_topic", name)

    def put_broker(self, broker: Broker) -> None:
        """Add a broker, or replace the one with its id."""
        self.edit("put_broker", broker)

    def remove_broker(self, broker_id: str) -> None:
        """Remove a broker."""
        self.edit("remove_broker", broker_id)

    def put_bridge(self, bridge: Bridge) -> None:
        """Add a bridge, or replace the one with its id; a side in a participant that is not there becomes a finding."""
        self.edit("put_bridge", bridge)

    def remove_bridge(self, bridge_id: str) -> None:
        """Remove a bridge."""
        self.edit("remove_bridge", bridge_id)

    def set_overlays(self, overlays: Iterable[Overlay]) -> None:
        """Replace the settings that are laid over those of endpoints."""
        self.edit("set_overlays", [*overlays])

    def set_protocol(self, protocol: str | None) -> None:
        """Set the protocol of participants that state none; None leaves it open."""
        self.edit("set_protocol", protocol)

    def set_option(self, pack: str, name: str, value: SettingValue | None) -> None:
        """Set an option of the whole system; None removes it."""
        self.edit("set_option", (pack, name, None if value is None else as_text(value)))

    def set_name(self, name: str) -> None:
        """Set the name of the system in the report."""
        self.edit("set_name", name)

    def set_notes(self, notes: Iterable[ImportNote]) -> None:
        """Replace the remarks of importers, which become findings."""
        self.edit("set_notes", [*notes])

    def set_partial(self, partial: bool) -> None:  # noqa: FBT001 - the only argument
        """Set whether the system is a part, so that an endpoint without partner is no reason for a warning."""
        self.edit("set_partial", partial)

    def set_hypothetical(self, hypothetical: bool) -> None:  # noqa: FBT001 - the only argument
        """Set whether the endpoints only try profiles that no endpoint uses, so that their pairs set no verdict."""
        self.edit("set_hypothetical", hypothetical)

    def set_rules(
        self,
        *,
        checks: Iterable[TeamRule] | None = None,
        accept: Iterable[Acceptance] | None = None,
        severities: Mapping[str, str] | None = None,
    ) -> None:
        """Replace the team's rules, the accepted exceptions or the severities; None leaves them."""
        if checks is not None:
            self.edit("set_checks", [*checks])
        if accept is not None:
            self.edit("set_accept", [*accept])
        if severities is not None:
            self.edit("set_severities", dict(severities))


_RULES: Final = frozenset({"checks", "accept", "severities"})


class Session(Edits):
    """Holds one system open for edits.

    Attributes:
        judged: how many topics the last `report` judged anew, for those who want to see that it is few.
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
        self._system = deepcopy(system) if system is not None else System()
        self._context: Context = context(packs, protocol)
        if most_endpoints is not None:
            self._context = replace(self._context, most_endpoints=most_endpoints)
        self._resolver: Resolver | None = None
        self._resolved: dict[str, list[Resolved]] = {}
        self._seen: dict[TopicKey, tuple[object, ...]] = {}
        self._results: dict[TopicKey, TopicResult] = {}
        self._touched: dict[str, None] = {}
        self.judged = 0

    @property
    def system(self) -> System:
        """A copy of the system as it now stands."""
        return deepcopy(self._system)

    def edit(self, kind: str, value: Any) -> None:
        """Do one edit; those of endpoints touch their topics only, after others all endpoints are resolved again.

        Raises:
            KeyError: the system has no entry of the name to remove.
            InputError: the endpoint cannot be checked.
        """
        verb, _, what = kind.partition("_")
        if what == "endpoint":
            self._edit_endpoint(verb, value)
            return
        if what == "option":
            self._set_option(*value)
        elif verb == "set":
            setattr(self._system, what, deepcopy(value))
        else:
            entries = getattr(self._system, f"{what}s")
            if verb == "put":
                entries[getattr(value, NAMED[f"{what}s"])] = deepcopy(value)
            else:
                del entries[value]
        if kind == "remove_participant":
            self._system.endpoints = [each for each in self._system.endpoints if each.participant != value]
        if what in _RULES:  # an accepted exception divides groups, so all topics are judged again
            self._seen.clear()
        if what != "name":
            self._resolver = None

    def _edit_endpoint(self, verb: str, value: Any) -> None:
        endpoints = self._system.endpoints
        if verb == "put":
            if wrong := [*faults_of(value, self._system.participants)]:
                raise InputError(wrong)
            name = value.id
            at = next((index for index, known in enumerate(endpoints) if known.id == name), len(endpoints))
            endpoints[at : at + 1] = [deepcopy(value)]
        else:
            name = value
            self._system.endpoints = [each for each in endpoints if each.id != name]
            if len(self._system.endpoints) == len(endpoints):
                raise KeyError(name)
        self._touched[name] = None

    def _set_option(self, pack: str, name: str, text: str | None) -> None:
        options = self._system.options.setdefault(pack, {})
        if text is None:
            options.pop(name, None)
        else:
            options[name] = Setting(text)
        if not options:
            del self._system.options[pack]

    def report(self) -> Report:
        """Check what has changed, and report on the whole system."""
        tried = tried_out(self._system, self._context.default_protocol)
        if tried is not self._system:
            report = check_system(tried, self._context)
            self.judged = report.topics
            return exact_places(report, self._system.sources)
        self.judged = 0
        seen: dict[TopicKey, tuple[object, ...]] = {}
        results: dict[TopicKey, TopicResult] = {}

        def judged(key: TopicKey, endpoints: Sequence[Resolved], judge: Callable[[], TopicResult]) -> TopicResult:
            seen[key] = tuple(map(_content, endpoints))
            known = self._results.get(key)
            if known is None or self._seen.get(key) != seen[key]:
                self.judged += 1
                known = judge()
            results[key] = known
            return known

        report = check(Pipeline(self._system, self._context, self._resolve), judged)
        self._seen, self._results = seen, results
        return exact_places(report, self._system.sources)

    def _resolve(self, pipeline: Pipeline) -> Resolver:
        """Resolve the touched endpoints, or all where more than endpoints has changed or anything was wrong."""
        resolver, system = self._resolver, pipeline.system
        touched, self._touched = self._touched, {}
        ids = [endpoint.id for endpoint in system.endpoints]
        if (
            resolver is not None
            and not resolver.result.findings
            and resolver.asked == pipeline.asked
            and len(ids) == len(set(ids))
            # Bridges add endpoints and hand needs on, so that one edit may reach any topic.
            and not (system.overlays or system.bridges)
            # An endpoint may start after others by way of one that is edited.
            and not any(endpoint.starts_after for endpoint in system.endpoints)
            # What follows from all endpoints together follows anew from each edit.
            and not resolver.completed
        ):
            self._resolve_touched(resolver, touched)
            if not resolver.result.findings and not resolver.clashes:
                return resolver
        # A finding may belong to something that several endpoints share, so that only a fresh start tells who has it now.
        self._resolver = resolver = resolve_all(pipeline)
        self._resolved = {}
        for resolved in resolver.result.endpoints:
            self._resolved.setdefault(resolved.stated_id, []).append(resolved)
        return resolver

    def _resolve_touched(self, resolver: Resolver, touched: dict[str, None]) -> None:
        if not touched:
            return
        gone = {id(resolved) for name in touched for resolved in self._resolved.pop(name, ())}
        kept = [resolved for resolved in resolver.result.endpoints if id(resolved) not in gone]
        resolver.ids = {resolved.id for resolved in kept}
        resolver.result.endpoints = kept
        stated = {endpoint.id: endpoint for endpoint in self._system.endpoints if endpoint.id in touched}
        for name in touched:
            if name in stated:
                before = len(kept)
                resolver.stated(stated[name])
                self._resolved[name] = kept[before:]
        resolver.report_rest()


_BESIDE_SETTINGS: Final = attrgetter(*(each.name for each in fields(Participant) if each.name != "settings"))
"""What a participant says beside its settings, which are in its layers."""


def _content(resolved: Resolved) -> tuple[object, ...]:
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
