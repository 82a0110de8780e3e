"""Participants in the eyes of packs: options, connections and the brokers that they connect to."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Any

from cqos_core.language.values import Anything, OneOf, normalise
from cqos_core.model.caches import MOST_LETTERS, keep, letters
from cqos_core.model.endpoint_rows import kinds_of
from cqos_core.model.finding import Severity
from cqos_core.model.problems import InvalidValueError
from cqos_core.model.settings import Setting
from cqos_core.model.suggestions import listed, suggestion
from cqos_core.model.system import PUBLISHER, Broker, ProfileRef
from cqos_core.resolving.layers import Layer
from cqos_core.resolving.parts import Surroundings
from cqos_core.resolving.profiles import no_profile, preset_settings
from cqos_core.resolving.reader import ValueSource, Whose, depends
from cqos_core.resolving.resolved_endpoint import ResolvedParticipant
from cqos_core.resolving.unknown_names import every_policy

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Mapping, Sequence
    from typing import Final

    from cqos_core.language.policy import Policy
    from cqos_core.language.values import Value
    from cqos_core.model.settings import Place, Settings
    from cqos_core.model.system import Overlay, Participant, System
    from cqos_core.packs.pack import RulePack
    from cqos_core.resolving.layers import Stated
    from cqos_core.resolving.reader import SettingsReader

_SURROUNDINGS: dict[tuple[Any, ...], Surroundings] = {}
_UNGROUPED: Final = "write `publishes:` and `subscribes:` at the participant itself"
_NOTHING_STATED: Final = Layer("explicit", {})


class Participants:
    """The participants of one system in the eyes of packs, each resolved once.

    Attributes:
        facts: what follows for a participant from the whole system, by its id.
    """

    def __init__(
        self, system: System, reader: SettingsReader, known: dict[tuple[str, int], ResolvedParticipant]
    ) -> None:
        """Read ``system`` with ``reader``, and put resolved participants into ``known``."""
        self._system = system
        self._reader = reader
        self._known = known
        self.facts: dict[str, Settings] = {}
        self._option_layers: dict[int, Layer] = {}
        self._participant_overlays: dict[int, Sequence[Overlay]] = {}
        self._own_surroundings: dict[tuple[Any, ...], Surroundings] = {}
        self._layers_of_brokers: dict[tuple[int, str], tuple[Layer, ...]] = {}
        self._brokerless: dict[str, dict[str, Participant]] = {}

    def resolved(self, participant: Participant, pack: RulePack) -> ResolvedParticipant:
        """Return a participant in the eyes of a pack."""
        key = (participant.id, id(pack))
        found = self._known.get(key)
        if found is None:
            found = self._known[key] = self._resolve(participant, pack)
        return found

    def _resolve(self, participant: Participant, pack: RulePack) -> ResolvedParticipant:
        owner = f"participant `{participant.label or participant.id}`"
        settings = participant.settings
        if facts := self.facts.get(participant.id):
            settings = {**settings, **facts}
        stated = _NOTHING_STATED
        if settings:
            levels, spoken = ("participant", "option"), pack.dialects.get("yaml")
            own, unread = self._reader.recognise(
                Whose(pack, levels, spoken, owner, "participant", [participant.id]), settings
            )
            stated = Layer("explicit", own, unread=unread)
        if foreign := {word: place for word, place in participant.groups.items() if word not in pack.groups}:
            for word, place in foreign.items():
                message = f"{owner} states `{word}`, which {pack.title} does not know: it has no groups of endpoints"
                self._reader.say("CQ202", message, place, "participant", [participant.id], _UNGROUPED)
            stated = stated._replace(unread=(*stated.unread, "CQ202"))
        layers: tuple[Layer, ...] = (stated, self._options(pack))
        broker = self._broker_of(stated.settings, participant, pack) if self._system.brokers else None
        key = (pack, broker and broker.id, *[(layer.texts, layer.unread) for layer in layers])
        memory = _SURROUNDINGS if broker is None else self._own_surroundings
        shared = memory.get(key)
        if shared is None:
            before = self._reader.remarks
            shared = self._surroundings(participant, pack, layers, owner, broker)
            if self._reader.remarks == before and letters(key) <= MOST_LETTERS:
                shared = keep(memory, key, replace(shared, is_of_any_system=broker is None))
        if broker is not None:
            layers += self._broker_layers(broker, pack)
        found = ResolvedParticipant(participant, pack, shared, layers, broker)
        overlays = self._overlays_of_participants(pack) if self._system.overlays else ()
        if overlays:
            from cqos_core.resolving.overlays import laid_on_participant

            found = laid_on_participant(found, overlays, self._reader)
        return found

    def _overlays_of_participants(self, pack: RulePack) -> Sequence[Overlay]:
        """Return the overlays that set something of participants, in the eyes of a pack."""
        found = self._participant_overlays.get(id(pack))
        if found is None:
            from cqos_core.resolving.overlays import is_of_participants

            found = self._participant_overlays[id(pack)] = [
                each for each in self._system.overlays if any(is_of_participants(name, pack) for name in each.settings)
            ]
        return found

    def _options(self, pack: RulePack) -> Layer:
        """The system's options for a pack."""
        layer = self._option_layers.get(id(pack))
        if layer is None:
            stated = self._system.options.get(pack.id, {})
            owner = f"options of `{pack.id}`"
            found, unread = self._reader.recognise(Whose(pack, ("option",), None, owner, "system", []), stated)
            layer = self._option_layers[id(pack)] = Layer("option", found, unread=unread)
        return layer

    def _surroundings(
        self, participant: Participant, pack: RulePack, layers: Sequence[Layer], owner: str, broker: Broker | None
    ) -> Surroundings:
        values: dict[int, Value] = {}
        for index, policy in enumerate(pack.policies):
            if policy.level == "option":
                values[index] = self._option(pack, index, policy, layers, participant)
        for index, policy in enumerate(pack.policies):
            if policy.level == "participant":
                reading = ValueSource(PUBLISHER, layers, values, None, owner, participant.place)
                values[index] = self._reader.value(pack, index, reading)
        values |= self._broker_values(pack, broker, values)
        texts = {
            pack.policies[index].name: stated.text
            for layer in reversed(layers)
            for index, stated in layer.settings.items()
            if not stated.setting.unknown
        }
        every = (*layers, *self._broker_layers(broker, pack))
        return Surroundings(values, texts, tuple(code for layer in every for code in layer.unread))

    def _option(
        self, pack: RulePack, index: int, policy: Policy, layers: Sequence[Layer], participant: Participant
    ) -> Value:
        for layer in layers:
            stated = layer.settings.get(index)
            if stated is None:
                continue
            if stated.setting.unknown:
                return self._reader.not_known(
                    pack, policy, stated, ValueSource(PUBLISHER, layers, {}, None, f"option `{policy.name}`")
                )
            meaning = policy.words.get(normalise(stated.text))
            if isinstance(meaning, OneOf):
                return depends(pack, policy, meaning.values)
            try:
                return policy.domain.parse(stated.text)
            except InvalidValueError as problem:
                place = stated.setting.place or participant.place
                if policy.fallback is not None:
                    message = f"option `{policy.name}`: {problem.message}; `{policy.fallback}` stands in"
                    self._reader.say_once("CQ208", message, place, problem.advice())
                    return policy.domain.parse(policy.fallback)
                self._reader.say_once("CQ203", f"option `{policy.name}`: {problem.message}", place, problem.advice())
                return Anything(f"option {policy.name} has no valid value", "CQ203")
        if isinstance(policy.default, str):
            return policy.domain.parse(policy.default)
        names = policy.assume or tuple(policy.domain.format(value) for value in policy.domain.candidates())
        if not policy.assume:
            return Anything(f"option {policy.name} is not set")
        return depends(pack, policy, names)

    def _broker_values(self, pack: RulePack, broker: Broker | None, options: Mapping[int, Value]) -> dict[int, Value]:
        layers = self._broker_layers(broker, pack)
        owner, place = ("broker", None) if broker is None else (f"broker `{broker.id}`", broker.place)
        reading = ValueSource(PUBLISHER, layers, options, None, owner, place)
        return {
            index: self._reader.value(pack, index, reading)
            for index, policy in enumerate(pack.policies)
            if policy.level == "broker"
        }

    def stated_of_broker(self, broker: Broker, pack: RulePack, index: int) -> tuple[Value, Place | None] | None:
        """Return the value of a policy of a broker and its place; None where nothing states it."""
        layers = self._broker_layers(broker, pack)
        stated = next((layer.settings[index] for layer in layers if index in layer.settings), None)
        if stated is None:
            return None
        reading = ValueSource(PUBLISHER, layers, {}, None, f"broker `{broker.id}`", broker.place)
        return self._reader.value(pack, index, reading), stated.setting.place

    def _broker_layers(self, broker: Broker | None, pack: RulePack) -> tuple[Layer, ...]:
        """Return the layers of a broker, nearest first: itself, then its profiles and presets."""
        if broker is None:
            return ()
        known = self._layers_of_brokers.get((id(pack), broker.id))
        if known is None:
            owner = f"broker `{broker.id}`"
            own, unread = self._reader.recognise(
                Whose(pack, ("broker",), None, owner, "broker", [broker.id]), broker.settings
            )
            refs = broker.profiles or tuple(ProfileRef(name, broker.place) for name in pack.presets_at(broker.id))
            known = (Layer("explicit", own, unread=unread), *self._profiles_of_broker(refs, pack, {broker.id}))
            self._layers_of_brokers[id(pack), broker.id] = known
        return known

    def _profiles_of_broker(self, refs: Sequence[ProfileRef], pack: RulePack, trail: set[str]) -> Iterator[Layer]:
        for ref in reversed(refs):
            own = self._system.profiles.get(ref.name)
            preset = pack.preset_names.get(normalise(ref.name))
            if own is not None and own.name not in trail:
                owner = f"profile `{own.name}`"
                found, unread = self._reader.recognise(
                    Whose(pack, ("broker",), None, owner, "profile", [own.name]), own.settings
                )
                yield Layer(f"profile {own.name}", found, unread=unread)
                yield from self._profiles_of_broker(own.base, pack, {*trail, own.name})
            elif own is None and preset is not None and pack.presets[preset].level == "broker":
                yield Layer(f"preset {preset}", preset_settings(preset, pack), counts_as_stated=False)
            elif own is None:
                known = (
                    *self._system.profiles,
                    *(name for name, each in pack.presets.items() if each.level == "broker"),
                )
                message = f"profile `{ref.name}` is neither defined nor a preset of a broker of {pack.title}"
                self._reader.say_once("CQ204", message, ref.place, suggestion(ref.name, known))
                yield no_profile(ref, pack, "broker")

    def brokers(self, pack: RulePack) -> dict[str, Broker]:
        """Return the brokers of a pack's protocol, by id."""
        default = self._system.protocol or pack.id
        return {name: each for name, each in self._system.brokers.items() if (each.protocol or default) == pack.id}

    def _broker_of(self, own: Mapping[int, Stated], participant: Participant, pack: RulePack) -> Broker | None:
        """The broker that a participant names, else the only one there is."""
        brokers = self.brokers(pack)
        index = next((i for level in ("participant", "option") if (i := pack.find(level, "broker")) is not None), None)
        if index is None or not brokers:
            return None
        stated = own.get(index) or self._options(pack).settings.get(index)
        if stated is not None and stated.setting.unknown:
            return self._undescribed("", stated.setting, pack, stated.code)
        if stated is not None:
            if stated.text not in brokers:
                message = f"there is no broker `{stated.text}` in the system"
                place = stated.setting.place or participant.place
                self._reader.say_once("CQ216", message, place, suggestion(stated.text, brokers))
                unknown = Setting("", place, f"broker `{stated.text}` is not described")
                return self._undescribed(stated.text, unknown, pack, "CQ216")
            return brokers[stated.text]
        if len(brokers) > 1:
            self._brokerless.setdefault(pack.id, {})[participant.id] = participant
            unknown = Setting("", None, "which of several brokers it connects to is not stated")
            return self._undescribed("", unknown, pack, "CQ216")
        return next(iter(brokers.values()))

    def _undescribed(self, name: str, unknown: Setting, pack: RulePack, code: str) -> Broker:
        """Return a broker with all values unknown, for the cause that the finding ``code`` reports."""
        unread = (code,) if code else ()
        nothing = Layer("explicit", every_policy(pack, ("broker",), unknown, code), unread=unread)
        self._layers_of_brokers[id(pack), name] = (nothing,)
        return Broker(name, pack.id)

    def report(self) -> None:
        """Report participants with an unknown broker."""
        for _, participants in sorted(self._brokerless.items()):
            ids = sorted(participants)
            more = f" and {len(ids) - 1} more" if len(ids) > 1 else ""
            verb = "do" if more else "does"
            message = f"`{ids[0]}`{more} {verb} not say which of several brokers {'they connect' if more else 'it connects'} to"
            advice = f"state `broker:` with one of {listed(sorted(self._system.brokers))}"
            self._reader.say("CQ216", message, participants[ids[0]].place, "participant", ids, advice, Severity.WARNING)


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
    """Return the packs that judge a system, sorted by id."""
    found = map(find_pack, protocols_in_use(system, default_protocol))
    return [choose_variant(pack, system.options.get(pack.id, {})) for pack in found if pack is not None]


def protocols_in_use(system: System, default: str | None) -> list[str]:
    """Return the protocols of all participants, brokers and overlays of a system."""
    stated = {each.protocol for each in system.participants.values()}
    stated |= {each.protocol for each in kinds_of(system.endpoints) if each.protocol}
    return sorted(filter(None, {protocol or system.protocol or default for protocol in stated}))
