"""Reads DDS-XML, the XML of the OMG (1.0), RTI Connext, OpenDDS and Cyclone DDS, into profiles and whole systems.

All of them share the libraries and the words of the policies; what one of them adds is passed over and listed, but for the routing
service of RTI Connext, which becomes a bridge.
"""

from __future__ import annotations

from contextlib import suppress
from typing import TYPE_CHECKING, Final

from cqos_core.importers.source_reading import shown
from cqos_core.importers.xml_source import children, elements, local, parse_xml
from cqos_core.model.garbage_collection import gc_paused
from cqos_core.model.problems import InputError
from cqos_core.model.system import Part
from cqos_dds.importers import fastdds_xml
from cqos_dds.importers.entities import PARTICIPANT_LIBRARIES, Entities
from cqos_dds.importers.qos_libraries import QosLibraries
from cqos_dds.importers.routing_service import RoutingServices
from cqos_dds.importers.xml_values import MOST_TAGS, XmlReading, expand

if TYPE_CHECKING:
    from collections.abc import Callable

    from cqos_core.importers.xml_source import Element
    from cqos_core.model.source import ReadContext, Source
    from cqos_core.model.system import System


def read(source: Source, context: ReadContext) -> System:
    """Read QoS libraries as profiles, and participants, if there are any, as a system that uses them.

    Raises:
        InputError: it is no XML, no DDS-XML, or has values that are none; with every problem found.
    """
    with gc_paused():
        root = parse_xml(source, MOST_TAGS)
        if local(root) == "dds" and children(root, "profiles") and not children(root, *_LIBRARIES):
            # Types before the profiles may fill all that is looked at to recognise the format.
            return fastdds_xml.read(source, context)
        expand(root, context)
        return _File(XmlReading(source, context), _beside(source, context)).read(root)


def _beside(own: Source, context: ReadContext) -> Callable[[str], list[Entities]]:
    """Return what says which of the files beside ``own`` hold a word, and what these define."""
    known: dict[str, Entities] = context.group.known

    def defined(source: Source) -> Entities:
        if source.name not in known:
            file = _File(XmlReading(source, context))
            known[source.name] = file.entities
            with suppress(InputError):  # its own reading reports that
                root = parse_xml(source, MOST_TAGS)
                expand(root, context)
                file.define(root)
        return known[source.name]

    def beside(word: str) -> list[Entities]:
        return [defined(each) for each in context.group.sources if word.encode() in each.data and each.name != own.name]

    return beside


class _File:
    """Reads one file."""

    def __init__(self, reading: XmlReading, beside: Callable[[str], list[Entities]] = lambda _: []) -> None:
        self.reading = reading
        self.qos = QosLibraries(reading)
        self.entities = Entities(reading, self.qos, beside)
        self.routing = RoutingServices(reading, self.entities)

    def read(self, root: Element) -> System:
        """Read all libraries, and then make what they define: names may be used before they are defined."""
        self.define(root)
        self.qos.make()
        self.entities.make()
        self.routing.make()
        self.qos.leave_participants_open(self.entities.defines_profile)
        return self.reading.finish()

    def define(self, root: Element) -> None:
        """Read all libraries."""
        if local(root) in _LIBRARIES:
            self.library(root)
        elif local(root) == "dds":
            for element in elements(root):
                self.library(element)
        else:
            message = f"this is no DDS-XML: its first element is {shown(local(root))}"
            self.reading.problem("CQ001", message, root, "expected `dds`, or one of its libraries")

    def library(self, element: Element) -> None:
        """Read one library."""
        read = _READERS.get(local(element))
        if read is None:
            self.reading.pass_over(element, local(element))
            if local(element) not in _HARMLESS:
                cause = _SERVICES.get(local(element), "C-QoS does not know what it does")
                part = Part("section", local(element), cause, self.reading.place(element), 1)
                self.reading.parts.append(part)
        else:
            read(self, element)


_READERS: Final[dict[str, Callable[[_File, Element], None]]] = {
    "qos_library": lambda file, element: file.qos.library(element),
    "qos_profile": lambda file, element: file.qos.profile(element),
    "domain_library": lambda file, element: file.entities.define(element, "domain", file.entities.domains),
    **dict.fromkeys(
        PARTICIPANT_LIBRARIES,
        lambda file, element: file.entities.define(element, "domain_participant", file.entities.participants),
    ),
    "application_library": lambda file, element: file.entities.application_library(element),
    "types": lambda file, element: file.entities.types(element),
    "routing_service": lambda file, element: file.entities.services.append(element),
}
_LIBRARIES: Final = tuple(kind for kind in _READERS if kind != "types")
_HARMLESS: Final = frozenset(("adapter_library", "plugin_library", "transformation_library"))
"""Plug-ins; what uses them is named where it stands."""
_SERVICES: Final = {
    "web_integration_service": "what it writes and reads for its clients is not read",
    "persistence_service": "what it keeps for late readers is not read; state `durability_service_runs`",
    "recording_service": "what it reads, or replays, is not read",
    "replay_service": "what it replays is not read",
    "queuing_service": "its queues are not read",
    "cloud_discovery_service": "which participants find each other through it is not read",
    "database_integration_service": "what it writes and reads is not read",
}
"""Services that are programs of their own, with the cause in the coverage."""
