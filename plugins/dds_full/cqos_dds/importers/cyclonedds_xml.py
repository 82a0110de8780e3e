"""Reads configurations of Cyclone DDS, which ``CYCLONEDDS_URI`` names: the lease of participants."""

from __future__ import annotations

import re
from dataclasses import replace
from typing import TYPE_CHECKING, Final

from cqos_core.importers.source_reading import shown
from cqos_core.importers.xml_source import elements, local, parse_xml, text_of
from cqos_core.model.settings import Setting
from cqos_core.model.system import Overlay
from cqos_dds.implementations import CYCLONE_DDS
from cqos_dds.importers.leases import LEASE
from cqos_dds.importers.unmodelled_elements import CYCLONE, lay_over_participants
from cqos_dds.importers.xml_values import MOST_TAGS, PROTOCOL, XmlReading, expand, not_set

if TYPE_CHECKING:
    from cqos_core.importers.xml_source import Element
    from cqos_core.model.source import ReadContext, Source
    from cqos_core.model.system import System

_DURATION: Final = re.compile(r"([0-9]+(?:\.[0-9]+)?)\s*(ns|us|ms|s|min|hr|day)", re.IGNORECASE)
_UNITS: Final = {"hr": "h", "day": "d"}
_ANY: Final = frozenset(("", "any", "*", "default"))


def read(source: Source, context: ReadContext) -> System:
    """Read the lease of participants, which holds with Cyclone DDS.

    Raises:
        InputError: it is no XML, or a lease that Cyclone DDS refuses.
    """
    root = parse_xml(source, MOST_TAGS)
    expand(root, context)
    return _File(source, context).read(root)


class _File(XmlReading):
    """Reads one file; Cyclone DDS compares the names of elements without regard to case."""

    def read(self, root: Element) -> System:
        """Read the lease of each domain."""
        found: list[tuple[str, Setting | None]] = []
        for domain in elements(root):
            number = next((value.strip() for name, value in domain.attrib.items() if name.lower() == "id"), "")
            lease: Setting | None = None
            for section in elements(domain):
                if local(section).lower() == "id":
                    number = text_of(section)
                elif local(section).lower() == "discovery":
                    lease = self.discovery(section) or lease
                else:
                    self.pass_over(section, f"{local(domain)}/{local(section)}")
            found.append((number.lower(), lease))
        stated = [(number, lease) for number, lease in found if lease is not None]
        if stated:
            number, lease = stated[0]
            if len({each and each.text for _, each in found}) > 1 or (len(found) == 1 and number not in _ANY):
                cause = (
                    f"the file sets the participant lease {shown(lease.text)} for domain {shown(number)} only; state "
                    "`participant_lease` at the participants"
                )
                lease = replace(lease, text="", unknown=cause)
            for each in CYCLONE_DDS:
                when = ("implementation", each)
                laid = Overlay("cyclonedds.xml", {LEASE: lease}, protocol=PROTOCOL, when=when, place=lease.place)
                self.system.overlays.append(laid)
        deciding = [each for domain in elements(root) for each in CYCLONE.undecided(domain, "")]
        self.parts += lay_over_participants(self.system, self.placed(deciding), CYCLONE_DDS)
        return self.finish()

    def discovery(self, section: Element) -> Setting | None:
        """Return the lease that a section states."""
        lease = None
        for element in elements(section):
            if local(element).lower() != "leaseduration":
                self.pass_over(element, f"Discovery/{local(element)}")
                continue
            written = text_of(element)
            known = _DURATION.fullmatch(written)
            if cause := not_set(written):
                lease = Setting(written, self.place(element), unknown=cause)
            elif written.lower() in {"inf", "infinity"}:
                lease = Setting("infinite", self.place(element))
            elif known is None:
                message = f"`Discovery/LeaseDuration`: {shown(written)} is no duration"
                self.problem("CQ011", message, element, "expected a number with a unit, such as 10 s, or inf")
            else:
                lease = Setting(f"{known[1]}{_UNITS.get(known[2].lower(), known[2].lower())}", self.place(element))
        return lease
