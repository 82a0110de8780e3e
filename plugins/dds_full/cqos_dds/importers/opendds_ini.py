"""Reads configurations of OpenDDS (``-DCPSConfigFile``): the lease of participants.

Static endpoints, and settings that may keep participants apart, are named as parts that are not read. Settings that may prevent a match
leave it unknown.
"""

from __future__ import annotations

import re
from typing import TYPE_CHECKING, Final

from cqos_core.importers.source_reading import listed, shown
from cqos_core.model.encoding import decode
from cqos_core.model.settings import Place, Setting
from cqos_core.model.system import Overlay, Part
from cqos_core.packs.file_importer import FileImporter
from cqos_dds.importers.codes import CODES
from cqos_dds.importers.leases import LEASE
from cqos_dds.importers.unmodelled_elements import OPENDDS, lay_over_participants

if TYPE_CHECKING:
    from cqos_core.model.source import ReadContext, Source
    from cqos_core.model.system import System
    from cqos_core.packs.xml_importer import Placed

_SECTION: Final = re.compile(r"\s*\[(?P<kind>[^\]/@]+)(?P<name>[^\]]*)\]")
_KEY: Final = re.compile(r"\s*(?P<key>[^#;=\s][^=]*?)\s*=\s*(?P<value>.*?)\s*")
_ENDPOINT: Final = "endpoint"
_LEASE: Final = "rtps_discovery/LeaseDuration"
_OPENDDS: Final = "opendds"
_SECONDS: Final = re.compile(r"[0-9]{1,9}")


def read(source: Source, context: ReadContext) -> System:
    """Read the lease of participants, which holds with OpenDDS.

    Raises:
        InputError: the lease is no number of seconds.
    """
    return _File.load(source, context)


class _File(FileImporter):
    """Reads one file."""

    protocol = "dds"
    codes = {info.code: info for info in CODES}  # noqa: RUF012 - a table

    def run(self) -> None:
        """Read the sections of the file."""
        kind = ""
        parts: list[Part] = []
        deciding: list[Placed] = []
        leases: dict[str, Setting] = {}
        for number, line in enumerate(decode(self.source.data).splitlines(), 1):
            place = Place(self.source.name, number)
            if section := _SECTION.fullmatch(line.split("#")[0].rstrip()):
                kind = section["kind"].strip()
                if kind == _ENDPOINT:
                    name = section["name"].strip(" /")
                    parts.append(Part(_ENDPOINT, name, "static endpoints of OpenDDS are not read", place))
            elif (found := _KEY.fullmatch(line)) and kind != _ENDPOINT:
                path = f"{kind}/{found['key']}"
                if path == _LEASE:
                    leases.setdefault(found["value"], self.lease(found["value"], place))
                elif (effect := OPENDDS.find(path, found["value"]) or "match") != "none":
                    deciding.append((path, place, effect))
        self.lay(leases)
        parts += lay_over_participants(self.system, deciding, (_OPENDDS,), kind="setting")
        if parts:
            named = listed([shown(each) for each in dict.fromkeys(part.name for part in parts)], "and")
            message = f"settings of OpenDDS that may keep endpoints apart are not read: {named}"
            self.note("DDS909", message, parts[0].place or Place(self.source.name, 1), unread=parts)

    def lease(self, value: str, place: Place) -> Setting:
        """Return a lease, which is stated in seconds."""
        if not _SECONDS.fullmatch(value):
            self.problem(
                "CQ011", f"`LeaseDuration`: {shown(value)} is no number of seconds", place, "expected a number"
            )
        return Setting(f"{value}s", place)

    def lay(self, leases: dict[str, Setting]) -> None:
        """Lay the lease over participants; of several in one file it is not known which one a domain takes."""
        for setting in [*leases.values()][:1]:
            several = len(leases) > 1
            cause = "the file sets several participant leases; state `participant_lease` at the participants"
            stated = Setting("", setting.place, unknown=cause) if several else setting
            when = ("implementation", _OPENDDS)
            laid = Overlay("configuration of OpenDDS", {LEASE: stated}, protocol="dds", when=when, place=setting.place)
            self.system.overlays.append(laid)
