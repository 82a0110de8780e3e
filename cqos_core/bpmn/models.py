"""What plain events state: each kind of them is read once, as the one event of a small document, by what reads any other."""

from __future__ import annotations

from dataclasses import replace
from html import escape
from typing import TYPE_CHECKING, Final

from cqos_core.bpmn.document import DEFINITIONS
from cqos_core.bpmn.form import EVENT
from cqos_core.bpmn.plain import NotPlainError, Taking
from cqos_core.bpmn.plain_endpoints import Kind, pattern_of
from cqos_core.importers.xml_source import parse_utf8
from cqos_core.model.excerpt import NAMESPACES
from cqos_core.model.memory import keep
from cqos_core.model.regular import re
from cqos_core.model.rows import LinesOf
from cqos_core.model.source import Source

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator, Sequence

    from cqos_core.bpmn.plain import Plain
    from cqos_core.model.system import Endpoint, System

_MOST: Final = 1_000
"""Kinds of events worth reading, one by one; a document with more is read as a whole."""
_ID: Final = "cqos-event"
_OF_FLOW: Final = (b"attachedToRef", b"cancelActivity", b"isInterrupting", b"parallelMultiple")
"""Attributes that say when an event happens: the control flow reads them."""
# The start tag of the first element; what is before it are comments and instructions, in which no tag begins.
_FIRST = re.compile(rb"""<[A-Za-z_](?:[^<>"']++|"[^"]*+"|'[^']*+')*+(?<!/)>""")
# An attribute with a number other than zero, perhaps with a unit; without an exponent, which is spelt out.
_QUANTITY = rb"""([ \t\r\n](?:PREFIXES)(?!(?:WORDS)=)[\w.:-]++=")
(NUMBER)(?=")"""
_NUMBER = rb"(?:[1-9]\d{0,17}(?:\.\d{1,9})?|0\.\d{0,9}[1-9])(?:[a-df-z][a-z]{0,9})?"
_ATTRIBUTE = re.compile(r'([ \t\r\n]++)([\w.:-]++)="[^"]*+"')


class _Decoded(dict[bytes, str]):
    """Texts by their UTF-8, equal ones as one object."""

    def __missing__(self, text: bytes) -> str:
        self[text] = decoded = text.decode()
        return decoded


class Models:
    """The models of one document."""

    def __init__(
        self, prefixes: dict[str | None, str], bpmn: str, lines: LinesOf, read: Callable[[Source], System]
    ) -> None:
        """Keep what small documents begin with.

        Args:
            prefixes: the namespaces that the document binds.
            bpmn: the prefix of BPMN with its colon, or nothing.
            lines: of the document.
            read: reads a small document.
        """
        self._lines = lines
        self._read = read
        self._qos = tuple(f"{prefix}:" for prefix, uri in prefixes.items() if prefix and uri == NAMESPACES["qos"])
        names = b"|".join(re.escape(each.encode()) for each in self._qos) or b"(?!)"
        words = "|".join(EVENT.attributes).encode()
        self._quantity = re.compile(
            _QUANTITY.replace(b"NUMBER", _NUMBER).replace(b"PREFIXES", names).replace(b"WORDS", words), re.VERBOSE
        )
        self._bpmn = bpmn
        bound = "".join(
            f' xmlns{":" if prefix else ""}{prefix or ""}="{escape(uri)}"' for prefix, uri in prefixes.items()
        )
        self._head = f'<{bpmn}definitions{bound}><{bpmn}signal id="cqos-signal" name="cqos-topic"/><{bpmn}process id="cqos-process">'
        self._kinds: dict[tuple[str, str], Kind | None] = {}
        self._written: dict[tuple[bytes, ...], Kind | None] = {}
        self._texts = _Decoded()

    def model(self, tag: bytes, attributes: bytes) -> tuple[Kind, Sequence[bytes]] | None:
        """Return the kind of an event and its quantities; None where its reading says something, or has any effect but one endpoint.

        Quantities are set aside: events that differ in them alone are of one kind.
        """
        parts = self._quantity.split(attributes)  # what is before a quantity, the attribute up to it, the quantity, …
        quantities = parts[2::3]
        del parts[2::3]
        written = (tag, *parts)
        try:
            found = self._written[written]
        except KeyError:
            found = self._kind(tag.decode(), parts)
            keep(self._written, written, found)
        return None if found is None else (found, quantities)

    def form(self, attributes: bytes) -> bytes:
        """Return a regular expression for attributes that differ from these in quantities alone, which are its groups."""
        parts = self._quantity.split(attributes)
        del parts[2::3]
        text = (re.escape(part) + (b"(%b)" % _NUMBER if number % 2 else b"") for number, part in enumerate(parts))
        return b"".join(text)

    def texts(self, quantities: Iterable[bytes]) -> Iterator[str]:
        """Yield quantities as texts, equal ones of the document as one object."""
        return map(self._texts.__getitem__, quantities)

    def _kind(self, tag: str, parts: Sequence[bytes]) -> Kind | None:
        """Return the kind of events with attributes; ``parts`` are what stands around quantities in them."""
        if any(each in part for each in _OF_FLOW for part in parts):
            return None
        count, words = len(parts) // 2, 0
        text = "".join(
            part.decode() + (_quantity(number // 2 + 1) if number % 2 else "") for number, part in enumerate(parts)
        )

        def aside(match: re.Match[str]) -> str:
            nonlocal words
            blank, name = match.groups()
            if name.startswith(self._qos):
                return match[0]
            words += 1
            return f'{blank}{name}="cqos-word-{words}-"'

        kind = tag, _ATTRIBUTE.sub(aside, text)
        if kind not in self._kinds:
            if len(self._kinds) >= _MOST:
                return None
            endpoint = self._event(*kind, count)
            texts = [_quantity(each + 1) for each in range(count)]
            if endpoint is None:
                self._kinds[kind] = None
            else:
                self._kinds[kind] = Kind(endpoint, pattern_of(endpoint, texts), self._lines, tag, texts)
        return self._kinds[kind]

    def _event(self, tag: str, attributes: str, quantities: int) -> Endpoint | None:
        """Read a document with one event; None unless every quantity is the text of a setting, and there is nothing else."""
        event = f'<{self._bpmn}{tag} id="{_ID}" name="cqos-name"{attributes}>'
        definition = f'<{self._bpmn}signalEventDefinition signalRef="cqos-signal"/>'
        ends = f"</{self._bpmn}{tag}></{self._bpmn}process></{self._bpmn}definitions>"
        system = self._read(Source(self._lines.source, f"{self._head}{event}{definition}{ends}".encode()))
        plain = replace(system, endpoints=[], participants={}, processes={}, flows=(), sources={}, name="")
        if plain != type(system)() or len(system.endpoints) != 1 or len(system.participants) != 1:
            return None
        (endpoint,) = system.endpoints
        texts = [each.text for each in endpoint.settings.values()]
        said = repr((replace(endpoint, settings={}), [*endpoint.settings], system.participants))
        if any(texts.count(_quantity(number)) != 1 for number in range(1, quantities + 1)):
            return None
        if "cqos-word-" in f"{said}{texts}" or (endpoint.id, endpoint.label) != (_ID, "cqos-name"):
            return None
        return endpoint


def outline(name: str, data: bytes, read: Callable[[Source], System], *, lines: bool = True) -> Plain:
    """Take out of a document what is plain.

    Args:
        name: of its source.
        data: what `cqos_core.importers.xml_source.plain_utf8` made of it.
        read: reads a small document as a whole.
        lines: whether places have lines.

    Raises:
        NotPlainError: it has to be read as a whole.
        InputError: so it has, and it is no XML.
    """
    start = _FIRST.search(data)
    if start is None or b"xmlns" in data[start.end() :]:
        raise NotPlainError
    root = parse_utf8(Source(name, data), data[: start.end() - 1] + b"/>")
    bound = [prefix for prefix, uri in root.nsmap.items() if uri == NAMESPACES["bpmn"]]
    if root.tag != DEFINITIONS or len(bound) != 1:
        raise NotPlainError
    bpmn = f"{bound[0]}:" if bound[0] else ""
    models = Models(root.nsmap, bpmn, LinesOf(name, data, known=lines), read)
    return Taking(data, bpmn, start.end(), models).plain()


def _quantity(number: int) -> str:
    return f"9000{number:09}7"
