"""The lease of participants, as XML files of implementations state it."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final, NamedTuple

from cqos_core.importers.xml_source import children
from cqos_core.model.problems import InvalidValueError
from cqos_core.model.settings import Setting
from cqos_core.model.system import Overlay
from cqos_dds.importers.xml_values import PROTOCOL, not_set
from cqos_dds.policies import PARTICIPANT_LEASE

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence

    from cqos_core.importers.xml_source import Element
    from cqos_dds.importers.xml_values import XmlReading

FAST: Final = ("rtps", "builtin", "discovery_config", "leaseDuration")
CONNEXT: Final = ("discovery_config", "participant_liveliness_lease_duration")
LEASE: Final = PARTICIPANT_LEASE.name


class ParticipantProfile(NamedTuple):
    """A profile of participants.

    Attributes:
        is_default: participants that name no profile take it.
        lease: None where it states none.
    """

    name: str
    is_default: bool
    lease: Setting | None


def lease_in(element: Element, path: Sequence[str], reading: XmlReading) -> Setting | None:
    """Return the lease at a path below the QoS of a participant, None where there is none."""
    inner = [element]
    for tag in path:
        inner = [child for each in inner for child in children(each, tag)]
    if not inner:
        return None
    whole = "".join(inner[-1].itertext()).strip()
    place = reading.place(inner[-1])
    if cause := not_set(whole):
        return Setting(whole, place, unknown=cause)
    try:
        written = reading.duration(inner[-1], "/".join(path))
        return None if written is None else Setting(_shown(written), place)
    except InvalidValueError as error:
        reading.problem("CQ011", f"`{'/'.join(path)}`: {error.message}", inner[-1], f"expected {error.expected}")
        return None


def lay_leases(profiles: Iterable[ParticipantProfile], implementations: Sequence[str], reading: XmlReading) -> None:
    """Lay the lease of the default profile over participants; where another profile differs, the lease is not known."""
    found = [*profiles]
    default = next((each.lease for each in found if each.is_default), None)
    differing = [
        (each.name, each.lease)
        for each in found
        if not each.is_default and each.lease is not None and (default is None or each.lease.text != default.text)
    ]
    setting = default
    for name, lease in differing[:1]:
        cause = (
            f"the participant profile `{name}` sets the lease to {lease.text or 'what is not known'}, and which participants use it "
            "is not known; state `participant_lease` at the participants"
        )
        setting = Setting("", lease.place, unknown=cause)
    if setting is None:
        return
    for implementation in implementations:
        name = "participant profiles of the XML file"
        when = ("implementation", implementation)
        laid = Overlay(name, {LEASE: setting}, protocol=PROTOCOL, when=when, place=setting.place)
        reading.system.overlays.append(laid)


def _shown(written: str) -> str:
    return PARTICIPANT_LEASE.domain.format(PARTICIPANT_LEASE.domain.parse(written))
