"""Takes what is plain out of a BPMN document: signals, and events that throw or catch one, in the form that tools write.

Most of a large diagram is signal events that differ in id, name and signal. They are found in one pass over the bytes, and what they
state is read once for all that state the same. The rest of the document is parsed, with a mark in the place of each run of them.
Whatever this form does not surely understand stays in the rest, or the whole document is read as if this module were not there.
"""

from __future__ import annotations

from dataclasses import field
from itertools import chain, zip_longest
from typing import TYPE_CHECKING, Any, Final

from cqos_core.bpmn.names import fold, is_computed
from cqos_core.model.dataclass import dataclass
from cqos_core.model.regular import re

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from cqos_core.bpmn.models import Models
    from cqos_core.bpmn.plain_endpoints import Kind
    from cqos_core.model.rows import Row

LEAST: Final = 32_768
"""Bytes of the smallest document for which this is worth while."""
MARK: Final = "cqos-plain"
_LONGEST: Final = 100_000
# No reference and no white space that a parser changes. Possessive throughout: linear on any input.
_VALUE = rb'[^"<&\x00-\x1f]*+'
_OTHERS = rb'(?:[ \t\r\n]++(?!id=|name=|xml)[A-Za-z_][\w.:-]*+="' + _VALUE + rb'")*+'
_FORM = rb"""<(?:
  !--(?:[^-]++|-(?!->))*+ | !\[CDATA\[(?:[^\]]++|\](?!\]>))*+ | \?(?:[^?]++|\?(?!>))*+
| PREFIX(?P<tag>startEvent|intermediateCatchEvent|boundaryEvent|intermediateThrowEvent|endEvent)
  (OTHERS)[ \t\r\n]++(id|name)="(VALUE)"(OTHERS)(?:[ \t\r\n]++(id|name)="(VALUE)"(OTHERS))?+INSIDE
| PREFIXsignal[ ]++(id|name)="(VALUE)"[ ]++(id|name)="(VALUE)"[ ]?+(?P<signal>/>|></PREFIXsignal>)
)"""
_INSIDE = rb"""[ \t\r\n]*+(?P<end>>)[ \t\r\n]*+
  (?:<PREFIX(?:incoming>[\w.:-]*+</PREFIXincoming|outgoing>[\w.:-]*+</PREFIXoutgoing)[ ]?+>[ \t\r\n]*+)*+
  <PREFIXsignalEventDefinition(?:[ ]id="VALUE")?+[ ]signalRef="(?P<event>[\w.-]++)"(?:[ ]id="VALUE")?+[ ]?+
  (?:/>|></PREFIXsignalEventDefinition>)[ \t\r\n]*+</PREFIX(?P=tag)>"""
_MOST_FORMS: Final = 4
"""Kinds of events that are known by a regular expression each, which takes less than a look at every quantity."""
_PLAIN_ID = re.compile(rb"[\w.-]+")
_NO_CHARACTERS = (b"\xef\xbf\xbe", b"\xef\xbf\xbf")


class NotPlainError(Exception):
    """The document is not in the plain form, or its plain parts and the rest touch each other: it has to be read as a whole."""


@dataclass(slots=True)
class Plain:
    """What was taken out of a document.

    Attributes:
        rest: the document without it, with a mark for each run of it, and as many lines.
        runs: the events of each run as rows, of a kind without participant; the signal's id is their topic. Often empty: signals alone.
        signals: the name of each signal by its id.
        names: of the signals.
    """

    rest: bytes
    runs: list[list[Row]]
    signals: dict[str, str] = field(default_factory=dict)
    names: set[str] = field(default_factory=set)


class Taking:
    """Goes through one document."""

    def __init__(self, data: bytes, prefix: str, start: int, models: Models) -> None:
        """Take what has the ``prefix`` of BPMN, empty or with its colon, from byte ``start`` on; ``models`` tells which events are plain."""
        self._prefix = re.escape(prefix.encode())
        self._form = re.compile(self._filled(_FORM), re.VERBOSE)
        self._forms: list[tuple[re.Pattern[bytes], Kind, list[Any]]] = []
        self._mark = f"<{prefix}{MARK}><{prefix}{MARK}/></{prefix}{MARK}>".encode()
        self._data = data
        self._start = start
        self._models = models

    def _filled(self, form: bytes) -> bytes:
        form = form.replace(b"INSIDE", _INSIDE).replace(b"OTHERS", _OTHERS).replace(b"VALUE", _VALUE)
        return form.replace(b"PREFIX", self._prefix)

    def plain(self) -> Plain:
        """Return what is plain, and the rest.

        Raises:
            NotPlainError: two signals have one id or one name, or there is what may be taken for a mark.
        """
        if MARK.encode() in self._data or any(each in self._data for each in _NO_CHARACTERS):
            raise NotPlainError
        found = self._taken(None)
        if any(topic not in found.signals for _, _, topic, *_ in chain.from_iterable(found.runs)):
            found = self._taken(found.signals)
        return found

    def _taken(self, known: dict[str, str] | None) -> Plain:
        """Take signals and events; ``known`` are the signals if they are known: events with others stay in the rest."""
        data, found = self._data, Plain(b"", [])
        kept: list[bytes] = []
        run: list[Row] = []
        first = last = 0  # where the run begins and ends
        for start, end, events in self._parts(found, known):
            if start > last and data[last:start].strip():
                kept += self._cut(first, last, start)
                run = []
                found.runs.append(run)
                first = start
            last = end
            run += events
        kept += self._cut(first, last, len(data))
        found.rest = b"".join(kept)
        return found

    def _parts(self, found: Plain, known: dict[str, str] | None) -> Iterator[tuple[int, int, list[Row]]]:
        """Yield where what is plain begins and ends: signals, which are added to what was found, and events, with their rows."""
        data, at = self._data, self._start
        while True:
            before = -1
            while before != at:
                before, events = at, []
                for form, kind, groups in self._forms:
                    matching = form.match
                    while (match := matching(data, at)) is not None and match.end() - at <= _LONGEST:
                        row = self._row(kind, match, match.group(*groups), known)
                        if row is None:
                            break
                        events.append(row)
                        at = match.end()
                if events:
                    yield before, at, events
            match = self._form.search(data, at)
            if match is None:
                return
            start, at = match.span()
            if at - start > _LONGEST or not match.lastgroup:
                continue
            if match.lastgroup == "signal":
                if _add_signal(found, match.groups()[-5:-1]):
                    yield start, at, []
            elif (event := self._event(match)) is not None and (row := self._row(event[0], match, event[1], known)):
                yield start, at, [row]

    def _row(
        self, kind: Kind, match: re.Match[bytes], texts: Sequence[bytes], known: dict[str, str] | None
    ) -> Row | None:
        """Return the row of an event, of its id, its signal and its quantities; None where it has no id or no signal."""
        name, signal, *quantities = texts
        topic = signal.decode()
        if not name or (known is not None and topic not in known):
            return None
        return kind, name.decode(), topic, match.start("end"), *self._models.texts(quantities)

    def _event(self, match: re.Match[bytes]) -> tuple[Kind, Sequence[bytes]] | None:
        """Return the kind of an event, and its id, its signal and its quantities; None where it is not plain."""
        tag, a, one, name, b, two, other, c, _, signal = match.groups()[:10]
        found = None if one == two else self._models.model(tag, a + b + (c or b""))
        if found is None:
            return None
        kind, quantities = found
        if len(self._forms) < _MOST_FORMS:
            naming = [self._filled(rb'[ \t\r\n]++%b="(?P<%b>VALUE)"' % (each, each)) for each in (one, two) if each]
            between = [self._models.form(each) for each in (a, b, c) if each is not None]
            parts = b"".join(chain.from_iterable(zip_longest(between, naming, fillvalue=b"")))
            begin = self._filled(rb"[ \t\r\n]*+<PREFIX(?P<tag>%b)" % tag)
            form = re.compile(begin + parts + self._filled(_INSIDE), re.VERBOSE)
            named = form.groupindex
            others = [each for each in range(1, form.groups + 1) if each not in named.values()]
            if "id" in named:
                self._forms.insert(0, (form, kind, [named["id"], named["event"], *others]))
        return kind, [name if one == b"id" else other or b"", signal, *quantities]

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
