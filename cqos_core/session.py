"""A system kept open while it is edited: after an edit only the topics are judged again that it touches.

A session's report equals that of a fresh check, always.
"""

from __future__ import annotations

from copy import deepcopy
from dataclasses import fields, replace
from operator import attrgetter
from typing import TYPE_CHECKING, Final

from cqos_core.api import Context, SettingValue, as_text, context, exact_places, faults, faults_of
from cqos_core.bridging import bridge_findings, linked
from cqos_core.checker import assemble, check_system
from cqos_core.pairing import naming_endpoints
from cqos_core.problems import InputError
from cqos_core.resolve import Resolver
from cqos_core.routes import expanded
from cqos_core.system import Participant, Setting, System
from cqos_core.team import bind_checks, words_asked
from cqos_core.topic import TopicResult, check_topic
from cqos_core.trial import tried_out

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping

    from cqos_core.pack import RulePack
    from cqos_core.report import Report
    from cqos_core.resolved import Resolved
    from cqos_core.system import (
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

TopicKey = tuple[str, str]


class Session:
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

    # Edits of endpoints, which touch their topics only

    def put(self, endpoint: Endpoint) -> None:
        """Add an endpoint, or replace the one with its id.

        Raises:
            InputError: its participant is not part of the system, or it is no endpoint that can be checked.
        """
        if wrong := [*faults_of(endpoint, self._system.participants)]:
            raise InputError(wrong)
        endpoint = deepcopy(endpoint)
        for index, known in enumerate(self._system.endpoints):
            if known.id == endpoint.id:
                self._system.endpoints[index] = endpoint
                break
        else:
            self._system.endpoints.append(endpoint)
        self._touched[endpoint.id] = None

    def remove(self, endpoint_id: str) -> None:
        """Take an endpoint away.

        Raises:
            KeyError: there is none with this id.
        """
        kept = [endpoint for endpoint in self._system.endpoints if endpoint.id != endpoint_id]
        if len(kept) == len(self._system.endpoints):
            raise KeyError(endpoint_id)
        self._system.endpoints = kept
        self._touched[endpoint_id] = None

    # Edits of what endpoints share, after which all are resolved again

    def put_participant(self, participant: Participant) -> None:
        """Add a participant, or replace the one with its id."""
        self._system.participants[participant.id] = deepcopy(participant)
        self._forget()

    def remove_participant(self, participant_id: str) -> None:
        """Take a participant away, with its endpoints.

        Raises:
            KeyError: there is none with this id.
        """
        del self._system.participants[participant_id]
        self._system.endpoints = [e for e in self._system.endpoints if e.participant != participant_id]
        self._forget()

    def put_profile(self, profile: Profile) -> None:
        """Add a profile, or replace the one of its name."""
        self._system.profiles[profile.name] = deepcopy(profile)
        self._forget()

    def remove_profile(self, name: str) -> None:
        """Take a profile away.

        Raises:
            KeyError: there is none of this name.
        """
        del self._system.profiles[name]
        self._forget()

    def put_topic(self, topic: Topic) -> None:
        """State facts of a topic, in place of those stated before."""
        self._system.topics[topic.name] = deepcopy(topic)
        self._forget()

    def remove_topic(self, name: str) -> None:
        """Take the facts of a topic away.

        Raises:
            KeyError: none are stated under this name.
        """
        del self._system.topics[name]
        self._forget()

    def put_broker(self, broker: Broker) -> None:
        """Add a broker, or replace the one with its id."""
        self._system.brokers[broker.id] = deepcopy(broker)
        self._forget()

    def remove_broker(self, broker_id: str) -> None:
        """Take a broker away.

        Raises:
            KeyError: there is none with this id.
        """
        del self._system.brokers[broker_id]
        self._forget()

    def put_bridge(self, bridge: Bridge) -> None:
        """Add a bridge, or replace the one with its id; a side in a participant that is not there becomes a finding."""
        self._system.bridges[bridge.id] = deepcopy(bridge)
        self._forget()

    def remove_bridge(self, bridge_id: str) -> None:
        """Take a bridge away.

        Raises:
            KeyError: there is none with this id.
        """
        del self._system.bridges[bridge_id]
        self._forget()

    def set_overlays(self, overlays: Iterable[Overlay]) -> None:
        """Replace the settings that are laid over those of endpoints."""
        self._system.overlays = deepcopy([*overlays])
        self._forget()

    def set_protocol(self, protocol: str | None) -> None:
        """Say what participants are of that state no protocol, or with None leave it open."""
        self._system.protocol = protocol
        self._forget()

    def set_option(self, pack: str, name: str, value: SettingValue | None) -> None:
        """Set an option of the whole system, or with None take it away."""
        options = self._system.options.setdefault(pack, {})
        if value is None:
            options.pop(name, None)
        else:
            options[name] = Setting(as_text(value))
        if not options:
            del self._system.options[pack]
        self._forget()

    # What the report says beside findings about endpoints

    def set_name(self, name: str) -> None:
        """Call the system something else in the report."""
        self._system.name = name

    def set_notes(self, notes: Iterable[ImportNote]) -> None:
        """Replace what the readers of files had to say, which becomes findings."""
        self._system.notes = list(notes)
        self._forget()

    # Edits of what is made of all findings

    def set_rules(
        self,
        *,
        checks: Iterable[TeamRule] | None = None,
        accept: Iterable[Acceptance] | None = None,
        severities: dict[str, str] | None = None,
    ) -> None:
        """Replace the team's rules, the accepted exceptions or the severities; None leaves them."""
        if checks is not None:
            self._system.checks = list(checks)
        if accept is not None:
            self._system.accept = list(accept)
        if severities is not None:
            self._system.severities = dict(severities)
        # What is excused divides groups, so all topics are judged again.
        self._seen.clear()
        self._forget()

    def report(self) -> Report:
        """Check what has changed, and report on the whole system."""
        find_pack, default = self._context.find_pack, self._context.default_protocol
        tried = tried_out(self._system, default)
        if tried is not self._system:
            report = check_system(tried, self._context)
            self.judged = report.topics
            return exact_places(report, self._system.sources)
        system, links = expanded(self._system, find_pack, default, self._context.most_endpoints)
        teams, problems = bind_checks(system, find_pack, default)
        resolver = self._resolve(system, words_asked(teams))
        buckets, hops = linked(links, resolver)
        self.judged = 0
        excused = naming_endpoints(self._system.accept)
        results: dict[TopicKey, TopicResult] = {}
        seen: dict[TopicKey, tuple[object, ...]] = {}
        for key, endpoints in buckets.items():
            content = tuple(_content(endpoint) for endpoint in endpoints)
            seen[key] = content
            known = self._results.get(key)
            if known is None or self._seen.get(key) != content:
                known = check_topic(endpoints, excused, teams)
                self.judged += 1
            results[key] = known
        self._seen, self._results = seen, results
        report = assemble(
            system, resolver.result, results, self._context, [*problems, *bridge_findings(system, hops, buckets)]
        )
        return exact_places(report, self._system.sources)

    def _forget(self) -> None:
        self._resolver = None

    def _resolve(self, system: System, asked: Mapping[int, frozenset[int]]) -> Resolver:
        """Resolve the touched endpoints, or all where more than endpoints has changed or anything was wrong."""
        resolver = self._resolver
        touched, self._touched = self._touched, {}
        ids = [endpoint.id for endpoint in system.endpoints]
        # Bridges add endpoints and hand needs on, so that one edit may reach any topic.
        incremental = not system.overlays and not system.bridges and len(ids) == len(set(ids))
        # An endpoint may start after others by way of one that is edited.
        incremental = incremental and not any(endpoint.starts_after for endpoint in system.endpoints)
        # What follows from all endpoints together follows anew from each edit.
        incremental = incremental and (resolver is None or not resolver.completed)
        if incremental and resolver is not None and not resolver.result.findings and resolver.asked == asked:
            self._resolve_touched(resolver, touched)
            if not resolver.result.findings and not resolver.clashes:
                return resolver
        # A finding may belong to something that several endpoints share, so that only a fresh start tells who has it now.
        resolver = Resolver(
            system, self._context.find_pack, self._context.default_protocol, asked, self._context.known_packs
        )
        resolver.run()
        self._resolver = resolver
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
        _BESIDE_SETTINGS(resolved.participant.participant),
    )
