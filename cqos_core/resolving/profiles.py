"""Profiles and presets: layers of settings that endpoints take by name."""

from __future__ import annotations

from dataclasses import replace
from functools import cache, lru_cache
from typing import TYPE_CHECKING, Final, NamedTuple

from cqos_core.language.name_index import NameIndex
from cqos_core.language.policy import ENDPOINT
from cqos_core.language.values import normalise
from cqos_core.model.caches import MAXIMUM_REMEMBERED
from cqos_core.model.regular_expressions import re, regular_expression
from cqos_core.model.settings import Setting
from cqos_core.model.suggestions import suggestion
from cqos_core.resolving.layers import Layer, Stated
from cqos_core.resolving.reader import Whose
from cqos_core.resolving.unknown_names import every_policy

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping, Sequence

    from cqos_core.model.encoding import Lines
    from cqos_core.model.settings import Place
    from cqos_core.model.spelling import KnownNames
    from cqos_core.model.system import Profile, ProfileRef, Scope, System
    from cqos_core.packs.pack import RulePack
    from cqos_core.packs.presets import Convention, Preset
    from cqos_core.resolving.reader import SettingsReader
    from cqos_core.resolving.resolved_endpoint import ResolvedParticipant


_SEVERAL: Final = 2
_NEAR: Final = 20
"""Lines above a setting in which its topic is looked for."""
_ANCHOR: Final = regular_expression(r"(?<!\S)&(\w+)(?!\S)")
_ENTRY: Final = regular_expression(r"(?P<indent>\s*)(?P<name>[^\s:{},]+):\s*(?:#.*)?")
_NO_PROFILE: Final = ("CQ204",)
_IN_A_CIRCLE: Final = Layer("circle", {}, unread=("CQ212",))


def _in_notation(advice: str, place: Place | None) -> str:
    """Return advice as the file writes it in which it is to be followed."""
    from cqos_core.importers.advice_notation import advice_for

    return advice if place is None else advice_for(advice, place.source)


class User(NamedTuple):
    """The endpoint that takes values from profiles; ``topic`` is empty if the names of topics do not matter."""

    dialect: str
    role: str
    topic: str


class Profiles:
    """The profiles of one system and the presets of packs.

    Attributes:
        by_topic: the settings that an endpoint takes from a profile may depend on the name of the topic.
    """

    def __init__(self, system: System, reader: SettingsReader) -> None:
        """Read what ``system`` names with ``reader``."""
        self._system = system
        self._reader = reader
        self._layers: dict[tuple[int, User, str, Scope], tuple[tuple[Layer, ProfileRef | None], ...]] = {}
        self._names: dict[int, KnownNames] = {}
        self._lines: dict[str, Lines] = {}
        self._anchors: dict[str, dict[str, int]] = {}
        self._own_layers: dict[tuple[int, str, str], Layer] = {}
        self.by_topic = any(ref.scope.by_topic for profile in system.profiles.values() for ref in profile.base)

    def layers(
        self, refs: Sequence[ProfileRef], pack: RulePack, user: User, participant: ResolvedParticipant
    ) -> Iterator[Layer]:
        """Layers of the profiles that ``refs`` name, nearest first."""
        for ref in reversed(refs):
            for layer, preset in self._profile(ref, pack, user):
                # Findings about a profile that is read once are reported at each use.
                if preset is not None and not self._is_available(
                    ref if ref.name == preset.name else preset, pack, participant
                ):
                    yield layer._replace(unread=("CQ207",))
                else:
                    yield layer

    def _profile(self, ref: ProfileRef, pack: RulePack, user: User) -> tuple[tuple[Layer, ProfileRef | None], ...]:
        """The layers of a profile and of all it is based on, nearest first, each once; presets with where they are named."""
        key = (id(pack), user, ref.name, ref.scope)
        known = self._layers.get(key)
        if known is not None:
            return known
        found: dict[tuple[str, str | None], tuple[Layer, ProfileRef | None]] = {}
        trail: dict[str, None] = {}
        waiting: list[tuple[Iterator[ProfileRef], str | None]] = [(iter((ref,)), None)]
        while waiting:
            refs, part = waiting[-1]
            each = next(refs, None)
            if each is None:
                waiting.pop()
                if trail:
                    trail.popitem()
            elif not each.scope.covers(user.role, user.topic, part):
                continue
            elif each.name in trail:
                names = list(trail)
                self._report_circle(names[names.index(each.name) :])
                found["", None] = (_IN_A_CIRCLE, None)
            elif (each.name, part := part or each.scope.part) not in found:
                own = self._system.profiles.get(each.name)
                layer = self._preset(each, pack) if own is None else self._own_layer(own, pack, user.dialect)
                found[each.name, part] = (layer, each if own is None and not layer.unread else None)
                trail[each.name] = None
                waiting.append((iter(() if own is None else own.base[::-1]), part))
        if not any(layer.unread == _NO_PROFILE for layer, _ in found.values()):
            # Each place that uses an unknown profile is reported.
            self._layers[key] = tuple(found.values())
        return tuple(found.values())

    def _report_circle(self, names: Sequence[str]) -> None:
        """Print a circle of profiles, always from the first of its names on."""
        start = names.index(min(names))
        circle = [*names[start:], *names[:start], names[start]]
        base = self._system.profiles[circle[0]].base
        place = next(ref.place for ref in base if ref.name == circle[1])
        self._reader.say_once("CQ212", f"profiles are based on each other in a circle: {' → '.join(circle)}", place)

    def _own_layer(self, own: Profile, pack: RulePack, dialect_name: str) -> Layer:
        key = (id(pack), dialect_name, own.name)
        layer = self._own_layers.get(key)
        if layer is None:
            dialect = pack.dialects.get(dialect_name, pack.dialects.get("yaml"))
            owner = f"profile `{own.name}`"
            found, unread = self._reader.recognise(
                Whose(pack, (ENDPOINT,), dialect, owner, "profile", [own.name]), own.settings
            )
            preset_name = pack.preset_names.get(normalise(own.name))
            if preset_name is not None:
                self._shadowing(own.name, preset_name, found, pack, own.place)
            layer = self._own_layers[key] = Layer(
                f"profile {own.name}", found, unread=unread, dialect=dialect_name, room=own.room
            )
        return layer

    def _shadowing(
        self, name: str, preset_name: str, found: Mapping[int, Stated], pack: RulePack, place: Place | None
    ) -> None:
        preset = pack.presets[preset_name].settings
        differing = [
            pack.policies[index].name
            for index, stated in found.items()
            if normalise(stated.text) != normalise(preset.get(pack.policies[index].name, stated.text))
        ]
        if differing:
            message = (
                f"profile `{name}` has the name of a {pack.title} preset but other values of {', '.join(differing)}"
            )
            self._reader.say_once("CQ206", message, place, "")

    def _settings_of(self, name: str, pack: RulePack) -> str:
        """Return the settings that a name was meant for that is no profile: a call in a program, or a value alone."""
        from cqos_core.resolving.common_mistakes import (
            meant_instead,
            preset_within,
            settings_of_assignments,
            settings_of_call,
            settings_of_values,
        )

        return (
            meant_instead(pack, name)
            or preset_within(pack, name)
            or settings_of_call(pack, name)
            or settings_of_assignments(pack, name)
            or ("" if self._known(pack).nearest(name) else settings_of_values(pack, [name]))
        )

    def _lines_of(self, ref: ProfileRef) -> Lines | None:
        """Return the lines of the file in which a name stands."""
        from cqos_core.model.encoding import Lines, decode

        if ref.place is None or (data := self._system.sources.get(ref.place.source)) is None:
            return None
        lines = self._lines.get(ref.place.source)
        if lines is None:
            lines = self._lines[ref.place.source] = Lines(decode(data))
        return lines

    def _setting_as_topic(self, ref: ProfileRef, pack: RulePack) -> tuple[str, str] | None:
        """Return message and advice where a name is the value of a setting that stands beside its topic rather than below it."""
        place, lines = ref.place, self._lines_of(ref)
        if place is None or place.line is None or place.column is None or lines is None:
            return None
        found = _ENTRY.fullmatch(lines.line(place.line)[: place.column - 1])
        if found is None or pack.find(ENDPOINT, found["name"]) is None:
            return None
        entry = f"{found['name']}: {ref.name}"
        above = (_ENTRY.fullmatch(lines.line(each)) for each in range(place.line - 1, max(0, place.line - _NEAR), -1))
        beside = (each for each in above if each is not None and each["indent"] == found["indent"])
        topic = next((each["name"] for each in beside if pack.find(ENDPOINT, each["name"]) is None), None)
        message = f"`{found['name']}` stands where a topic stands, so `{ref.name}` is taken for a profile"
        below = f"below `{topic}`, {len(found['indent']) + 2} blanks before it" if topic else "below its topic"
        return message, f"write it {below}: `{entry}`"

    def _name_of_an_anchor(self, ref: ProfileRef) -> str:
        """Say how the value is taken that an anchor of this name stands for; empty where no anchor before has it."""
        place, lines = ref.place, self._lines_of(ref)
        if place is None or place.line is None or place.column is None or lines is None or not ref.name.isidentifier():
            return ""
        anchors = self._anchors.get(place.source)
        if anchors is None:
            # Of two anchors of one name the first is kept.
            found = [(each[1], each.start()) for each in _ANCHOR.finditer(lines.text)]
            anchors = self._anchors[place.source] = dict(reversed(found))
        if anchors.get(ref.name, len(lines.text)) >= (lines.start(place.line) or 0):
            return ""
        merged = re.search(r"\bprofile\s*:\s*$", lines.line(place.line)[: place.column - 1])
        return f"write `{'<<: ' if merged else ''}*{ref.name}`: `&{ref.name}` is an anchor, not a profile"

    def _values_in_a_list(self, ref: ProfileRef, pack: RulePack) -> tuple[str, Place, str] | None:
        """Return message, place and advice where a name stands in a list, on one line, of which each part is a value of a policy."""
        from cqos_core.resolving.common_mistakes import settings_of_values

        place, lines = ref.place, self._lines_of(ref)
        if place is None or place.line is None or place.column is None or lines is None:
            return None
        line = lines.line(place.line)
        start, end = line.rfind("[", 0, place.column), line.find("]", place.column - 1)
        parts = [part.strip().strip("'\"") for part in line[start + 1 : end].split(",")] if 0 <= start < end else []
        if len(parts) < _SEVERAL or ref.name not in parts:
            return None
        settings = settings_of_values(pack, parts)
        message = f"`{line[start : end + 1]}` is a list of values, and each is taken for the profile of an endpoint of its own"
        return (
            (
                message,
                replace(place, column=start + 1),
                _in_notation(f"write the names of the settings: `{settings}`", place),
            )
            if settings
            else None
        )

    def _preset(self, ref: ProfileRef, pack: RulePack) -> Layer:
        name = pack.preset_names.get(normalise(ref.name))
        if name is None or pack.presets[name].level != ENDPOINT:
            message = f"profile `{ref.name}` is neither defined nor a preset of {pack.title}"
            if values := self._values_in_a_list(ref, pack):
                self._reader.say_once("CQ204", *values)
                return no_profile(ref, pack, ENDPOINT)
            if said := self._setting_as_topic(ref, pack):
                self._reader.say_once("CQ204", said[0], ref.place, said[1])
                return no_profile(ref, pack, ENDPOINT)
            if advice := self._name_of_an_anchor(ref):
                self._reader.say_once("CQ204", message, ref.place, advice)
                return no_profile(ref, pack, ENDPOINT)
            if settings := self._settings_of(ref.name, pack):
                message = f"`{ref.name}` is no profile"
                advice = _in_notation(f"write its settings: `{settings}`", ref.place)
                self._reader.say_once("CQ204", message, ref.place, advice)
                return no_profile(ref, pack, ENDPOINT)
            # A text at an endpoint is a profile, at a topic it is a type.
            meant = f"a type is written `{{type: {ref.name}}}`; " if "/" in ref.name and "(" not in ref.name else ""
            if ref.name.endswith(")"):
                meant = "write what the call sets as a map, `{SETTING: VALUE}`; "
            first = ref.name.split(" ")[0]
            if first != ref.name and (normalise(first) in pack.preset_names or first in self._system.profiles):
                meant = f"did you mean `{first}`? a text goes on in the next line, and `{ref.name}` is one; "
            known = self._known(pack)
            if not meant and not known.nearest(ref.name) and (within := _name_within(ref.name, pack)):
                meant = f"did you mean `{within}`? "
            self._reader.say_once("CQ204", message, ref.place, meant + suggestion(ref.name, known))
            return no_profile(ref, pack, ENDPOINT)
        return Layer(f"preset {name}", preset_settings(name, pack), counts_as_stated=False)

    def _known(self, pack: RulePack) -> KnownNames:
        """The names that an endpoint may use."""
        known = self._names.get(id(pack))
        if known is None:
            from cqos_core.model.spelling import KnownNames

            parts = {each.name for own in self._system.profiles.values() for each in own.base if each.scope.part}
            presets = (name for name, each in pack.presets.items() if each.level == ENDPOINT)
            known = self._names[id(pack)] = KnownNames((*self._system.profiles.keys() - parts, *presets))
        return known

    def _is_available(self, ref: ProfileRef, pack: RulePack, participant: ResolvedParticipant) -> bool:
        name = pack.preset_names[normalise(ref.name)]
        available = _available(pack.presets[name], pack, participant)
        if not available:
            option, least = pack.presets[name].needs or ("", "")
            actual = participant.texts.get(option, "")
            message = f"preset `{name}` exists from {option} {least} on, this participant has {option} {actual}"
            self._reader.say_once("CQ207", message, ref.place)
        return available


def _name_within(text: str, pack: RulePack) -> str:
    """Return the only preset of several words that is a part of a name, ``sensor_data_qos_profile``; else nothing."""
    written = f"_{normalise(text)}_"
    found = [name for name in pack.presets if "_" in name and f"_{normalise(name)}_" in written]
    return found[0] if len(found) == 1 else ""


def _available(preset: Preset, pack: RulePack, participant: ResolvedParticipant) -> bool:
    if preset.needs is None:
        return True
    option, least = preset.needs
    index = pack.vocabulary.indices["option", option]
    value = participant.values[index]
    return not isinstance(value, int) or value >= pack.policies[index].domain.parse(least)  # type: ignore[operator]


def preset_settings(name: str, pack: RulePack) -> dict[int, Stated]:
    """Return what a preset of a pack sets, by policy index."""
    return {
        pack.vocabulary.indices[pack.presets[name].level, policy]: Stated(text, Setting(text))
        for policy, text in pack.presets[name].settings.items()
    }


def no_profile(ref: ProfileRef, pack: RulePack, level: str) -> Layer:
    """Return the layer of a name that is no profile: every policy that nearer layers do not state is unknown."""
    unknown = Setting("", ref.place, f"profile `{ref.name}` is not defined")
    return Layer(f"profile {ref.name}", every_policy(pack, (level,), unknown, "CQ204"), unread=_NO_PROFILE)


@cache
def base_layer(pack: RulePack, preset: str) -> Layer:
    """Return the layer of a pack's base preset, for endpoints that state nothing."""
    return Layer(f"preset {preset}", preset_settings(preset, pack), counts_as_stated=False, assumed=True)


@cache
def conventional(pack: RulePack) -> NameIndex[Convention]:
    """The conventions of a pack by the patterns of their topics."""
    return NameIndex((convention.pattern, convention) for convention in pack.conventions)


@lru_cache(maxsize=MAXIMUM_REMEMBERED)
def conventions(pack: RulePack, key: str | None) -> tuple[tuple[Layer, ...], bool]:
    """Return the layers of a pack's conventions for a topic, and whether its partners may be elsewhere by convention."""
    layers = []
    external = False
    for convention in conventional(pack).matching(key) if key is not None else ():
        settings = {
            pack.vocabulary.indices["topic", name]: Stated(text, Setting(text))
            for name, text in convention.settings.items()
        }
        layers.append(Layer(f"convention of {convention.pattern}", settings, counts_as_stated=False))
        external = external or convention.external
    return tuple(layers), external
