"""Takes what is plain out of a BPMN document: signals, and events that throw or catch one, in the form that tools write.

Most of a large diagram is signal events that differ in id, name and signal. They are found in one pass over the bytes, and what they
state is read once for all that state the same. The rest of the document is parsed, with a mark in the place of each run of them.
Whatever this form does not surely understand stays in the rest, or the whole document is read as if this module were not there.
"""

from __future__ import annotations

from dataclasses import field
from itertools import chain
from operator import attrgetter
from typing import TYPE_CHECKING, Final

from cqos_core.bpmn.names import fold, is_computed
from cqos_core.model.dataclass import dataclass
from cqos_core.model.regular import re

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Sequence

    from cqos_core.bpmn.plain_endpoints import Model, PlainEndpoint

LEAST: Final = 32_768
"""Bytes of the smallest document for which this is worth while."""
MARK: Final = "cqos-plain"
_LONGEST: Final = 100_000
_MOST_MODELS: Final = 10_000
# No reference and no white space that a parser changes. Possessive throughout: linear on any input.
_VALUE = rb'[^"<&\x00-\x1f]*+'
_OTHERS = rb'(?:[ \t\r\n]++(?!id=|name=|xml)[A-Za-z_][\w.:-]*+="' + _VALUE + rb'")*+'
_FORM = rb"""<(?:
  !--(?:[^-]++|-(?!->))*+ | !\[CDATA\[(?:[^\]]++|\](?!\]>))*+ | \?(?:[^?]++|\?(?!>))*+
| PREFIX(?P<tag>startEvent|intermediateCatchEvent|boundaryEvent|intermediateThrowEvent|endEvent)
  (OTHERS)[ \t\r\n]++(id|name)="(VALUE)"(OTHERS)(?:[ \t\r\n]++(id|name)="(VALUE)"(OTHERS))?+[ \t\r\n]*+(?P<end>>)
  [ \t\r\n]*+
  (?:<PREFIX(?:incoming>[\w.:-]*+</PREFIXincoming|outgoing>[\w.:-]*+</PREFIXoutgoing)[ ]?+>[ \t\r\n]*+)*+
  <PREFIXsignalEventDefinition(?:[ ]id="VALUE")?+[ ]signalRef="(?P<event>[\w.-]++)"(?:[ ]id="VALUE")?+[ ]?+
  (?:/>|></PREFIXsignalEventDefinition>)[ \t\r\n]*+</PREFIX(?P=tag)>
| PREFIXsignal[ ]++(id|name)="(VALUE)"[ ]++(id|name)="(VALUE)"[ ]?+(?P<signal>/>|></PREFIXsignal>)
)"""
_PLAIN_ID = re.compile(rb"[\w.-]+")
_NO_CHARACTERS = (b"\xef\xbf\xbe", b"\xef\xbf\xbf")


class NotPlainError(Exception):
    """The document is not in the plain form, or its plain parts and the rest touch each other: it has to be read as a whole."""


@dataclass(slots=True)
class Plain:
    """What was taken out of a document.

    Attributes:
        rest: the document without it, with a mark for each run of it, and as many lines.
        runs: the events of each run, without participant; the signal's id is their topic. Often empty: signals alone.
        signals: the name of each signal by its id.
        names: of the signals.
    """

    rest: bytes
    runs: list[list[PlainEndpoint]]
    signals: dict[str, str] = field(default_factory=dict)
    names: set[str] = field(default_factory=set)


class Taking:
    """Goes through one document."""

    def __init__(self, data: bytes, prefix: str, start: int, model: Callable[[bytes, bytes], Model | None]) -> None:
        """Take what has the ``prefix`` of BPMN, empty or with its colon, from byte ``start`` on.

        ``model`` returns what an event is like of a tag and with attributes, both as they are written; None where that is not plain.
        """
        form = (
            _FORM.replace(b"OTHERS", _OTHERS).replace(b"VALUE", _VALUE).replace(b"PREFIX", re.escape(prefix.encode()))
        )
        self._form = re.compile(form, re.VERBOSE)
        self._mark = f"<{prefix}{MARK}><{prefix}{MARK}/></{prefix}{MARK}>".encode()
        self._data = data
        self._start = start
        self._model = model

    def plain(self) -> Plain:
        """Return what is plain, and the rest.

        Raises:
            NotPlainError: two signals have one id or one name, or there is what may be taken for a mark.
        """
        if MARK.encode() in self._data or any(each in self._data for each in _NO_CHARACTERS):
            raise NotPlainError
        found = self._taken(None)
        topics = map(attrgetter("topic"), chain.from_iterable(found.runs))
        if not all(map(found.signals.__contains__, topics)):
            found = self._taken(found.signals)
        return found

    def _taken(self, known: dict[str, str] | None) -> Plain:
        """Take signals and events; ``known`` are the signals if they are known: events with others stay in the rest."""
        data, found = self._data, Plain(b"", [])
        models: dict[tuple[bytes, ...], Model | None] = {}
        kept: list[bytes] = []
        run: list[PlainEndpoint] = []
        first = last = 0  # where the run begins and ends
        for match in self._form.finditer(data, self._start):
            kind = match.lastgroup
            if kind is None:
                continue
            start, end = match.span()
            if end - start > _LONGEST:
                continue
            if kind == "signal":
                if not _add_signal(found, match.groups()[-5:-1]):
                    continue
                event = None
            else:
                tag, a, one, name, b, two, other, c, _, signal = match.groups()[:10]
                key = tag, a, b, c
                if len(models) >= _MOST_MODELS:
                    models.clear()
                model = models[key] if key in models else models.setdefault(key, self._model(tag, a + b + (c or b"")))
                topic = signal.decode()
                if model is None or one == two or (known is not None and topic not in known):
                    continue
                if one != b"id":
                    name = other
                if not name:
                    continue
                event = model.another(name.decode(), topic, match.start("end"))
            if data[last:start].strip():
                kept += self._cut(first, last, start)
                run = []
                found.runs.append(run)
                first = start
            last = end
            if event is not None:
                run.append(event)
        kept += self._cut(first, last, len(data))
        found.rest = b"".join(kept)
        return found

    def _cut(self, first: int, last: int, until: int) -> Iterator[bytes]:
        """Yield a mark for the run, its lines, and what follows it."""
        if last:
            yield self._mark + b"\n" * self._data.count(b"\n", first, last)
        yield self._data[last:until]


def _add_signal(found: Plain, parts: Sequence[bytes]) -> bool:
    """Add a signal; say whether it is plain."""
    one, name, two, other = parts
    if one != b"id":
        name, other = other, name
    if one == two or not _PLAIN_ID.fullmatch(name):
        return False
    called = fold(other.decode())
    if not called or is_computed(called):
        return False
    identity = name.decode()
    if identity in found.signals or called in found.names:
        raise NotPlainError
    found.signals[identity] = called
    found.names.add(called)
    return True
