"""Resolves endpoints: own settings, profiles, overlays, conventions and defaults become values.

Each endpoint ends as a `QosProfile`, an interned tuple of values that endpoints with equal settings share. Where a
value came from is not stored: `Resolved.origin` finds it again in the layers, for the few values a finding prints.
"""

from __future__ import annotations

from dataclasses import replace
from functools import cached_property, partial
from itertools import chain
from typing import TYPE_CHECKING, Any

from cqos_core.language.policy import TOPIC
from cqos_core.model.caches import MOST_LETTERS, keep
from cqos_core.model.endpoint_rows import as_object, id_of, kinds_of, rows_of
from cqos_core.model.system import PUBLISHER
from cqos_core.packs.completion import nothing_follows, nothing_summed
from cqos_core.packs.topic_matching import Naming
from cqos_core.resolving.endpoint_classes import EndpointClass, class_key
from cqos_core.resolving.endpoint_values import EndpointValues
from cqos_core.resolving.layers import Layer
from cqos_core.resolving.participants import Participants, choose_variant, protocols_in_use
from cqos_core.resolving.parts import ProfileParts
from cqos_core.resolving.profiles import Profiles, User, conventions
from cqos_core.resolving.reader import SettingsReader, Whose
from cqos_core.resolving.resolved_endpoint import Resolved, ResolvedParticipant, ResolvedSystem

if TYPE_CHECKING:
    from collections.abc import Callable, Collection, Iterable, Mapping

    from cqos_core.model.endpoint_rows import Row, RowPattern
    from cqos_core.model.settings import Settings
    from cqos_core.model.system import Endpoint, Participant, System
    from cqos_core.packs.pack import RulePack
    from cqos_core.packs.topic_matching import NameProblem
    from cqos_core.resolving.overlays import Overlays
    from cqos_core.resolving.parts import Inherited
    from cqos_core.resolving.start_order import StartOrder


class Resolver:
    """Resolves one system; everything that endpoints can share is resolved once.

    Attributes:
        result: what is resolved so far.
        ids: of the endpoints among it.
        reaching: ids of stated endpoints whose edit may change other findings: they have findings of their own, or are the
            first to use a profile or an overlay.
        completed: a pack was asked what follows from the whole system.
        asked: by id of a pack, further policies whose spelling a rule asks for.
    """

    def __init__(
        self,
        system: System,
        find_pack: Callable[[str], RulePack | None],
        default: str | None,
        asked: Mapping[int, frozenset[int]] | None = None,
        known: Collection[str] = (),
        *,
        completed: bool = False,
    ) -> None:
        """Resolve ``system`` with the packs that ``find_pack`` finds, ``default`` where it states no protocol.

        ``known`` are the packs to suggest for a protocol without one; ``completed``: no pack is asked what follows.
        """
        self.system = system
        self.find_pack = find_pack
        self.default = default
        self.asked = asked or {}
        self.known = known
        self.result = ResolvedSystem(system)
        self.reader = SettingsReader(self.result.findings)
        self.participants = Participants(system, self.reader, self.result.participants)
        self.ids: set[str] = set()
        self.reaching: set[str] = set()
        self.completed = self._joint = False
        self._chosen: dict[str | None, RulePack | None] = {}
        self._implied: list[Endpoint] = []
        self._facts: dict[int, Settings] = {}
        self._topic_layers: dict[tuple[int, str, str], tuple[tuple[Layer, ...], bool]] = {}
        self._name_problems: dict[tuple[NameProblem, str, str], list[Endpoint]] = {}
        self._uses: set[tuple[str, str]] = set()
        self._owners: dict[tuple[str, str | None], ResolvedParticipant] = {}
        self._families: dict[tuple[ResolvedParticipant, tuple[Any, ...]], EndpointClass] = {}
        self._of_rows: dict[RowPattern, EndpointClass | None] = {}
        self._misread: dict[str, list[str]] = {}
        self.values = EndpointValues(self.reader)
        for note in system.notes:
            if note.endpoint is not None and note.severity == "error":
                self._misread.setdefault(note.endpoint, []).append(note.code)
        if not completed:
            self._complete()

    @cached_property
    def profiles(self) -> Profiles:
        """The profiles of the system."""
        return Profiles(self.system, self.reader)

    @cached_property
    def overlays(self) -> Overlays:
        """The overlays of the system."""
        from cqos_core.resolving.overlays import Overlays

        return Overlays(self.system, self.reader)

    @cached_property
    def _starts(self) -> StartOrder:
        from cqos_core.resolving.start_order import StartOrder

        return StartOrder(self.system)

    def _draft(self) -> Resolver:
        """Return a resolver for the same system whose findings are not read."""
        return Resolver(self.system, self.find_pack, self.default, self.asked, completed=True)

    def run(self) -> ResolvedSystem:
        """Resolve every endpoint of the system."""
        for endpoint in chain(rows_of(self.system.endpoints), self._implied):
            self.stated(endpoint)
        for participant in self.system.participants.values():
            # Settings of a participant without endpoints are checked, too.
            pack = self._pack_of(participant.protocol or self.system.protocol or self.default)
            if pack is not None:
                self.participants.resolved(participant, pack)
            self._joint = self._joint or bool(participant.starts_after)
        for pack in self.result.packs.values():
            if pack.sum_up is not nothing_summed:
                from cqos_core.resolving.completion import sum_up

                sum_up(pack, self.result.endpoints)
        self.report_rest()
        return self.result

    def _complete(self) -> None:
        """Let the packs in use complete the system."""
        for protocol in protocols_in_use(self.system, self.default):
            pack = self._pack_of(protocol)
            if pack is None or (pack.complete is nothing_follows and pack.sum_up is nothing_summed):
                continue
            from cqos_core.resolving.completion import known_broker, known_endpoint, known_participant

            self.completed = True
            stated = [each for each in self.system.endpoints if self._protocol_of(each) == pack.id]
            owners = {each.participant for each in stated}
            participants = [
                each
                for each in self.system.participants.values()
                if each.id in owners or (each.protocol or self.system.protocol or self.default) == pack.id
            ]
            # Mistakes in the settings are reported when they are resolved with the completion.
            draft = self._draft()
            brokers = self.participants.brokers(pack)
            completion = pack.complete(
                [known_participant(each, pack, draft.participants) for each in participants],
                [known_endpoint(each, pack, partial(draft.alone, each, pack)) for each in stated],
                {name: known_broker(each, pack, draft.participants) for name, each in brokers.items()},
            )
            self.participants.facts.update(completion.participants)
            self._facts.update({id(stated[at]): facts for at, facts in completion.endpoints.items()})
            self._implied += completion.implied

    def alone(self, endpoint: Endpoint, pack: RulePack) -> Resolved:
        """Resolve one stated endpoint with one pack, and leave it out of the result."""
        owner = self.participants.resolved(self.system.participants[endpoint.participant], pack)
        return self._resolved(endpoint, self._family(endpoint, owner), endpoint.id, endpoint.id)

    def _protocol_of(self, endpoint: Endpoint) -> str | None:
        of_owner = self.system.participants[endpoint.participant].protocol
        return endpoint.protocol or of_owner or self.system.protocol or self.default

    def owner_of(self, endpoint: Endpoint) -> ResolvedParticipant | None:
        """Return the participant of an endpoint in the eyes of its pack; None without a pack."""
        key = endpoint.participant, endpoint.protocol
        owner = self._owners.get(key)
        if owner is None:
            pack = self._pack_of(self._protocol_of(endpoint))
            if pack is None:
                return None
            owner = self.participants.resolved(self.system.participants[endpoint.participant], pack)
            self._owners[key] = owner
        return owner

    def stated(self, endpoint: Endpoint | Row) -> None:
        """Resolve one endpoint as it is stated; it may stand for several."""
        before = self._noted()
        self._stated(endpoint)
        if self._noted() != before:
            self.reaching.add(id_of(endpoint))

    def again(self, endpoints: Iterable[Endpoint], gone: Iterable[Resolved]) -> list[Resolved]:
        """Resolve endpoints in place of others, and leave them out of the result."""
        self.ids.difference_update([each.id for each in gone])
        self.result.endpoints = []
        for each in endpoints:
            self.stated(each)
        made, self.result.endpoints = self.result.endpoints, []
        return made

    @property
    def is_joint(self) -> bool:
        """Whether endpoints depend on others when they are resolved: on ids, start order, or completion by a pack."""
        return self._joint or self.completed

    def _noted(self) -> tuple[int, ...]:
        """Return the numbers of findings and notes that are not about one endpoint alone."""
        return self.reader.remarks, len(self._uses), self.overlays.noted if self.system.overlays else 0

    def _stated(self, endpoint: Endpoint | Row) -> None:
        facts = self._facts.get(id(endpoint)) if self._facts else None
        if facts:
            endpoint = as_object(endpoint)
            endpoint = replace(endpoint, settings={**endpoint.settings, **facts})
        family = self._family_of(endpoint)
        if family is None:
            endpoint = as_object(endpoint)
            self.result.packless.setdefault(self._protocol_of(endpoint) or "", []).append(endpoint)
            self.reader.remarks += 1
            return
        if family.needs_in_vain:
            endpoint = as_object(endpoint)
            message = f"publisher `{endpoint.id}` states `needs`, which only a subscriber has"
            place = next(iter(endpoint.needs.values())).place or endpoint.place
            self.reader.say("CQ210", message, place, PUBLISHER, [endpoint.id])
            endpoint = replace(endpoint, needs={})
            family = self._family(endpoint, family.owner)
        stated_id = id_of(endpoint)
        if not family.expands:
            self.result.endpoints.append(self._resolved(endpoint, family, self._unique(stated_id), stated_id))
            return
        for each in family.owner.pack.topic_matching.expand(as_object(endpoint)):
            part = self._family(each, family.owner)
            self.result.endpoints.append(self._resolved(each, part, self._unique(each.id), stated_id))

    def _family_of(self, endpoint: Endpoint | Row) -> EndpointClass | None:
        """Return the family of an endpoint as its pack sees it; None without a pack."""
        if type(endpoint) is tuple:
            kind = endpoint[0]
            try:
                return self._of_rows[kind]
            except KeyError:
                found = self._of_rows[kind] = self._family_of(kind.endpoint)
                return found
        owner = self.owner_of(endpoint)  # type: ignore[arg-type]
        return None if owner is None else self._family(endpoint, owner)  # type: ignore[arg-type]

    def _family(self, endpoint: Endpoint, owner: ResolvedParticipant) -> EndpointClass:
        key = (owner, class_key(endpoint))
        found = self._families.get(key)
        if found is None:
            found = keep(self._families, key, EndpointClass(endpoint, owner))
            self._joint = self._joint or bool(endpoint.starts_after)
            of_system = [ref.name for ref in endpoint.profiles if ref.name in self.system.profiles]
            self._uses.update([(name, endpoint.role) for name in of_system])
        if endpoint.needs and not owner.pack.needs:
            self.reader.remarks += 1
        return found

    def report_rest(self) -> None:
        """Report input that no rule pack checks."""
        if self.result.packless or self._name_problems or any(each.needs for each in kinds_of(self.system.endpoints)):
            from cqos_core.resolving.unjudged import unjudged_findings

            self.result.findings += unjudged_findings(self.result, self._name_problems, self.known)
        if self.system.overlays:
            self.overlays.report()
        self.participants.report()
        self.reader.finish()

    def _pack_of(self, protocol: str | None) -> RulePack | None:
        if protocol in self._chosen:
            return self._chosen[protocol]
        chosen = self.find_pack(protocol) if protocol is not None else None
        if chosen is not None:
            chosen = choose_variant(chosen, self.system.options.get(chosen.id, {}))
            self.result.packs[chosen.id] = chosen
        self._chosen[protocol] = chosen
        return chosen

    # Topics

    def _name(self, endpoint: Endpoint | Row, topic: str, family: EndpointClass) -> Naming:
        naming = family.named(topic)
        for problem in naming.problems:
            key = problem, naming.shown, family.owner.pack.id
            self._name_problems.setdefault(key, []).append(as_object(endpoint))
            self.reader.remarks += 1
        return naming

    def _of_topic(self, written: str, naming: Naming, pack: RulePack) -> tuple[tuple[Layer, ...], bool]:
        """Topic-level layers, nearest first, and whether the topic is external."""
        of_topic = conventions if len(naming.key or "") <= MOST_LETTERS else conventions.__wrapped__
        if not self.system.topics:
            return of_topic(pack, naming.key)
        key = (id(pack), naming.key or "", written)
        found = self._topic_layers.get(key)
        if found is not None:
            return found
        layers: list[Layer] = []
        conventional, external = of_topic(pack, naming.key)
        for name in dict.fromkeys((written, naming.shown, naming.key)):
            stated = self.system.topics.get(name) if name is not None else None
            if stated is not None and stated.protocol in {None, pack.id}:
                settings, unread = self.reader.recognise(
                    Whose(pack, (TOPIC,), pack.dialects.get("yaml"), f"topic `{stated.name}`", TOPIC, [stated.name]),
                    stated.settings,
                )
                layers.append(Layer("topic", settings, unread=unread))
                external = external or stated.external
        found = self._topic_layers[key] = ((*layers, *conventional), external)
        return found

    # Endpoints

    def resolved(
        self, endpoint: Endpoint, owner: Participant, pack: RulePack, identifier: str, stated_id: str
    ) -> Resolved:
        """Resolve one endpoint with one pack, under the given id; see `Resolved` for the two ids."""
        family = self._family(endpoint, self.participants.resolved(owner, pack))
        resolved = self._resolved(endpoint, family, identifier, stated_id)
        self.reader.finish()
        return resolved

    def _resolved(self, endpoint: Endpoint | Row, family: EndpointClass, identifier: str, stated_id: str) -> Resolved:
        topic = endpoint[2] if type(endpoint) is tuple else endpoint.topic  # type: ignore[union-attr]
        owner, external = family.owner, family.external
        system, naming = self.system, None
        problems: tuple[NameProblem, ...] = ()
        topic_layers: tuple[Layer, ...] = ()
        plain = None if system.topics else family.plain_name(topic)
        if plain is not None:
            naming = Naming(plain, plain)
        elif topic is not None:
            naming = self._name(endpoint, topic, family)
            problems = naming.problems
            if system.topics or (naming.key is not None and family.conventions.may_match(naming.key)):
                topic_layers, elsewhere = self._of_topic(topic, naming, owner.pack)
                external = external or elsewhere
        inherited = family.inherited
        if inherited is None or topic_layers:
            inherited = self._inherited(endpoint, family, naming, topic_layers)
        settings, is_taken = self.values.own(inherited, endpoint)
        made = Resolved.of(endpoint, owner, naming, identifier, stated_id, external=external)
        overlays = self._covering(endpoint, naming, owner) if system.overlays else ()
        if is_taken and not overlays:
            made.parts = tuple.__new__(ProfileParts, (inherited, settings, topic_layers))  # twice as fast
        else:
            lay = partial(self.overlays.lay, overlays, owner, observed=family.endpoint.observed) if overlays else None
            laid = self.values.laid(inherited, settings, overlays, lay)
            made.parts, made.profile, made.layers = None, laid.profile, laid.layers + topic_layers
            if laid.remarks:
                self.reader.repeat(laid.remarks, made.endpoint, identifier)
        if family.starts_after:
            made.starts_after = self._starts.before(family.starts_after)
        if self._misread and (misread := self._misread.get(stated_id)):
            # A setting that the reader of its file reports as wrong may have set any policy.
            made.profile = made.profile.with_values({}, beside=misread)
        if problems:
            wrong = [each.code for each in problems if each.severity == "error"]
            made.profile = made.profile.with_values({}, refused=wrong)
        return made

    def _inherited(
        self, endpoint: Endpoint | Row, family: EndpointClass, naming: Naming | None, topic_layers: tuple[Layer, ...]
    ) -> Inherited:
        """Return the profile and layers of an endpoint before its own settings."""
        before, like, by_topic, profiles = self.reader.remarks, family.endpoint, False, None
        if like.profiles:
            by_topic = self.profiles.by_topic or any(ref.scope.by_topic for ref in like.profiles)
            user = User(like.dialect, like.role, naming.shown if naming is not None and by_topic else "")
            profiles = self.profiles, user
        asked = family.owner.pack.asked | self.asked.get(id(family.owner.pack), frozenset())
        found = self.values.inherited(as_object(endpoint), family.owner, topic_layers, asked, profiles)
        if not topic_layers and not by_topic and self.reader.remarks == before:
            family.inherited = found
        return found

    def _covering(self, endpoint: Endpoint | Row, naming: Naming | None, owner: ResolvedParticipant) -> tuple[int, ...]:
        return tuple(self.overlays.covering(as_object(endpoint), naming, owner))

    def _unique(self, identifier: str) -> str:
        """Return ``identifier``, with a number where an endpoint of another source already has it."""
        unique, number = identifier, 2
        while unique in self.ids:
            self._joint = True
            unique, number = f"{identifier}~{number}", number + 1
        self.ids.add(unique)
        return unique


def resolve(
    system: System, find_pack: Callable[[str], RulePack | None], default_protocol: str | None = None
) -> ResolvedSystem:
    """Resolve every endpoint of ``system``; ``default_protocol`` is that of endpoints for which it states none."""
    return Resolver(system, find_pack, default_protocol).run()
