"""Which of all that is stated holds for an endpoint: its own settings, profiles, overlays, conventions, defaults.

Each endpoint ends as a `QosProfile`, an interned tuple of values that endpoints with equal settings share. Where a
value came from is not stored: `Resolved.origin` finds it again in the layers, for the few values a finding prints.
"""

from __future__ import annotations

from dataclasses import replace
from functools import cached_property, partial
from itertools import chain
from typing import TYPE_CHECKING, Any

from cqos_core.language.policy import ENDPOINT, NEED, TOPIC
from cqos_core.model.memory import MOST_LETTERS, remember
from cqos_core.model.rows import as_object, kinds_of, rows_of
from cqos_core.model.system import MESSAGE, PUBLISHER, Setting
from cqos_core.packs.parts import nothing_follows, nothing_summed
from cqos_core.resolving.bases import Bases, Draft
from cqos_core.resolving.participants import Participants, choose_variant, protocols_in_use
from cqos_core.resolving.plainly import Plainly, named, room_of, without_values
from cqos_core.resolving.profiles import Profiles, User, base_layer, conventions
from cqos_core.resolving.reader import SettingsReader, ValueSource, either, how_written
from cqos_core.resolving.resolved import (
    READ,
    Layer,
    QosProfile,
    Resolved,
    ResolvedParticipant,
    ResolvedSystem,
    Stated,
    intern,
)

if TYPE_CHECKING:
    from collections.abc import Callable, Collection, Iterable, Mapping

    from cqos_core.language.values import Value, WrittenValue
    from cqos_core.model.rows import Row
    from cqos_core.model.system import Endpoint, Participant, Settings, System
    from cqos_core.packs.meeting import NameProblem, Naming
    from cqos_core.packs.pack import RulePack
    from cqos_core.resolving.overlays import Overlays
    from cqos_core.resolving.starts import Starts


class Resolver:
    """Resolves one system; everything that endpoints can share is resolved once.

    Attributes:
        result: what is resolved so far.
        ids: of the endpoints among it.
        reaching: ids of stated endpoints that count beyond themselves: something is to be reported of what they state, or
            they are the first to use a profile or an overlay.
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
        self._packless: dict[str, list[Endpoint]] = {}
        self._implied: list[Endpoint] = []
        self._facts: dict[int, Settings] = {}
        self._topic_layers: dict[tuple[int, str, str], tuple[tuple[Layer, ...], bool]] = {}
        self._name_problems: dict[tuple[NameProblem, str, str], list[Endpoint]] = {}
        self._uses: set[tuple[str, str]] = set()
        self._owners: dict[tuple[str, str | None], ResolvedParticipant] = {}
        self._shared: dict[tuple[Any, ...], tuple[QosProfile, tuple[Layer, ...]]] = {}
        self._misread: dict[str, list[str]] = {}
        self.plainly = Plainly()
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
    def _starts(self) -> Starts:
        from cqos_core.resolving.starts import Starts

        return Starts(self.system)

    @cached_property
    def bases(self) -> Bases:
        """What endpoints have in common; it reports nothing."""
        draft = self._draft()
        return Bases(draft.reader, draft.bare)

    def _draft(self) -> Resolver:
        """Return one for the same system; its findings are not read."""
        return Resolver(self.system, self.find_pack, self.default, self.asked, completed=True)

    def run(self) -> ResolvedSystem:
        """Resolve every endpoint of the system."""
        for endpoint in chain(rows_of(self.system.endpoints), self._implied):
            self.stated(endpoint)
        for participant in self.system.participants.values():
            # What a participant states is checked even where it has no endpoint.
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
        """Ask the packs in use what follows from all that is stated."""
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
            # What is wrong with the settings is reported when they are resolved with what follows.
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
        return self._resolved(endpoint, owner, endpoint.id, endpoint.id)

    def bare(
        self, endpoint: Endpoint, participant: ResolvedParticipant, topic_layers: tuple[Layer, ...]
    ) -> tuple[QosProfile, tuple[Layer, ...]]:
        """Return the values and layers of an endpoint without profiles and overlays, with those of its topic."""
        user = User(endpoint.dialect, endpoint.role, "")
        return self._resolve(endpoint, "", participant, user, topic_layers, ())

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
        made = self.plainly.resolved(endpoint, self) if self.is_plain and id(endpoint) not in self._facts else None
        if made is not None:
            made.id = self._unique(made.id)
            self.result.endpoints.append(made)
            return
        endpoint = as_object(endpoint)
        before = self._noted()
        self._stated(endpoint)
        if self._noted() != before:
            self.reaching.add(endpoint.id)

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
        """Whether endpoints are resolved by what others state: their ids, their start, all that a pack completes."""
        return self._joint or self.completed

    def _noted(self) -> tuple[int, ...]:
        """How much was noted that is not of one endpoint alone."""
        return self.reader.remarks, len(self._uses), self.overlays.noted if self.system.overlays else 0

    def _stated(self, endpoint: Endpoint) -> None:
        facts = self._facts.get(id(endpoint))
        self._joint = self._joint or bool(endpoint.starts_after)
        self._uses.update([(ref.name, endpoint.role) for ref in endpoint.profiles if ref.name in self.system.profiles])
        if endpoint.needs and endpoint.role == PUBLISHER and endpoint.kind == MESSAGE:
            message = f"publisher `{endpoint.id}` states `needs`, which only a subscriber has"
            place = next(iter(endpoint.needs.values())).place or endpoint.place
            self.reader.say("CQ210", message, place, PUBLISHER, [endpoint.id])
            endpoint = replace(endpoint, needs={})
        if facts:
            endpoint = replace(endpoint, settings={**endpoint.settings, **facts})
        owner = self.owner_of(endpoint)
        if owner is None:
            self._packless.setdefault(self._protocol_of(endpoint) or "", []).append(endpoint)
            self.reader.remarks += 1
            return
        for expanded in owner.pack.meeting.expand(endpoint):
            self.result.endpoints.append(self._resolved(expanded, owner, self._unique(expanded.id), endpoint.id))

    @cached_property
    def is_plain(self) -> bool:
        """Whether nothing of the whole system changes what its endpoints state."""
        return not (self.asked or self._misread or self.system.overlays or self.system.profiles)

    def report_rest(self) -> None:
        """Report input that no rule pack checks."""
        if self._packless or self._name_problems or any(each.needs for each in kinds_of(self.system.endpoints)):
            from cqos_core.resolving.left_over import left_over

            self.result.findings += left_over(self.result, self._packless, self._name_problems, self.known)
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

    def _name(self, endpoint: Endpoint, participant: ResolvedParticipant) -> Naming | None:
        if endpoint.topic is None:
            return None
        context = participant.name_context(endpoint.kind, endpoint.dialect, endpoint.role)
        naming = named(endpoint.topic, participant.pack, *context)
        for problem in naming.problems:
            self._name_problems.setdefault((problem, naming.shown, participant.pack.id), []).append(endpoint)
            self.reader.remarks += 1
        return naming

    def of_topic(self, written: str, naming: Naming, pack: RulePack) -> tuple[tuple[Layer, ...], bool]:
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
                    pack,
                    ("topic",),
                    stated.settings,
                    pack.dialects.get("yaml"),
                    f"topic `{stated.name}`",
                    "topic",
                    [stated.name],
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
        resolved = self._resolved(endpoint, self.participants.resolved(owner, pack), identifier, stated_id)
        self.reader.finish()
        return resolved

    def _resolved(
        self, endpoint: Endpoint, participant: ResolvedParticipant, identifier: str, stated_id: str
    ) -> Resolved:
        pack, owner = participant.pack, participant.participant
        naming = self._name(endpoint, participant)
        topic_layers, topic_external = (
            ((), False) if naming is None else self.of_topic(endpoint.topic or "", naming, pack)
        )
        overlays = tuple(self.overlays.covering(endpoint, naming, participant)) if self.system.overlays else ()
        found = self._profile_of(endpoint, participant, naming, topic_layers, overlays, identifier)
        external = endpoint.external or owner.external or topic_external
        made = without_values(endpoint, participant, naming, identifier, stated_id, external)
        if isinstance(found, Draft):
            made.draft = found
        else:
            made.profile, made.layers = found
            made.draft = None
        if names := (*endpoint.starts_after, *owner.starts_after):
            made.starts_after = self._starts.before(names)
        if misread := self._misread.get(stated_id):
            # What the reader of its file reports as wrong may have set anything.
            made.profile = made.profile.with_values({}, beside=misread)
        if naming is not None and naming.problems:
            wrong = [each.code for each in naming.problems if each.severity == "error"]
            made.profile = made.profile.with_values({}, refused=wrong)
        return made

    def _profile_of(
        self,
        endpoint: Endpoint,
        participant: ResolvedParticipant,
        naming: Naming | None,
        topic_layers: tuple[Layer, ...],
        overlays: tuple[int, ...],
        identifier: str,
    ) -> Draft | tuple[QosProfile, tuple[Layer, ...]]:
        """The values of an endpoint and their layers, or a draft; those of an equal one, if nothing had to be said of it."""
        room = room_of(endpoint, participant)
        if topic_layers:
            room = (*room, tuple([(layer.counts_as_stated, layer.texts) for layer in topic_layers]))
        by_topic = bool(self.system.profiles) and self.profiles.by_topic
        alone = not (endpoint.profiles or endpoint.needs or overlays or self.asked or by_topic)
        if alone:
            # Nothing of it stands elsewhere in its system, so it has the values of an equal one in any other.
            read = None if endpoint.overlay else self.bases.read(room, endpoint, participant, topic_layers)
            if isinstance(read, Draft):
                return read
            if read is None:
                read = READ.get((room, *endpoint.said()))
            if read is not None:
                return (read[0], read[1] + topic_layers) if topic_layers else read
        by_topic = by_topic or any(ref.scope.by_topic for ref in endpoint.profiles)
        user = User(endpoint.dialect, endpoint.role, naming.shown if naming is not None and by_topic else "")
        stated = (room, *endpoint.said())
        signature = (
            *stated,
            *(overlays, id(topic_layers), user),
            tuple([(ref.name, ref.scope) for ref in endpoint.profiles]),
            tuple([(name, setting.text, setting.unknown) for name, setting in endpoint.needs.items()]),
        )
        shared = self._shared.get(signature)
        if shared is None:
            before = self.reader.remarks
            own = self._resolve(endpoint, identifier, participant, user, topic_layers, overlays)
            shared = own[0], own[1] + topic_layers
            if self.reader.remarks == before:
                self._shared[signature] = shared
                if alone:
                    remember(READ, stated, own)
        return shared

    def _unique(self, identifier: str) -> str:
        """Return ``identifier``, with a number where an endpoint of another source already has it."""
        unique, number = identifier, 2
        while unique in self.ids:
            self._joint = True
            unique, number = f"{identifier}~{number}", number + 1
        self.ids.add(unique)
        return unique

    def _resolve(
        self,
        endpoint: Endpoint,
        identifier: str,
        participant: ResolvedParticipant,
        user: User,
        topic_layers: tuple[Layer, ...],
        overlays: tuple[int, ...],
    ) -> tuple[QosProfile, tuple[Layer, ...]]:
        pack = participant.pack
        owner = f"{endpoint.role} `{identifier}`"
        own = self._own_layers(endpoint, identifier, participant, user, owner)
        written = own[1]
        layers, possible = (
            self.overlays.lay(own, overlays, participant, observed=endpoint.observed) if overlays else (own, {})
        )
        needs = self._needs(endpoint, pack, owner, identifier)
        values: list[Any] = []
        words: list[WrittenValue | None] = [None] * len(pack.policies)
        asked = pack.asked | self.asked.get(id(pack), frozenset())
        readings = {
            ENDPOINT: ValueSource(
                endpoint.role,
                tuple(layers),
                participant.values,
                pack.dialects.get(endpoint.dialect, pack.dialects.get("yaml")),
                owner,
                endpoint.place,
                endpoint.observed,
                identifier,
            ),
            NEED: ValueSource(endpoint.role, (needs,), {}, None, owner, endpoint.place, member=identifier),
            TOPIC: ValueSource(endpoint.role, topic_layers, participant.values, None, f"topic `{endpoint.topic}`"),
        }
        extra = {when: replace(readings[ENDPOINT], layers=(*more, *layers)) for when, more in possible.items()}
        stated = {index for layer in (*layers, needs, *topic_layers) if not layer.assumed for index in layer.settings}
        stated |= {index for reading in extra.values() for layer in reading.layers for index in layer.settings}
        for index, policy in enumerate(pack.policies):
            reading = readings.get(policy.level)
            if reading is None:
                values.append(participant.values[index])
            elif index not in stated:
                values.append(self._unstated(index, reading, participant, endpoint))
            else:
                if policy.level == ENDPOINT and endpoint.role not in policy.roles:
                    self.reader.without_effect(policy, written.settings.get(index), owner, endpoint.role, identifier)
                value = self.reader.value(pack, index, reading)
                for when, there in extra.items() if policy.level == ENDPOINT else ():
                    if any(index in layer.settings for layer in possible[when]):
                        value = either(participant, when, self.reader.value(pack, index, there), value)
                values.append(value)
                if index in asked:
                    words[index] = how_written(policy, index, reading.layers)
        beside = [layer._replace(overlay="may_hold") for extra in possible.values() for layer in extra]
        found = (*beside, *layers, needs)
        unread = tuple(code for layer in (*found, *topic_layers) for code in layer.unread)
        return intern(pack, (*values, *words), (*participant.surroundings.unread, *unread)), found

    def _own_layers(
        self, endpoint: Endpoint, identifier: str, participant: ResolvedParticipant, user: User, owner: str
    ) -> list[Layer]:
        """What is stated for an endpoint, the strongest first: an overlay, its own settings, profiles, the base preset."""
        pack = participant.pack
        dialect = pack.dialects.get(endpoint.dialect, pack.dialects.get("yaml"))
        overlay, overlay_unread = self.reader.recognise(
            pack, (ENDPOINT,), endpoint.overlay, dialect, f"overlay of {owner}", endpoint.role, [identifier]
        )
        explicit, unread = self.reader.recognise(
            pack, (ENDPOINT,), endpoint.settings, dialect, owner, endpoint.role, [identifier]
        )
        type_index = pack.find(ENDPOINT, "type")
        if endpoint.type is not None and type_index is not None:
            explicit.setdefault(type_index, Stated(endpoint.type, Setting(endpoint.type, endpoint.place)))
        layers = [
            Layer("overlay", overlay, here=True, unread=overlay_unread),
            Layer("explicit", explicit, here=True, unread=unread),
            *(self.profiles.layers(endpoint.profiles, pack, user, participant) if endpoint.profiles else ()),
        ]
        if pack.base_preset is not None and not endpoint.observed:
            layers.append(base_layer(pack, pack.base_preset))
        return layers

    def _needs(self, endpoint: Endpoint, pack: RulePack, owner: str, identifier: str) -> Layer:
        """What the application of an endpoint needs, as far as the pack gives such guarantees."""
        if not pack.needs:
            self.reader.remarks += len(endpoint.needs)
            return Layer("explicit", {})
        found, unread = self.reader.recognise(
            pack, (NEED,), endpoint.needs, None, f"`needs` of {owner}", endpoint.role, [identifier]
        )
        for index, stated in found.items():
            word = next((name for name, (at, _) in pack.needs.items() if at == index), None)
            if word is not None and word not in pack.guaranteed:
                message = f"{owner} needs {word}, and {pack.title} says nothing about it: it was not compared"
                self.reader.say("CQ211", message, stated.setting.place, endpoint.role, [identifier])
        return Layer("explicit", found, unread=unread)

    def _unstated(
        self, index: int, reading: ValueSource, participant: ResolvedParticipant, endpoint: Endpoint
    ) -> Value:
        """The value of a policy that is not stated for an endpoint: the same for all endpoints of like participants."""
        known = participant.surroundings.unstated
        key = (index, endpoint.role, endpoint.observed, endpoint.dialect)
        if key not in known:
            known[key] = self.reader.value(participant.pack, index, reading)
        return known[key]


def resolve(
    system: System, find_pack: Callable[[str], RulePack | None], default_protocol: str | None = None
) -> ResolvedSystem:
    """Resolve every endpoint of ``system``; ``default_protocol`` is that of endpoints for which it states none."""
    return Resolver(system, find_pack, default_protocol).run()
