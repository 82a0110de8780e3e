"""Which of all that is stated holds for an endpoint: its own settings, profiles, overlays, conventions, defaults.

Each endpoint ends as a `QosProfile`, an interned tuple of values that endpoints with equal settings share. Where a
value came from is not stored: `Resolved.origin` finds it again in the layers, for the few values a finding prints.
"""

from __future__ import annotations

from dataclasses import replace
from fnmatch import fnmatchcase
from functools import cache, cached_property, lru_cache
from typing import TYPE_CHECKING, Any

from cqos_core.language.policy import ENDPOINT, NEED, Policy
from cqos_core.language.values import Value, normalise
from cqos_core.model.codes import CODES
from cqos_core.model.memory import MAXIMUM_REMEMBERED, MOST_LETTERS, letters, remember
from cqos_core.model.remarks import plural, suggestion
from cqos_core.model.report import Finding, Severity, Side
from cqos_core.model.system import MESSAGE, PUBLISHER, Setting
from cqos_core.packs.pack import Known, NameContext, nothing_follows, nothing_summed
from cqos_core.resolving.overlays import Overlays
from cqos_core.resolving.participants import Participants
from cqos_core.resolving.profiles import Profiles, User, preset_settings
from cqos_core.resolving.reader import SettingsReader, either, how_written
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
    from collections.abc import Callable, Collection, Mapping, Sequence

    from cqos_core.language.values import WrittenValue
    from cqos_core.model.system import Broker, Endpoint, Participant, Place, Settings, System
    from cqos_core.packs.pack import NameProblem, Naming, RulePack


_NAMED: dict[tuple[Any, ...], Naming] = {}


class Resolver:
    """Resolves one system; everything that endpoints can share is resolved once.

    Attributes:
        result: what is resolved so far.
        ids: of the endpoints among it.
        clashes: two endpoints have one id, and got numbers.
        completed: a pack was asked what follows from the whole system.
        asked: by id of a pack, further policies of which somebody asks how they were written.
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
        self.clashes = False
        self.completed = False
        self._chosen: dict[str | None, RulePack | None] = {}
        self._packless: dict[str, list[Endpoint]] = {}
        self._implied: list[Endpoint] = []
        self._facts: dict[int, Settings] = {}
        self._topic_layers: dict[tuple[int, str, str], tuple[tuple[Layer, ...], bool]] = {}
        self._name_problems: dict[tuple[NameProblem, str, str], list[Endpoint]] = {}
        self._shared: dict[tuple[Any, ...], tuple[QosProfile, tuple[Layer, ...]]] = {}
        self._starts = Starts(system)
        self._misread: dict[str, list[str]] = {}
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
        return Overlays(self.system, self.reader)

    def run(self) -> ResolvedSystem:
        """Resolve every endpoint of the system."""
        for endpoint in (*self.system.endpoints, *self._implied):
            self.stated(endpoint)
        for participant in self.system.participants.values():
            # What a participant states is checked even where it has no endpoint.
            pack = self._pack_of(participant.protocol or self.system.protocol or self.default)
            if pack is not None:
                self.participants.resolved(participant, pack)
        for pack in self.result.packs.values():
            if pack.sum_up is not nothing_summed:
                self._sum_up(pack)
        self.report_rest()
        return self.result

    def _sum_up(self, pack: RulePack) -> None:
        """Give endpoints the values that follow from those of all."""
        own = [each for each in self.result.endpoints if each.pack is pack]
        for each in own:
            if each.profile.needs:
                each.participant.requiring.add(each.key)
        layers: dict[tuple[tuple[int, Value], ...], Layer] = {}
        for position, values in pack.sum_up(own).items():
            found = tuple((pack.vocabulary.indices[ENDPOINT, name], value) for name, value in values.items())
            if found not in layers:
                texts = {index: pack.policies[index].format(value) for index, value in found}
                settings = {index: Stated(text, Setting(text, derived=True)) for index, text in texts.items()}
                layers[found] = Layer("settled by all endpoints", settings, counts_as_stated=False)
            endpoint = own[position]
            endpoint.profile = endpoint.profile.with_values(dict(found))
            endpoint.layers = (layers[found], *endpoint.layers)

    def _complete(self) -> None:
        """Ask the packs in use what follows from all that is stated."""
        for protocol in _protocols_in_use(self.system, self.default):
            pack = self._pack_of(protocol)
            if pack is None or (pack.complete is nothing_follows and pack.sum_up is nothing_summed):
                continue
            self.completed = True
            stated = [each for each in self.system.endpoints if self._protocol_of(each) == pack.id]
            owners = {each.participant for each in stated}
            participants = [
                each
                for each in self.system.participants.values()
                if each.id in owners or (each.protocol or self.system.protocol or self.default) == pack.id
            ]
            # What is wrong with the settings is reported when they are resolved with what follows.
            draft = Resolver(self.system, self.find_pack, self.default, self.asked, completed=True)
            completion = pack.complete(
                [draft.known_participant(each, pack) for each in participants],
                [draft.known_endpoint(each, pack) for each in stated],
                {name: draft.known_broker(each, pack) for name, each in self.participants.brokers(pack).items()},
            )
            self.participants.facts.update(completion.participants)
            self._facts.update({id(stated[at]): facts for at, facts in completion.endpoints.items()})
            self._implied += completion.implied

    def known_participant(self, participant: Participant, pack: RulePack) -> Known:
        """Return a participant with its values, read when they are asked for."""

        def read(policy: Policy) -> tuple[Value, Place | None] | None:
            resolved = self.participants.resolved(participant, pack)
            index = pack.vocabulary.indices[policy.level, policy.name]
            stated = next((layer.settings[index] for layer in resolved.layers if index in layer.settings), None)
            return None if stated is None else (resolved.values[index], stated.setting.place)

        place, template = participant.place, participant.template
        return Known(participant.id, read, place=place, template=template, external=participant.external)

    def known_endpoint(self, endpoint: Endpoint, pack: RulePack) -> Known:
        """Return an endpoint with its values, read when they are asked for."""

        @cache
        def resolved() -> Resolved:
            owner = self.participants.resolved(self.system.participants[endpoint.participant], pack)
            return self._resolved(endpoint, owner, endpoint.id, endpoint.id)

        def read(policy: Policy) -> tuple[Value, Place | None] | None:
            index = pack.vocabulary.indices[policy.level, policy.name]
            if resolved().written(index) is None:
                return None
            return resolved().profile.values[index], resolved().origin(index)[1]

        return Known(
            endpoint.id,
            read,
            lambda: resolved().profile.needs,
            endpoint.place,
            endpoint.template,
            endpoint.external,
            endpoint.role,
            endpoint.topic,
            endpoint.participant,
            endpoint.kind,
        )

    def known_broker(self, broker: Broker, pack: RulePack) -> Known:
        """Return a broker with its values, read when they are asked for."""

        def read(policy: Policy) -> tuple[Value, Place | None] | None:
            return self.participants.stated_of_broker(broker, pack, pack.vocabulary.indices["broker", policy.name])

        return Known(broker.id, read, place=broker.place)

    def _protocol_of(self, endpoint: Endpoint) -> str | None:
        owner = self.system.participants[endpoint.participant]
        return endpoint.protocol or owner.protocol or self.system.protocol or self.default

    def stated(self, endpoint: Endpoint) -> None:
        """Resolve one endpoint as it is stated; it may stand for several."""
        participant = self.system.participants[endpoint.participant]
        protocol = self._protocol_of(endpoint)
        facts = self._facts.get(id(endpoint))
        if endpoint.needs and endpoint.role == PUBLISHER and endpoint.kind == MESSAGE:
            message = f"publisher `{endpoint.id}` states `needs`, which only a subscriber has"
            place = next(iter(endpoint.needs.values())).place or endpoint.place
            self.reader.say("CQ210", message, place, PUBLISHER, [endpoint.id])
            endpoint = replace(endpoint, needs={})
        if facts:
            endpoint = replace(endpoint, settings={**endpoint.settings, **facts})
        pack = self._pack_of(protocol)
        if pack is None:
            self._packless.setdefault(protocol or "", []).append(endpoint)
            return
        owner = self.participants.resolved(participant, pack)
        for expanded in pack.meeting.expand(endpoint):
            self.result.endpoints.append(self._resolved(expanded, owner, self._unique(expanded.id), endpoint.id))

    def report_rest(self) -> None:
        """Report what was read but is judged by nobody."""
        self._report_packless()
        self._report_names()
        self._report_needs()
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

    def _report_names(self) -> None:
        """Report what is wrong with names, each once with all endpoints that use it."""
        for (problem, shown, pack_id), endpoints in self._name_problems.items():
            rule = self.result.packs[pack_id].rule(problem.code)
            core = CODES.get(problem.code)
            first = min(endpoints, key=lambda endpoint: endpoint.id)
            finding = Finding(
                code=problem.code,
                name=rule.name if rule else core.name if core else problem.code.lower(),
                severity=Severity(problem.severity),
                message=problem.message,
                source=pack_id,
                topic=shown,
                sides=(Side(first.role, tuple(sorted(endpoint.id for endpoint in endpoints)), place=first.place),),
                because=rule.because if rule else "",
                clause=rule.clause if rule else "",
                help=problem.help or None,
            )
            self.result.findings.append(finding)

    def _report_packless(self) -> None:
        for protocol, endpoints in self._packless.items():
            endpoints.sort(key=lambda endpoint: endpoint.id)
            ids = [endpoint.id for endpoint in endpoints]
            message = (
                f"no installed pack judges protocol `{protocol}`: {plural(len(ids), 'endpoint')} left out"
                if protocol
                else f"no protocol is stated for {plural(len(ids), 'endpoint')}, so nothing judges them"
            )
            help_text = (
                f"{suggestion(protocol, self.known)}; `cqos packs` lists them"
                if protocol
                else "state `protocol:` in the file, or give --protocol ID"
            )
            self.reader.say("CQ201", message, endpoints[0].place, "endpoint", ids, help_text)

    def _report_needs(self) -> None:
        packs = {each.stated_id: each.pack for each in self.result.endpoints}
        needing = sorted(
            (
                each
                for each in self.system.endpoints
                if each.needs and each.role != PUBLISHER and each.id in packs and not packs[each.id].needs
            ),
            key=lambda each: each.id,
        )
        if needing:
            message = f"no installed pack judges `needs`: those of {plural(len(needing), 'endpoint')} were read but not compared"
            place = next(iter(needing[0].needs.values())).place
            self.reader.say("CQ211", message, place, "subscriber", [endpoint.id for endpoint in needing])

    # Topics

    def _name(self, endpoint: Endpoint, participant: ResolvedParticipant) -> Naming | None:
        if endpoint.topic is None:
            return None
        pack, owner = participant.pack, participant.participant
        key = (
            *(pack, participant.surroundings, owner.id, owner.label, tuple(owner.remap.items())),
            *(endpoint.topic, endpoint.kind, endpoint.dialect, endpoint.role),
        )
        naming = _NAMED.get(key)
        if naming is None:
            context = NameContext(
                owner.id,
                owner.label,
                participant.texts,
                owner.remap,
                endpoint.kind,
                endpoint.dialect,
                endpoint.role,
            )
            naming = pack.meeting.resolve(endpoint.topic, context)
            remember(_NAMED, key, naming)
        for problem in naming.problems:
            self._name_problems.setdefault((problem, naming.shown, pack.id), []).append(endpoint)
        return naming

    def _topic(self, written: str, naming: Naming, pack: RulePack) -> tuple[tuple[Layer, ...], bool]:
        """Topic-level layers, nearest first, and whether the topic is external."""
        key = (id(pack), naming.key or "", written)
        found = self._topic_layers.get(key)
        if found is not None:
            return found
        layers: list[Layer] = []
        conventions = _conventions if letters(naming.key) <= MOST_LETTERS else _conventions.__wrapped__
        conventional, external = conventions(pack, naming.key)
        for name in dict.fromkeys((written, naming.shown, naming.key)) if self.system.topics else ():
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
        written = endpoint.topic or ""
        topic_layers, topic_external = self._topic(written, naming, pack) if naming is not None else ((), False)
        overlays = tuple(self.overlays.covering(endpoint, naming, participant)) if self.system.overlays else ()
        profile, layers = self._profile_of(endpoint, participant, naming, topic_layers, overlays, identifier)
        if misread := self._misread.get(stated_id):
            # What the reader of its file reports as wrong may have set anything.
            profile = profile.with_values({}, beside=misread)
        if naming is not None and (wrong := [each.code for each in naming.problems if each.severity == "error"]):
            profile = profile.with_values({}, refused=wrong)
        return Resolved(
            endpoint,
            identifier,
            stated_id,
            pack,
            naming.key if naming is not None else None,
            naming.shown if naming is not None else "",
            profile,
            layers,
            participant,
            endpoint.external or owner.external or topic_external,
            starts_after=self._starts.before((*endpoint.starts_after, *owner.starts_after)),
        )

    def _profile_of(
        self,
        endpoint: Endpoint,
        participant: ResolvedParticipant,
        naming: Naming | None,
        topic_layers: tuple[Layer, ...],
        overlays: tuple[int, ...],
        identifier: str,
    ) -> tuple[QosProfile, tuple[Layer, ...]]:
        """The values of an endpoint and their layers; those of an equal one, if nothing had to be said of it."""
        stated = (
            *(participant.pack, participant.surroundings),
            *(endpoint.role, endpoint.dialect, endpoint.observed, endpoint.type),
            tuple([(name, each.text, each.unknown, each.derived) for name, each in endpoint.settings.items()]),
            tuple([(name, each.text, each.unknown) for name, each in endpoint.overlay.items()]),
            tuple([(layer.counts_as_stated, layer.texts) for layer in topic_layers]),
        )
        by_topic = bool(self.system.profiles) and self.profiles.by_topic
        alone = not (endpoint.profiles or endpoint.needs or overlays or self.asked or by_topic)
        if alone:
            # Nothing of it stands elsewhere in its system, so it has the values of an equal one in any other.
            read = READ.get(stated)
            if read is not None:
                return read[0], read[1] + topic_layers
        by_topic = by_topic or any(ref.scope.by_topic for ref in endpoint.profiles)
        user = User(endpoint.dialect, endpoint.role, naming.shown if naming is not None and by_topic else "")
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
        self.clashes = self.clashes or identifier in self.ids
        while unique in self.ids:
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
        layers, possible = self.overlays.lay(own, overlays, participant) if overlays else (own, {})
        needs = self._needs(endpoint, pack, owner, identifier)
        values: list[Any] = []
        words: list[WrittenValue | None] = []
        asked = pack.asked | self.asked.get(id(pack), frozenset())
        for index, policy in enumerate(pack.policies):
            words.append(None)
            if policy.level == ENDPOINT:
                if endpoint.role not in policy.roles:
                    self._without_effect(policy, index, written, owner, endpoint, identifier)
                value = self._own_value(index, layers, endpoint, participant, identifier)
                for when, extra in possible.items():
                    if any(index in layer.settings for layer in extra):
                        then = self._own_value(index, [*extra, *layers], endpoint, participant, identifier)
                        value = either(participant, when, then, value)
                values.append(value)
                if index in asked:
                    words[index] = how_written(policy, index, layers)
            elif policy.level == NEED:
                where = endpoint.place
                values.append(
                    self.reader.value(
                        pack, index, policy, endpoint.role, (needs,), {}, None, owner, where, member=identifier
                    )
                )
            elif policy.level == "topic":
                values.append(
                    self.reader.value(
                        pack,
                        index,
                        policy,
                        endpoint.role,
                        topic_layers,
                        participant.values,
                        None,
                        f"topic `{endpoint.topic}`",
                        None,
                    )
                )
                if index in asked:
                    words[index] = how_written(policy, index, topic_layers)
            else:
                values.append(participant.values[index])
        beside = [replace(layer, overlay="may_hold") for extra in possible.values() for layer in extra]
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
            layers.append(_base_layer(pack, pack.base_preset))
        return layers

    def _needs(self, endpoint: Endpoint, pack: RulePack, owner: str, identifier: str) -> Layer:
        """What the application of an endpoint needs, as far as the pack gives such guarantees."""
        if not pack.needs:
            return Layer("explicit", {})
        found, unread = self.reader.recognise(
            pack, (NEED,), endpoint.needs, None, f"`needs` of {owner}", endpoint.role, [identifier]
        )
        for index, stated in found.items():
            word = next((name for name, (at, _) in pack.needs.items() if at == index), None)
            if word is not None and word not in pack.guaranteed:
                message = f"{owner} needs {word}, of which {pack.title} says nothing: it was not compared"
                self.reader.say("CQ211", message, stated.setting.place, endpoint.role, [identifier])
        return Layer("explicit", found, unread=unread)

    def _own_value(
        self,
        index: int,
        layers: Sequence[Layer],
        endpoint: Endpoint,
        participant: ResolvedParticipant,
        identifier: str,
    ) -> Value:
        """Read a value of an endpoint from the nearest of ``layers`` that states it."""
        pack = participant.pack
        return self.reader.value(
            pack,
            index,
            pack.policies[index],
            endpoint.role,
            layers,
            participant.values,
            pack.dialects.get(endpoint.dialect, pack.dialects.get("yaml")),
            f"{endpoint.role} `{identifier}`",
            endpoint.place,
            observed=endpoint.observed,
            member=identifier,
        )

    def _without_effect(
        self, policy: Policy, index: int, explicit: Layer, owner: str, endpoint: Endpoint, identifier: str
    ) -> None:
        stated = explicit.settings.get(index)
        if stated is not None and not stated.setting.unknown:
            roles = " and ".join(policy.roles) or "no endpoint"
            message = f"{owner} states `{policy.name}`, which only a {roles} has"
            self.reader.say("CQ210", message, stated.setting.place, endpoint.role, [identifier])


class Starts:
    """The order of start that a system states of some of its participants and endpoints."""

    def __init__(self, system: System) -> None:
        """Note what each of them states."""
        self._system = system
        self._stated: dict[str, list[str]] | None = None
        self._known: dict[tuple[str, ...], frozenset[str]] = {}

    def before(self, names: tuple[str, ...]) -> frozenset[str]:
        """Return all that is up before whatever starts after ``names``: these, and what they start after."""
        if not names:
            return frozenset()
        if names not in self._known:
            stated, found, left = self._by_name(), set[str](), [*names]
            while left:
                name = left.pop()
                if name not in found:
                    found.add(name)
                    left += stated.get(name, ())
            self._known[names] = frozenset(found)
        return self._known[names]

    def _by_name(self) -> dict[str, list[str]]:
        """What each participant and endpoint starts after; of a participant that is up, all endpoints are."""
        if self._stated is None:
            participants = self._system.participants
            self._stated = {name: [*each.starts_after] for name, each in participants.items()}
            for each in self._system.endpoints:
                own = participants[each.participant].starts_after
                self._stated[each.participant] += each.starts_after
                self._stated.setdefault(each.id, []).extend((*each.starts_after, *own))
        return self._stated


@cache
def _base_layer(pack: RulePack, preset: str) -> Layer:
    """What endpoints take their values from that say nothing."""
    return Layer(f"preset {preset}", preset_settings(preset, pack), counts_as_stated=False, assumed=True)


@lru_cache(maxsize=MAXIMUM_REMEMBERED)
def _conventions(pack: RulePack, key: str | None) -> tuple[tuple[Layer, ...], bool]:
    """What a pack's conventions say of a topic, and whether by them its partners may be elsewhere."""
    layers = []
    external = False
    for convention in pack.conventions:
        if key is not None and fnmatchcase(key, convention.pattern):
            settings = {
                pack.vocabulary.indices["topic", name]: Stated(text, Setting(text))
                for name, text in convention.settings.items()
            }
            layers.append(Layer(f"convention of {convention.pattern}", settings, counts_as_stated=False))
            external = external or convention.external
    return tuple(layers), external


def choose_variant(pack: RulePack, options: Settings) -> RulePack:
    """Return the variant of ``pack`` that the system's options ask for, or the pack itself."""
    for (option, value), variant in pack.variants.items():
        setting = options.get(option)
        if setting is not None and normalise(setting.text) == value:
            return variant
    return pack


def packs_in_use(
    system: System, find_pack: Callable[[str], RulePack | None], default_protocol: str | None
) -> list[RulePack]:
    """The packs that judge what the system states, by id."""
    found = map(find_pack, _protocols_in_use(system, default_protocol))
    return [choose_variant(pack, system.options.get(pack.id, {})) for pack in found if pack is not None]


def _protocols_in_use(system: System, default: str | None) -> list[str]:
    stated = {each.protocol for each in system.participants.values()}
    stated |= {each.protocol for each in system.endpoints if each.protocol}
    return sorted(filter(None, {protocol or system.protocol or default for protocol in stated}))


def resolve(
    system: System, find_pack: Callable[[str], RulePack | None], default_protocol: str | None = None
) -> ResolvedSystem:
    """Resolve every endpoint of ``system``.

    Args:
        system: as an importer made it.
        find_pack: returns the installed pack of an id, or None.
        default_protocol: judges endpoints for which the system states none.

    Returns:
        The endpoints with values, and findings for unknown settings, values that are none, and the like.
    """
    return Resolver(system, find_pack, default_protocol).run()
