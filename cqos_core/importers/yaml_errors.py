"""Turns what stopped a YAML parser into a problem that says what to do: most faults in YAML are missing quotes."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING, NamedTuple, TypeAlias

from yaml.reader import ReaderError

from cqos_core.importers.reading import shown
from cqos_core.model.encoding import Lines, decode
from cqos_core.model.regular import regular_expression
from cqos_core.model.system import Place

if TYPE_CHECKING:
    import yaml

    from cqos_core.importers.reading import Reading

_Position: TypeAlias = tuple[int, int]
"""One-based line and column."""

_NO_START = "cannot start any token"
_KEY = "simple key"
_FEW = 50
_QUOTE_IT = 'a name or pattern that begins so must stand in quotes, as in "{0}…"'
_UNQUOTED_HASH = regular_expression(r"(?:[\[{,:-]|/)\s*#(?:\s*$|[:,\]}/]|\s*[,\]}])")
_GLUED = regular_expression(r"""\s*(?:- +)?([\w./~$+-]+):([^\s:/"'][^\s:]*)\s*(?:#.*)?$""")
_WORD = regular_expression(r"\s*(?:- +)?([\w./~$+-]+)\s*(?:#.*)?")
_NEXT_KEY = regular_expression(r"[^\s,{\[:]\s+([\w./~$+-]+)\s*:")
_CONTROL = "control characters are not allowed"
_SPECIAL = "special characters are not allowed"
# The libyaml and the pure Python parser say the same thing differently here and there.
_FAULTS: tuple[tuple[str, str, str | None], ...] = (
    (
        r"mapping values are not allowed",
        "a second colon in one value, or a line that is indented too far",
        "put a value that holds `: ` in quotes, and give the keys of one map the same indentation",
    ),
    (
        r"could not find expected ':'",
        "a line that is neither `key: value` nor `- item`",
        "write a colon and a blank between key and value, and a blank after the dash of an item",
    ),
    (
        r"did not find expected key|expected <block end>",
        "the indentation does not fit the lines above",
        "give the keys of one map the same indentation",
    ),
    (
        r"did not find expected '-' indicator",
        "an item of a list is expected here",
        "give the items of one list the same indentation",
    ),
    (
        r"expected ',' or '(.)'",
        "the list or map that begins on line {line} is not continued or closed here",
        "write a comma between its parts, and close it with `]` or `}`",
    ),
    (
        r"unexpected end of stream",
        "the quotes that are opened on line {line} are never closed",
        "close them at the end of the value",
    ),
    (
        r"unknown escape character",
        "a backslash in double quotes begins an escape, and this one is not known",
        "use single quotes, in which a backslash is a backslash",
    ),
    (r"escape|escaped", "the escape in these double quotes stands for no character", None),
    (
        r"block sequence entries are not allowed",
        "a list cannot begin here",
        "begin it on the next line, or write it as [a, b]",
    ),
    (
        r"document start|document separator",
        "something follows after the end of the document",
        "begin another document with a line `---`",
    ),
    (
        r"node content",
        "a value is missing here",
        "write the value, or close the list or map that is open with `]` or `}`",
    ),
    (r"incompatible YAML document|YAML directive", "this is another version of YAML than 1.1 or 1.2", None),
    (
        r"undefined tag handle|tag handle",
        "the tag means nothing here",
        'if the text begins with `!`, write it in quotes: "!text"',
    ),
)


def explain(reading: Reading, error: yaml.YAMLError) -> None:
    """Collect the problem that ``error`` is."""
    if isinstance(error, ReaderError):
        _explain_bytes(reading, error)
        return
    last = _position(getattr(error, "problem_mark", None), (1, 1))
    failure = _Failure(
        getattr(error, "problem", None) or str(error),
        getattr(error, "context", None) or "",
        _position(getattr(error, "context_mark", None), last),
        last,
    )
    tried = (each(failure, reading) for each in (_unquoted, _glued, _bare, _uncommaed))
    message, advice, where = next(filter(None, tried), None) or _other(failure, reading)
    advice = _hash_advice(failure, reading) or advice
    reading.problem("CQ001", f"this is not YAML: {message}", Place(reading.source.name, *where), advice)


class _Failure(NamedTuple):
    """What the parser says: what is wrong and where, and in what, which begins at ``first``."""

    problem: str
    context: str
    first: _Position
    last: _Position


_Said: TypeAlias = tuple[str, str | None, _Position]
"""Message, advice and place."""


def _position(mark: yaml.Mark | None, otherwise: _Position) -> _Position:
    return (mark.line + 1, mark.column + 1) if mark is not None else otherwise


def _unquoted(failure: _Failure, reading: Reading) -> _Said | None:
    """Explain a character that means something to YAML."""
    rest = reading.rest_of_line(*failure.last)
    if "tab" in failure.problem or (_NO_START in failure.problem and rest.startswith("\t")):
        return "a tab in the indentation", "YAML is indented with blanks", failure.last
    if _NO_START in failure.problem:
        return f"no value begins with {rest[:1]}", _QUOTE_IT.format(rest[:1]), failure.last
    for word, sign in (("alias", "*"), ("anchor", "&")):
        if word in failure.context:
            return f"{sign} begins the name of an anchor here", _QUOTE_IT.format(sign), failure.first
    return None


def _glued(failure: _Failure, reading: Reading) -> _Said | None:
    """Explain a line that looks like ``key:value``, among those that are reported and the one before."""
    for line in (failure.first[0], failure.last[0], failure.last[0] - 1):
        found = _GLUED.match(reading.lines.line(line))
        if found:
            advice = f"write a blank after the colon: `{found[1]}: {found[2]}`"
            return (
                f"{shown(f'{found[1]}:{found[2]}')} is no key with a value",
                advice,
                (line, found.start(1) + 1),
            )
    return None


def _bare(failure: _Failure, reading: Reading) -> _Said | None:
    """Explain a second colon by the key above that has none."""
    line = failure.last[0] - 1
    found = _WORD.fullmatch(reading.lines.line(line)) if "mapping values" in failure.problem else None
    return found and (f"the key {shown(found[1])} has no colon", f"write `{found[1]}:`", (line, found.start(1) + 1))


def _uncommaed(failure: _Failure, reading: Reading) -> _Said | None:
    """Explain a key in a flow map that stands behind a value without a comma."""
    line, column = failure.last
    keys = _NEXT_KEY.finditer(reading.lines.line(line)) if "expected ','" in failure.problem else ()
    found = next((each for each in keys if each.start(1) < column <= each.end()), None)
    return found and (f"no comma before {shown(found[1])}", f"write `, {found[1]}`", (line, found.start(1) + 1))


def _other(failure: _Failure, reading: Reading) -> _Said:
    """Say what the parser says in our own words, where it is best seen."""
    start = reading.lines.start(failure.last[0])
    at_end = start is None or not reading.lines.text[start + failure.last[1] - 1 :].strip()
    where = failure.first if at_end or _KEY in failure.context else failure.last
    for pattern, message, advice in _FAULTS:
        if re.search(pattern, failure.problem):
            return message.format(line=failure.first[0]), advice, where
    return failure.problem, None, where


def _hash_advice(failure: _Failure, reading: Reading) -> str | None:
    """Suspect a ``#`` that was meant as a name, in one of the lines that were being read."""
    first, last = failure.first[0] - 1, min(failure.last[0], failure.first[0] + _FEW)
    for line in map(reading.lines.line, range(first, last + 1)):
        if _UNQUOTED_HASH.search(line):
            return f'in {shown(line.strip())} the `#` begins a comment; write a filter with `#` in quotes: "#"'
    return None


def _explain_bytes(reading: Reading, error: ReaderError) -> None:
    data = reading.source.data
    # The C parser counts bytes, the pure one characters where it has got as far as characters.
    before = decode(data)[: error.position] if _SPECIAL in error.reason else decode(data[: error.position])
    place = Place(reading.source.name, *Lines(before).position(len(before)))
    if error.reason == _CONTROL or _SPECIAL in error.reason:
        message = f"the control character U+{error.character:04X} is not allowed in YAML"
        advice = "remove it; in double quotes it can be written as an escape"
        reading.problem("CQ001", message, place, advice if error.character else "save the file as UTF-8")
    else:
        reading.problem("CQ001", f"the bytes here are no text: {error.reason}", place, "save the file as UTF-8")
