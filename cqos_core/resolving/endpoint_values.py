"""The values of the endpoints of one system: what endpoints have in common is read once, and so is each single setting.

What is to be reported is kept with what was read, and names the endpoint when it is reported.
"""

from __future__ import annotations

from dataclasses import replace
from operator import itemgetter
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, Final, NamedTuple, TypeAlias

from cqos_core.language.policy import ENDPOINT, NEED, TOPIC
from cqos_core.model.caches import LONGEST_REMEMBERED, keep, new_number, number_of, remember
from cqos_core.model.endpoint_rows import FIRST_TEXT, RowEndpoint, as_object
from cqos_core.model.settings import Setting
from cqos_core.resolving.endpoint_remarks import OWN, WHOSE, OwnPlace, with_blanks
from cqos_core.resolving.layers import Layer, Stated
from cqos_core.resolving.parts import READ, Inherited, Laid, OwnSetting, ReadContext
from cqos_core.resolving.profiles import base_layer
from cqos_core.resolving.qos_profile import intern
from cqos_core.resolving.reader import SettingsReader, ValueSource, Whose, either, how_written
from cqos_core.resolving.unknown_names import is_slip

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Mapping, Sequence

    from cqos_core.language.policy import Policy
    from cqos_core.language.values import Value, WrittenValue
    from cqos_core.model.endpoint_rows import Row, SettingsPattern
    from cqos_core.model.settings import Cases, Settings
    from cqos_core.model.system import Endpoint
    from cqos_core.packs.pack import RulePack
    from cqos_core.packs.presets import Dialect
    from cqos_core.resolving.endpoint_remarks import Remark
    from cqos_core.resolving.profiles import Profiles, User
    from cqos_core.resolving.resolved_endpoint import ResolvedParticipant

Item: TypeAlias = "tuple[str, str, str | Cases, bool]"
"""A setting as `Endpoint.setting_texts` has it."""
_NAMES: Final = -1
_SETTINGS: Final[dict[tuple[Any, ...], OwnSetting]] = {}
"""By the number of a context: settings of their own that endpoints have there."""


class _Stack(NamedTuple):
    """All layers of an endpoint, and those over them that may hold, by the value of an option under which they do."""

    layers: Sequence[Layer]
    possible: Mapping[tuple[str, str], Sequence[Layer]] = MappingProxyType({})


_Stating: TypeAlias = "tuple[tuple[OwnSetting, ...], list[tuple[int, dict[str, OwnSetting]]]]"
"""The settings of one of several endpoints that state the same, and where their texts differ what each text is."""


class EndpointValues:
    """Reads what endpoints of one system state.

    Attributes:
        reader: reports what is stated elsewhere in the system.
    """

    def __init__(self, reader: SettingsReader) -> None:
        """Report with ``reader`` what is wrong outside of endpoints."""
        self.reader = reader
        self._kept = SettingsReader([])
        self._memory: dict[tuple[Any, ...], Any] = {}
        self._stating: dict[tuple[Inherited, SettingsPattern], _Stating] = {}
        self._numbers: dict[ReadContext, int] = {}
        self._own: dict[tuple[Any, ...], OwnSetting] = {}

    def _remarks(self) -> tuple[Remark, ...]:
        """Return what was to be reported since this was asked last."""
        return tuple(self._kept.taken()) if self._kept.findings else ()

    # What endpoints inherit

    def inherited(
        self,
        endpoint: Endpoint,
        participant: ResolvedParticipant,
        topic_layers: tuple[Layer, ...],
        asked: frozenset[int],
        profiles: tuple[Profiles, User] | None,
    ) -> Inherited:
        """Return what an endpoint has before its own settings.

        Args:
            endpoint: its own settings do not matter.
            participant: to which it belongs.
            topic_layers: what is stated of its topic.
            asked: policies whose spelling is asked for.
            profiles: those of the system and who takes values from them, where it names any.
        """
        pack, surroundings = participant.pack, participant.surroundings
        context = ReadContext(pack, surroundings, endpoint.role, endpoint.dialect, endpoint.observed, asked)
        of_topic = tuple([(layer.counts_as_stated, layer.texts) for layer in topic_layers])
        key: tuple[Any, ...] = (context, endpoint.type, of_topic, stated(endpoint.overlay), stated(endpoint.needs))
        memory = READ if profiles is None and surroundings.is_of_any_system else self._memory
        if profiles is not None:
            key = (*key, profiles[1], *[(ref.name, ref.scope) for ref in endpoint.profiles])
        found: Inherited | None = memory.get(key)
        if found is None:
            before = self.reader.remarks
            named = (
                () if profiles is None else (*profiles[0].layers(endpoint.profiles, pack, profiles[1], participant),)
            )
            found = self._inherited(context, endpoint, topic_layers, named, memory)
            # What is wrong elsewhere is reported for each endpoint that rests on it.
            if self.reader.remarks == before:
                remember(memory, key, found)
        return found

    def _inherited(
        self,
        context: ReadContext,
        endpoint: Endpoint,
        topic_layers: tuple[Layer, ...],
        profiles: tuple[Layer, ...],
        memory: dict[tuple[Any, ...], Any],
    ) -> Inherited:
        pack, around = context.pack, context.surroundings
        above = self._overlay(context, endpoint)
        own = _type(endpoint, pack)
        below = [*profiles]
        if pack.base_preset is not None and not context.observed:
            below.append(base_layer(pack, pack.base_preset))
        if endpoint.needs and pack.needs:
            below.append(self._needs(context, endpoint))
        remarks = [(_NAMES, remark) for remark in self._remarks()]
        stack = _Stack((above, Layer("explicit", own, here="settings"), *below))
        of_topic = ValueSource(context.role, topic_layers, around.values, None, f"topic `{endpoint.topic}`")
        stated = {index for layer in (*stack.layers, *topic_layers) if not layer.assumed for index in layer.settings}
        values: list[Any] = []
        words: list[WrittenValue | None] = [None] * len(pack.policies)
        for index, policy in enumerate(pack.policies):
            if policy.level not in {ENDPOINT, NEED, TOPIC}:
                values.append(around.values[index])
                continue
            source = of_topic if policy.level == TOPIC else _source(context, policy, stack)
            if index not in stated:
                values.append(self._unstated(context, index, source))
                continue
            if policy.level == TOPIC:
                values.append(self.reader.value(pack, index, source))
            else:
                values.append(self._value(context, index, stack))
                remarks += [(index, remark) for remark in self._remarks()]
            if index in context.asked:
                words[index] = how_written(policy, index, source.layers)
        unread = [code for layer in (*stack.layers, *topic_layers) for code in layer.unread]
        profile = intern(pack, (*values, *words), (*around.unread, *unread))
        size = len(words)
        fixed = frozenset((_NAMES, *own, *above.settings, *(index % size for index in profile.frame.deciding)))
        number = number_of(context) if around.is_of_any_system else self._numbers.setdefault(context, new_number())
        return Inherited(context, number, profile, above, own, tuple(below), fixed, tuple(remarks), memory, size)

    def _overlay(self, context: ReadContext, endpoint: Endpoint) -> Layer:
        """What is laid over an endpoint's own settings beside it."""
        if not endpoint.overlay:
            return _NO_OVERLAY
        whose = _whose(context, (ENDPOINT,), f"overlay of {WHOSE}")
        found, unread = self._kept.recognise(whose, with_blanks(endpoint.overlay, "overlay"))
        return _NO_OVERLAY._replace(settings=found, unread=unread)

    def _needs(self, context: ReadContext, endpoint: Endpoint) -> Layer:
        """What the application of an endpoint needs, as far as the pack gives such guarantees."""
        pack = context.pack
        whose = _whose(context, (NEED,), f"`needs` of {WHOSE}")._replace(dialect=None)
        found, unread = self._kept.recognise(whose, with_blanks(endpoint.needs, "needs"))
        for index, stated in found.items():
            word = next((name for name, (at, _) in pack.needs.items() if at == index), None)
            if word is not None and word not in pack.guaranteed:
                message = f"{WHOSE} needs {word}, and {pack.title} says nothing about it: it was not compared"
                self._kept.say("CQ211", message, stated.setting.place, context.role, [WHOSE])
        return Layer("explicit", found, here="needs", unread=unread)

    def _value(self, context: ReadContext, index: int, stack: _Stack) -> Value:
        """Return the value of a policy of an endpoint, or of its needs."""
        pack, policy = context.pack, context.pack.policies[index]
        if policy.level == ENDPOINT and context.role not in policy.roles:
            own = next((layer for layer in stack.layers if layer.here == "settings"), None)
            stated = None if own is None else own.settings.get(index)
            self._kept.without_effect(policy, stated, WHOSE, context.role, WHOSE)
        source = _source(context, policy, stack)
        value = self._kept.value(pack, index, source)
        for when, over in stack.possible.items():
            if any(index in layer.settings for layer in over):
                there = self._kept.value(pack, index, replace(source, layers=(*over, *stack.layers)))
                value = either(pack, context.surroundings.values, when, there, value)
        return value

    def _unstated(self, context: ReadContext, index: int, source: ValueSource) -> Value:
        """Return the value of a policy that is not stated: the same for all endpoints of like participants."""
        known = context.surroundings.unstated
        key = (index, context.role, context.observed, context.dialect)
        if key not in known:
            known[key] = self._kept.value(context.pack, index, source)
        return known[key]

    # Their own settings

    def own(self, inherited: Inherited, endpoint: Endpoint | Row) -> tuple[tuple[OwnSetting, ...], bool]:
        """Return the settings of an endpoint, and whether what it inherits takes them; see `Inherited.takes`."""
        if type(endpoint) is tuple:
            pattern, texts = endpoint[0].pattern, endpoint[FIRST_TEXT:]
        else:
            found = endpoint.pattern() if isinstance(endpoint, RowEndpoint) else None
            if found is None:
                settings = self.settings(inherited, endpoint.setting_texts()[0], endpoint)  # type: ignore[union-attr]
                return settings, inherited.takes(settings)
            pattern, texts = found
        others = self._stating.get((inherited, pattern))
        if others is None:
            settings = self.settings(inherited, pattern.says(texts)[0], endpoint)
            is_taken = inherited.takes(settings)
            if is_taken:
                stating: _Stating = settings, [(at, {}) for at in pattern.at]
                keep(self._stating, (inherited, pattern), stating)
            return settings, is_taken
        one, known = others
        own, is_taken = [*one], True
        for (at, by_text), text in zip(known, texts):  # noqa: B905 - a pattern has as many texts as places
            setting = by_text.get(text)
            if setting is None:
                name, _, unknown, derived = pattern.setting_texts[0][at]
                (setting,) = self.settings(inherited, [(name, text, unknown, derived)], endpoint)
                if setting.index == one[at].index:
                    keep(by_text, text, setting)
                else:
                    is_taken = False
            own[at] = setting
        return tuple(own), is_taken

    def settings(self, inherited: Inherited, said: Iterable[Item], endpoint: Endpoint | Row) -> tuple[OwnSetting, ...]:
        """Return the settings of an endpoint, each read by itself; ``said`` is what `Endpoint.setting_texts` has of them."""
        number = inherited.number
        return tuple([_SETTINGS.get((number, item)) or self._setting(inherited, item, endpoint) for item in said])

    def _setting(self, inherited: Inherited, item: Item, endpoint: Endpoint | Row) -> OwnSetting:
        name, text, unknown, derived = item
        reported = as_object(endpoint).settings[name].reported if unknown else ""
        key: tuple[Any, ...] = (inherited.number, item, reported)
        found = self._own.get(key)
        if found is not None:
            return found
        context, whose = inherited.context, _whose(inherited.context, (ENDPOINT,), WHOSE)
        setting = Setting(text, OwnPlace("settings", 1, 1, name), unknown, derived, reported)
        recognised = self._kept.name(whose, name, {name: setting})
        misread = (name, *recognised.misread) if recognised.misread else ()
        beside = any(is_slip(context.pack, each, text) for each in misread)
        if beside:
            self._remarks()
            own = as_object(endpoint).settings
            key = (*key, stated(own))
            if (found := self._own.get(key)) is not None:
                return found
            recognised = self._kept.name(whose, name, {**own, name: setting})
        is_short = len(name) + len(text) <= LONGEST_REMEMBERED and not (unknown or beside)
        found = OwnSetting(recognised, self._remarks(), is_of_any_system=is_short)
        if len(recognised.found) == 1:
            ((index, _),) = recognised.found.items()
            explicit = Layer("explicit", recognised.found, here="settings")
            value = self._value(context, index, _Stack((explicit,)))
            word = how_written(context.pack.policies[index], index, (explicit,)) if index in context.asked else None
            found.take(index, value, word, self._remarks())
        return keep(_SETTINGS, key[:2], found) if is_short else keep(self._own, key, found)

    # Both together

    def laid(
        self,
        inherited: Inherited,
        settings: tuple[OwnSetting, ...],
        overlays: tuple[int, ...] = (),
        lay: Callable[[Sequence[Layer]], tuple[list[Layer], dict[tuple[str, str], list[Layer]]]] | None = None,
    ) -> Laid:
        """Return the profile and layers of an endpoint, and what is to be reported of it.

        Args:
            inherited: what it has before its own settings.
            settings: these.
            overlays: numbers of those of the system that cover it.
            lay: lays them over its layers.
        """
        memory = self._memory
        if not overlays and all(each.is_of_any_system for each in settings):
            memory = inherited.memory
        found: Laid | None = memory.get((inherited, overlays, *settings))
        if found is not None:
            return found
        context, size = inherited.context, inherited.size
        whose = _whose(context, (ENDPOINT,), WHOSE)
        own, unread = self._kept.together(whose, [each.recognised for each in settings])
        named = [*(remark for each in settings for remark in each.remarks), *self._remarks()]
        layers = inherited.around({**inherited.own, **own}, unread)
        stack = _Stack(layers) if lay is None else _Stack(*lay(layers))
        over = [layer for layer in stack.layers if layer.overlay != "no"]
        beside = [layer._replace(overlay="may_hold") for may_hold in stack.possible.values() for layer in may_hold]
        changed = {*own, *(index for layer in (*over, *beside) for index in layer.settings)}
        remarks = [each for each in inherited.remarks if each[0] not in changed]
        remarks += [(_NAMES, remark) for remark in named]
        nearest = {} if overlays else _by_policy(settings, own, inherited.above)
        changes: dict[int, Any] = {}
        for index in changed:
            setting = nearest.get(index)
            if setting is not None:
                value, word, said = setting.value, setting.word, setting.on_value
            else:
                value, said = self._value(context, index, stack), self._remarks()
                asked = index in context.asked
                word = how_written(context.pack.policies[index], index, stack.layers) if asked else None
            changes[index], changes[size + index] = value, word
            remarks += [(index, remark) for remark in said]
        codes = (*unread, *(code for layer in (*over, *beside) for code in layer.unread))
        profile = inherited.profile.with_values(changes, codes)
        ordered = tuple([remark for _, remark in sorted(remarks, key=itemgetter(0))])
        found = Laid(profile, (*beside, *stack.layers), ordered)
        keep(memory, (inherited, overlays, *settings), found)
        return found


_NO_OVERLAY: Final = Layer("overlay", {}, here="overlay")


def _by_policy(settings: Iterable[OwnSetting], own: Mapping[int, Stated], above: Layer) -> dict[int, OwnSetting]:
    """Return the settings that state one policy, where they are what the endpoint states of it and nothing wins over that."""
    return {
        index: each
        for each in settings
        if len(each.recognised.found) == 1
        for index, one in each.recognised.found.items()
        if own[index] is one and index not in above.settings
    }


def stated(settings: Settings) -> tuple[object, ...]:
    """Return all that settings say, without their places."""
    return tuple([(name, each.text, each.unknown, each.derived, each.reported) for name, each in settings.items()])


def _type(endpoint: Endpoint, pack: RulePack) -> dict[int, Stated]:
    """The type of an endpoint, as a setting of its own."""
    index = pack.find(ENDPOINT, "type")
    return {} if endpoint.type is None or index is None else {index: Stated(endpoint.type, Setting(endpoint.type, OWN))}


def _whose(context: ReadContext, levels: tuple[str, ...], owner: str) -> Whose:
    return Whose(context.pack, levels, _dialect(context), owner, context.role, [WHOSE])


def _dialect(context: ReadContext) -> Dialect | None:
    dialects = context.pack.dialects
    return dialects.get(context.dialect, dialects.get("yaml"))


def _source(context: ReadContext, policy: Policy, stack: _Stack) -> ValueSource:
    """Return whose value of a policy is read, from what."""
    if policy.level == NEED:
        return ValueSource(context.role, stack.layers, {}, None, WHOSE, OWN, member=WHOSE)
    options, dialect = context.surroundings.values, _dialect(context)
    return ValueSource(context.role, stack.layers, options, dialect, WHOSE, OWN, context.observed, WHOSE)
