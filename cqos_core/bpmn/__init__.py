"""Reads BPMN 2.0 collaborations: signal events are endpoints, signals are topics, pools are participants.

What is read, in which dialects, and the extension words of C-QoS's own are described in ``docs/bpmn.md``.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from cqos_core.bpmn.document import Document, require_bpmn
from cqos_core.bpmn.endpoints import Endpoints
from cqos_core.bpmn.event_kinds import EventPlaces
from cqos_core.bpmn.events import read_events
from cqos_core.bpmn.flow import read_flow
from cqos_core.bpmn.messages import read_messages
from cqos_core.bpmn.parser_target import DiagramTarget
from cqos_core.bpmn.participants import read_participants
from cqos_core.bpmn.qos_namespace import read_system_words
from cqos_core.bpmn.reading import DiagramReading
from cqos_core.bpmn.signals import read_signals, unclear_signals
from cqos_core.bpmn.unread import report_unread
from cqos_core.importers.source_reading import read_switches
from cqos_core.importers.xml_source import StartTags, parse_into, plain_utf8
from cqos_core.model.garbage_collection import gc_paused

if TYPE_CHECKING:
    from collections.abc import Collection

    from cqos_core.model.source import ReadContext, Source
    from cqos_core.model.system import System

SWITCHES = {"message_flows": ("true", "false"), "lines": ("false", "true")}
"""The importer's switches and their values; the last one is the default."""


def read(source: Source, context: ReadContext) -> System:
    """Return what the BPMN model in ``source`` states; its `System.notes` say what could not be used.

    Endpoint and participant ids are the ids of the BPMN elements. An event with several signals, or an id that is
    used twice, gives ``id#2``, ``id#3``; a process that several participants share gives ``id@participant`` for the
    second and every further one.

    Args:
        source: the file.
        context: its options may hold ``{"bpmn": {"message_flows": "true"}}`` to read message flows as topics too, and
            ``"lines": "false"`` for places without lines where they name an element.

    Raises:
        InputError: if this is no XML or no BPMN 2.0, or has more shared processes than a system may hold. What is
            incomplete or makes no sense in C-QoS's own words is a note of severity error, and the rest is read.
    """
    switches = read_switches("bpmn", context, SWITCHES)
    with_messages, lines = switches.get("message_flows") == "true", switches.get("lines") != "false"
    data = plain_utf8(source)
    with gc_paused(len(data) // 32):  # bytes for an object, about
        document = _parsed(source, data, whole=with_messages, lines=lines)
        if unclear := unclear_signals(document):
            document = _parsed(source, data, unclear, whole=with_messages, lines=lines)
        return _read(source, document, with_messages=with_messages, lines=lines)


def _parsed(source: Source, data: bytes, unclear: Collection[str] = (), *, whole: bool, lines: bool) -> Document:
    tags = StartTags(data)

    def begin() -> DiagramTarget:
        return DiagramTarget(EventPlaces(source.name, tags if lines else None), unclear, whole=whole)

    parts = parse_into(source, data, begin).parts()
    require_bpmn(parts.root, source, tags)
    return Document(parts, source.name, tags, lines=lines)


def _read(source: Source, document: Document, *, with_messages: bool, lines: bool) -> System:
    reading = DiagramReading(document)
    # Columns are found again in the sources; where no lines are wanted, they are not either.
    reading.system.sources[source.name] = source.data if lines else b""
    read_system_words(reading)
    pools = read_participants(reading)
    endpoints = Endpoints(reading, pools)
    read_events(reading, endpoints, read_signals(reading))
    if with_messages:
        read_messages(reading, endpoints)
    read_flow(reading, endpoints, pools)
    report_unread(reading, endpoints, with_messages=with_messages)
    return reading.system
