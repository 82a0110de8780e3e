"""Overlays: settings from other files that are laid over those of endpoints."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Final

from cqos_core.language.name_index import NameIndex
from cqos_core.language.policy import ENDPOINT
from cqos_core.language.values import Anything, Depends, is_plain
from cqos_core.model.finding import Severity
from cqos_core.model.problems import InvalidValueError
from cqos_core.model.system import PUBLISHER
from cqos_core.resolving.layers import Layer
from cqos_core.resolving.reader import ValueSource, Whose, either, meant_by_option, word_of

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from cqos_core.language.policy import Policy
    from cqos_core.model.system import Endpoint, Overlay, System
    from cqos_core.packs.pack import RulePack
    from cqos_core.packs.topic_matching import Naming
    from cqos_core.resolving.layers import Stated
    from cqos_core.resolving.reader import SettingsReader
    from cqos_core.resolving.resolved_endpoint import ResolvedParticipant

_OF_PARTICIPANTS: Final = ("participant", "option")


class Overlays:
    """The overlays of one system, identified by their positions.

    Attributes:
        used: those that cover an endpoint.
    """

    def __init__(self, system: System, reader: SettingsReader) -> None:
        """Read the overlays of ``system`` with ``reader``."""
        self._system = system
        self._reader = reader
        self._by_topic = NameIndex((overlay.topic, index) for index, overlay in enumerate(system.overlays))
        self.used: set[int] = set()
        self._of_participants: set[int] = set()
        self._laid: set[int] = set()
        self._layers: dict[tuple[int, int], Layer] = {}
        self._took_effect: set[tuple[int, int]] = set()
        self._gave_way: dict[tuple[int, int], tuple[str, Stated]] = {}

    @property
    def noted(self) -> int:
        """The number of entries for `report`; it grows."""
        of_endpoints = len(self.used) + len(self._of_participants) + len(self._laid)
        return of_endpoints + len(self._took_effect) + len(self._gave_way)

    def covering(self, endpoint: Endpoint, naming: Naming | None, participant: ResolvedParticipant) -> Iterator[int]:
        """Yield the indices of the overlays that cover an endpoint; observed values win over files."""
        pack = participant.pack
        covers = pack.topic_matching.covers
        addresses = (pack.topic_matching.address(endpoint.participant, participant.texts), endpoint.participant)
        topics = (naming.key or naming.shown, naming.shown) if naming is not None else ()
        for index in self._by_topic.matching(*topics):
            overlay = self._system.overlays[index]
            if overlay.settings and all(is_of_participants(name, pack) for name in overlay.settings):
                self._of_participants.add(index)
            elif (
                overlay.protocol in {None, pack.id}
                and overlay.role in {None, endpoint.role}
                and any(covers(overlay.participant, address) for address in addresses)
                and (overlay.entity is None or overlay.entity == endpoint.id)
                and holds(overlay, participant) is not False
            ):
                self.used.add(index)
                if not endpoint.observed or _unseen(self._layer(index, pack), pack).settings:
                    self._laid.add(index)
                    yield index

    def lay(
        self, overlays: Sequence[int], participant: ResolvedParticipant, layers: Sequence[Layer], *, observed: bool
    ) -> tuple[list[Layer], dict[tuple[str, str], list[Layer]]]:
        """Return ``layers`` with the overlays that hold, and those that hold under a value of an option not known."""
        own, *beneath = layers
        pack = participant.pack
        read = ((index, self._system.overlays[index], self._layer(index, pack)) for index in overlays)
        covering = [(index, overlay, _unseen(layer, pack) if observed else layer) for index, overlay, layer in read]
        over = [layer for _, overlay, layer in reversed(covering) if not overlay.fills and holds(overlay, participant)]
        stated = [own, *over, *beneath]
        certain = list(stated)
        possible: dict[tuple[str, str], list[Layer]] = {}
        for index, overlay, found in covering:
            when = None if holds(overlay, participant) else overlay.when or ("", "")
            earlier = [*(possible.get(when, ()) if when else ()), *certain[: len(certain) - len(stated)]]
            layer = self._filling(index, found, stated, earlier, pack) if overlay.fills else found
            if when is not None:
                possible.setdefault(when, []).insert(0, layer)
            elif overlay.fills:
                certain.insert(0, layer)
        return certain, possible

    def _filling(
        self, overlay: int, layer: Layer, stated: Sequence[Layer], earlier: Sequence[Layer], pack: RulePack
    ) -> Layer:
        """Return the settings of an overlay that fill or raise values of ``stated``; it gives way to all others.

        The last of several overlays wins, but a value that any of them would fill takes the place of none of ``earlier`` ones.
        """
        fills = self._system.overlays[overlay].fills
        taken = {}
        for index, setting in layer.settings.items():
            policy = pack.policies[index]
            if word_of(policy, setting.text) in fills and any(index in each.settings for each in earlier):
                continue
            found = next((one.settings[index].text for one in stated if index in one.settings), None)
            if found is None or word_of(policy, found) in fills or _raises(policy, found, setting):
                taken[index] = setting
                self._took_effect.add((overlay, index))
            elif policy.word(found) != policy.word(setting.text):
                self._gave_way.setdefault((overlay, index), (policy.name, setting))
        return layer._replace(settings=taken)

    def _layer(self, index: int, pack: RulePack) -> Layer:
        overlay = self._system.overlays[index]
        layer = self._layers.get((id(pack), index))
        if layer is None:
            dialect = pack.dialects.get(overlay.dialect, pack.dialects.get("yaml"))
            of_endpoints = {name: each for name, each in overlay.settings.items() if not is_of_participants(name, pack)}
            found, unread = self._reader.recognise(
                Whose(pack, (ENDPOINT,), dialect, overlay.name, "system", []), of_endpoints
            )
            layer = self._layers[id(pack), index] = Layer(
                overlay.name, found, overlay="holds", unread=unread, dialect=overlay.dialect, room=overlay.room
            )
        return layer

    def report(self) -> None:
        """Report overlays, and settings of theirs, that are without effect; those that differ in `when` only count as one."""
        siblings: dict[object, list[int]] = {}
        for index, overlay in enumerate(self._system.overlays):
            siblings.setdefault(_target(overlay), []).append(index)
        for group in siblings.values():
            overlay = self._system.overlays[group[0]]
            if not self._of_participants.isdisjoint(group):
                continue
            if self.used.isdisjoint(group):
                covering = _covering([self._system.overlays[index] for index in group])
                message = f"{overlay.name} covers no endpoint: nothing matches {covering}"
                self._reader.say("CQ214", message, overlay.place, "system", (), overlay.advice or None)
            elif self._laid.isdisjoint(group):
                message = (
                    f"{overlay.name} covers only endpoints that were observed, and changes nothing of what was seen"
                )
                self._reader.say("CQ214", message, overlay.place, "system", severity=Severity.NOTE)
        done = {(_target(self._system.overlays[index]), policy) for index, policy in self._took_effect}
        for (index, at), (policy, stated) in self._gave_way.items():
            overlay = self._system.overlays[index]
            if (_target(overlay), at) not in done:
                done.add((_target(overlay), at))
                message = (
                    f"{overlay.name} sets `{policy}` to {stated.text}, but all endpoints that it covers have their own"
                )
                advice = f"state `{overlay.fills[0]}` where it is to decide"
                self._reader.say("CQ215", message, stated.setting.place or overlay.place, "system", (), advice)


def laid_on_participant(
    participant: ResolvedParticipant, overlays: Sequence[Overlay], reader: SettingsReader
) -> ResolvedParticipant:
    """Return a participant with the settings of overlays for participants that nothing else states."""
    pack, owner = participant.pack, participant.participant
    addresses = (pack.topic_matching.address(owner.id, participant.texts), owner.id)
    for overlay in overlays:
        settings = {name: each for name, each in overlay.settings.items() if is_of_participants(name, pack)}
        certain = holds(overlay, participant) if settings and overlay.protocol in {None, pack.id} else False
        if certain is False or not any(pack.topic_matching.covers(overlay.participant, each) for each in addresses):
            continue
        dialect = pack.dialects.get(overlay.dialect, pack.dialects.get("yaml"))
        # The pack knows every name, so no other setting is possible.
        found, _ = reader.recognise(Whose(pack, _OF_PARTICIPANTS, dialect, overlay.name, "system", []), settings)
        left_open = {
            index: stated
            for index, stated in found.items()
            if not any(index in each.settings for each in participant.layers if each.overlay != "may_hold")
        }
        layer = Layer(overlay.name, left_open, overlay="holds" if certain else "may_hold")
        values = dict(participant.values)
        for index, stated in left_open.items():
            whose = f"participant `{owner.label or owner.id}`"
            reading = ValueSource(PUBLISHER, (layer,), values, dialect, whose, owner.place)
            unknown = stated.setting.unknown
            # Without a finding: only a rule that reads the value has to say that it is not known.
            value = Anything(unknown) if isinstance(unknown, str) and unknown else reader.value(pack, index, reading)
            values[index] = (
                value if certain else either(pack, participant.values, overlay.when or ("", ""), value, values[index])
            )
        around = participant.surroundings
        participant = replace(
            participant,
            surroundings=replace(around, values=values, is_of_any_system=False, unstated={}),
            layers=(*participant.layers, layer),
        )
    return participant


def holds(overlay: Overlay, participant: ResolvedParticipant) -> bool | None:
    """Whether the option under which an overlay holds has its value; None where that is not known."""
    if overlay.when is None:
        return True
    option, wanted = overlay.when
    pack = participant.pack
    index = pack.vocabulary.indices.get(("option", option))
    if index is None:
        return False
    value, expected = participant.values[index], meant_by_option(pack.policies[index], wanted)
    if isinstance(value, Depends):
        cases = [case in expected for _, case in value.cases]
        return True if all(cases) else None if any(cases) else False
    return value in expected if is_plain(value) else None


def is_of_participants(name: str, pack: RulePack) -> bool:
    """Whether a setting is one of participants, or an option of theirs, and not of endpoints."""
    return pack.find(ENDPOINT, name) is None and any(pack.find(level, name) is not None for level in _OF_PARTICIPANTS)


def _unseen(layer: Layer, pack: RulePack) -> Layer:
    """Return a layer with only the policies that no running system shows."""
    return layer._replace(
        settings={index: stated for index, stated in layer.settings.items() if pack.policies[index].unseen}
    )


def _raises(policy: Policy, before: str, after: Stated) -> bool:
    """Whether a policy that may be raised becomes larger."""
    if not policy.raised or after.setting.unknown:
        return False
    try:
        return policy.weakens(policy.domain.parse(after.text), policy.domain.parse(before))
    except InvalidValueError:
        return False


def _target(overlay: Overlay) -> object:
    """Return what is the same of an overlay that is stated once and holds under several values of an option."""
    return (
        overlay.name,
        overlay.place,
        overlay.protocol,
        overlay.role,
        overlay.topic,
        overlay.participant,
        overlay.entity,
        *overlay.settings,
    )


def _covering(overlays: Sequence[Overlay]) -> str:
    """Return the target of overlays that differ in `when` only, in words."""
    overlay = overlays[0]
    values: dict[str, list[str]] = {}
    for option, value in (each.when for each in overlays if each.when is not None):
        values.setdefault(option, []).append(value)
    parts = {
        f"participant `{overlay.participant}`": True,
        f"topic `{overlay.topic}`": True,
        f"role {overlay.role}": overlay.role is not None,
        f"entity `{overlay.entity}`": overlay.entity is not None,
        **{f"{option} {' or '.join(dict.fromkeys(each))}": True for option, each in values.items()},
    }
    return ", ".join(part for part, said in parts.items() if said)
