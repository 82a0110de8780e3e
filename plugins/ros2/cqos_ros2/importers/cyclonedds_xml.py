"""Reads configurations of Cyclone DDS, which ``CYCLONEDDS_URI`` names: the lease of the participants of nodes."""

from __future__ import annotations

import re
from dataclasses import replace
from typing import TYPE_CHECKING, Final

from cqos_core.importers.source_reading import listed, shown
from cqos_core.importers.xml_source import elements, local, parse_xml, text_of
from cqos_core.model.settings import Setting
from cqos_core.model.system import Overlay
from cqos_core.packs.xml_importer import XmlImporter
from cqos_ros2.importers.codes import CODES
from cqos_ros2.importers.unmodelled_elements import CYCLONE, lay_over_nodes
from cqos_ros2.policies import PARTICIPANT_LEASE

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
    return _File(source, context).read(parse_xml(source))


class _File(XmlImporter):
    """Reads one file; Cyclone DDS compares the names of elements without regard to case."""

    protocol = "ros2"
    codes = {info.code: info for info in CODES}  # noqa: RUF012 - a table

    def read(self, root: Element) -> System:
        """Read the lease of each domain."""
        found = [self.domain(domain) for domain in elements(root)]
        stated = [(number, lease) for number, lease in found if lease is not None]
        if stated:
            number, lease = stated[0]
            if len({each and each.text for _, each in found}) > 1 or (len(found) == 1 and number not in _ANY):
                cause = (
                    f"the file sets the participant lease {shown(lease.text)} for domain {shown(number)} only; state "
                    "`participant_lease` at the participants"
                )
                lease = replace(lease, text="", unknown=cause)
            settings = {PARTICIPANT_LEASE.name: lease}
            laid = Overlay("cyclonedds.xml", settings, protocol="ros2", when=("rmw", "cyclonedds"), place=lease.place)
            self.system.overlays.append(laid)
        if self.unread:
            first = min(self.unread.values(), key=lambda place: place.line or 0)
            paths = listed(map(shown, sorted(self.unread)), "and")
            message = f"parts of the configuration of Cyclone DDS that are not read: {paths}"
            deciding = [
                (path, self.place(element), effect)
                for domain in elements(root)
                for path, element, effect in CYCLONE.undecided(domain, "")
            ]
            self.note("ROS965", message, first, unread=lay_over_nodes(self.system, deciding, "cyclonedds"))
        return self.finish()

    def domain(self, domain: Element) -> tuple[str, Setting | None]:
        """Return the number of a domain, and the lease of its participants."""
        number = next((value for name, value in domain.attrib.items() if name.lower() == "id"), "")
        lease: Setting | None = None
        for section in elements(domain):
            if local(section).lower() == "id":
                number = text_of(section)
                continue
            inner = elements(section) if local(section).lower() == "discovery" else []
            for element in inner:
                if local(element).lower() == "leaseduration":
                    lease = self.lease(element)
                else:
                    self.unread.setdefault(f"Discovery/{local(element)}", self.place(element))
            if local(section).lower() != "discovery":
                self.unread.setdefault(f"{local(domain)}/{local(section)}", self.place(section))
        return number.strip().lower(), lease

    def lease(self, element: Element) -> Setting | None:
        """Return the lease that an element states."""
        written, place = text_of(element), self.place(element)
        if "$" in written:
            return Setting(written, place, unknown=f"{shown(written)} is a variable")
        if written.lower() in {"inf", "infinity"}:
            return Setting("infinite", place)
        known = _DURATION.fullmatch(written)
        if known is None:
            message = f"`Discovery/LeaseDuration`: {shown(written)} is no duration"
            self.problem("CQ011", message, element, "expected a number with a unit, such as 10 s, or inf")
            return None
        return Setting(f"{known[1]}{_UNITS.get(known[2].lower(), known[2].lower())}", place)
