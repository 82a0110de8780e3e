"""Turns errors of the YAML parser into problems with advice: most faults in YAML are missing quotes."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING, NamedTuple, TypeAlias

from yaml.reader import ReaderError

from cqos_core.importers.source_reading import in_quotes, shown, to_write
from cqos_core.model.encoding import Lines, decode
from cqos_core.model.regular_expressions import regular_expression
from cqos_core.model.settings import Place

if TYPE_CHECKING:
    import yaml

    from cqos_core.importers.source_reading import SourceReading

_Position: TypeAlias = tuple[int, int]
"""One-based line and column."""

_NO_START = "cannot start any token"
_KEY = "simple key"
_FEW = 50
_BEHIND_QUOTES = 2
_QUOTE_IT = "a name or pattern that begins so must stand in quotes: write {0}"
_UNQUOTED_HASH = regular_expression(r"(?:[\[{,:-]|/)\s*#(?:\s*$|[:,\]}/]|\s*[,\]}])")
_GLUED = regular_expression(r"""\s*(?:- +)?([\w./~$+-]+):([^\s:/"'][^\s:]*)\s*(?:#.*)?$""")
_WORD = regular_expression(r"\s*(?:- +)?([\w./~$+-]+)\s*(?:#.*)?")
_NEXT_KEY = regular_expression(r"[^\s,{\[:]\s+([\w./~$+-]+)\s*:")
_TOKEN = regular_expression(r"(?:(?!\s#|:(?:\s|$)).)+")
_TOKEN_IN_FLOW = regular_expression(r"(?:(?!\s#|:(?:\s|$)|[,\[\]{}]).)+")
_PAIR = regular_expression(r"(\s*)(?:- +)?([\w./~$+-]+):\s+(\S.*?)\s*(?:\s#.*)?")
_OTHER_DASHES = "\u2010\u2011\u2012\u2013\u2014 "
_PAIR_IN_LIST = regular_expression(r"(\[[^\[\]{}:]*[^\[\]{}:,\s])\s*,\s*([\w.]+:\s[^\[\]]*$)")
_SECOND = regular_expression(r"([\w./]+),?\s+([a-z_]+):\s+([^:]+)")
_EMPTY_KEY = regular_expression(r"(\s*)([\w./~$+-]+):\s*")
_NAME = regular_expression(r"\s*(?:- +)?([\w./~$+-]+):")
_CLOSING = {"{": "}", "[": "]"}
_OPENING = {closing: opening for opening, closing in _CLOSING.items()}
_BRACKETS = regular_expression(r"""[\[{}\]]|"(?:[^"\\\n]|\\.)*"|'[^'\n]*'|(?<=\s)#[^\n]*""")
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


def explain(reading: SourceReading, error: yaml.YAMLError) -> None:
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
    tried = (
        each(failure, reading)
        for each in (
            *(_unquoted, _glued, _bare, _deeper, _colon_in_value),
            *(_uncommaed, _late_quotes, _too_many, _unclosed, _open_quotes, _line_of_text, _between),
        )
    )
    message, advice, where = next(filter(None, tried), None) or _other(failure, reading)
    advice = _hash_advice(failure, reading) or advice
    reading.problem("CQ001", f"this is not YAML: {message}", Place(reading.source.name, *where), advice)


class _Failure(NamedTuple):
    """An error of the parser: its message and place, and the construct around it, which begins at ``first``."""

    problem: str
    context: str
    first: _Position
    last: _Position


_Said: TypeAlias = tuple[str, str | None, _Position]
"""Message, advice and place."""


def _position(mark: yaml.Mark | None, otherwise: _Position) -> _Position:
    return (mark.line + 1, mark.column + 1) if mark is not None else otherwise


def _unquoted(failure: _Failure, reading: SourceReading) -> _Said | None:
    """Explain a character that means something to YAML."""
    rest = reading.rest_of_line(*failure.last)
    if "tab" in failure.problem or (_NO_START in failure.problem and rest.startswith("\t")):
        return _tab(reading, failure.last)
    if _NO_START in failure.problem:
        word = _token(reading, failure.last)
        if word[:1] == word[-1:] == "`" and len(word) > len("``"):
            return "a backquote begins no text", f"write {in_quotes(word[1:-1])}", failure.last
        advice = _QUOTE_IT.format(in_quotes(word))
        if reading.rest_of_line(failure.last[0], 1)[: failure.last[1] - 1].rstrip().endswith(":") and re.fullmatch(
            r"\w+", word[1:]
        ):
            advice += f"; a value without the sign is `{word[1:]}`"
        return f"no value begins with {rest[:1]}", advice, failure.last
    for word, sign in (("alias", "*"), ("anchor", "&")):
        if word in failure.context:
            if (apart := re.match(rf"\{sign} +([\w-]+)", reading.rest_of_line(*failure.first))) is not None:
                return f"a blank stands behind {sign}", f"write `{sign}{apart[1]}`", failure.first
            advice = _QUOTE_IT.format(in_quotes(_token(reading, failure.first)))
            return f"{sign} begins the name of an anchor here", advice, failure.first
    return None


def _tab(reading: SourceReading, at: _Position) -> _Said:
    """Say how many blanks stand for a tab: as many as the key before it has, two more where its value begins here."""
    line = reading.lines.line(at[0])
    text = line.lstrip()
    if line[: at[1] - 1].strip():
        before = line[: at[1] - 1].rstrip()
        return "a tab where YAML wants a blank", f"write `{before} {text[len(before.lstrip()) :].lstrip()}`", at
    above = next((each for each in map(reading.lines.line, range(at[0] - 1, 0, -1)) if each.strip()), "")
    blanks = len(above) - len(above.lstrip(" ")) + (2 if above.split(" #")[0].rstrip().endswith(":") else 0)
    many = f"{blanks} blanks" if "\t" not in above and blanks else "blanks"
    return (
        "a tab in the indentation",
        f"YAML is indented with blanks: write {many} before {to_write(text.rstrip())}",
        at,
    )


def _token(reading: SourceReading, at: _Position) -> str:
    """Return the text that was meant to be one name or value, from where it begins."""
    before = reading.rest_of_line(at[0], 1)[: at[1] - 1]
    in_flow = any(before.count(each) > before.count(_CLOSING[each]) for each in _CLOSING)
    found = (_TOKEN_IN_FLOW if in_flow else _TOKEN).match(reading.rest_of_line(*at))
    return found[0].rstrip() if found else reading.rest_of_line(*at)[:1]


def _glued(failure: _Failure, reading: SourceReading) -> _Said | None:
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


def _bare(failure: _Failure, reading: SourceReading) -> _Said | None:
    """Explain a second colon by the key above that has none."""
    if "expected ':'" in failure.problem:
        return _value_below(failure, reading)
    line = failure.last[0] - 1
    found = _WORD.fullmatch(reading.lines.line(line)) if "mapping values" in failure.problem else None
    return found and (f"the key {shown(found[1])} has no colon", f"write `{found[1]}:`", (line, found.start(1) + 1))


def _value_below(failure: _Failure, reading: SourceReading) -> _Said | None:
    """Explain a word that stands below its key with the same indentation, or a line of other dashes than ``---``."""
    line = failure.first[0]
    text, above = reading.lines.line(line), _EMPTY_KEY.fullmatch(reading.lines.line(line - 1))
    if text.strip() and not text.strip(_OTHER_DASHES):
        return f"{shown(text.strip())} begins no document", "write `---`", (line, 1)
    word = _WORD.fullmatch(text)
    if above is None or word is None or _indent(text) > len(above[1]):
        return None
    advice = f"write it behind its key: `{above[2]}: {word[1]}`"
    return (
        f"{shown(word[1])} stands below {shown(above[2])}, with the same indentation",
        advice,
        (line, word.start(1) + 1),
    )


def _uncommaed(failure: _Failure, reading: SourceReading) -> _Said | None:
    """Explain a key in a flow map that stands behind a value without a comma."""
    line, column = failure.last
    keys = _NEXT_KEY.finditer(reading.lines.line(line)) if "expected ','" in failure.problem else ()
    found = next((each for each in keys if each.start(1) < column <= each.end()), None)
    if not found:
        return None
    text, start = reading.lines.line(line), found.start(1)
    before = text[:start].rstrip()
    message = f"no comma before {shown(found[1])}"
    if before.endswith(";"):
        before, message = before[:-1], f"a semicolon stands before {shown(found[1])}, where YAML wants a comma"
    return message, f"write {to_write(f'{before}, {text[start:]}'.strip())}", (line, start + 1)


def _deeper(failure: _Failure, reading: SourceReading) -> _Said | None:
    """Explain a key that is indented deeper than the key above it, which has a value already."""
    line = failure.last[0]
    above, name = _PAIR.match(reading.lines.line(line - 1)), _NAME.match(reading.lines.line(line))
    if "mapping values" not in failure.problem or above is None or name is None:
        return None
    if name.start(1) <= above.start(2) or failure.last[1] > name.end() + 1:
        return None
    blanks = f"{above.start(2)} blanks" if above.start(2) else "no blanks"
    message = f"{shown(name[1])} is indented deeper than {shown(above[2])}, which has a value already"
    return message, f"write {blanks} before {shown(name[1])}, as before {shown(above[2])}", (line, name.start(1) + 1)


def _line_of_text(failure: _Failure, reading: SourceReading) -> _Said | None:
    """Explain a line that YAML takes for text: one that begins with ``//`` or ``/*``, or has nothing but dashes of other kinds."""
    for line in range(failure.last[0], max(0, failure.first[0] - 2, failure.last[0] - _FEW), -1):
        text = reading.lines.line(line)
        if text.strip() and not text.strip(_OTHER_DASHES):
            return f"the line {shown(text.strip())} is text to YAML", "remove it", (line, _indent(text) + 1)
        if (found := re.match(r"\s*(//|/\*)\s*(.*?)\s*(?:\*/)?\s*$", text)) is not None:
            return (
                f"`{found[1]}` begins no comment in YAML",
                f"write {to_write(f'# {found[2]}')}",
                (line, found.start(1) + 1),
            )
    return None


def _between(failure: _Failure, reading: SourceReading) -> _Said | None:
    """Explain a key whose indentation is between that of the keys above it and that of their parents."""
    if not re.search("did not find expected key|expected <block end>", failure.problem):
        return None
    line, column = failure.last
    name = _NAME.match(reading.lines.line(line))
    if name is None or name.start(1) + 1 != column:
        return None
    keys = (_NAME.match(reading.lines.line(each)) for each in range(line - 1, max(0, line - _FEW), -1))
    above: dict[int, str] = {}
    for found in filter(None, keys):
        above.setdefault(found.start(1), found[1])
    near = min(above, key=lambda blanks: abs(blanks - name.start(1)), default=None)
    if near is None or near == name.start(1):
        return None
    blanks = f"{near} blanks" if near else "no blanks"
    message = f"{shown(name[1])} is indented otherwise than the lines above"
    return message, f"write {blanks} before {shown(name[1])}, as before {shown(above[near])}", (line, column)


def _colon_in_value(failure: _Failure, reading: SourceReading) -> _Said | None:
    """Explain a value that holds a colon and a blank."""
    found = _PAIR.fullmatch(reading.lines.line(failure.last[0])) if "mapping values" in failure.problem else None
    if found is None or failure.last[1] <= found.start(3):
        return None
    advice = f"put the value in quotes: `{found[2]}: {in_quotes(found[3])}`"
    if (second := _SECOND.fullmatch(found[3])) is not None:
        one, other = (f"{found[2]}: {second[1]}", f"{second[2]}: {second[3]}")
        column = found.start(3) + second.start(2)
        advice = f"write two lines with the same indentation, {to_write(one)} and {to_write(other)}; or {advice}"
        return f"{shown(second[2])} stands behind the value of {shown(found[2])}", advice, (failure.last[0], column + 1)
    if re.fullmatch(r"[a-z_.]+:\s+[^:{}\[\]]+", found[3]):
        advice = f"write a map, `{found[2]}: {{{found[3]}}}`; or {advice}"
    return "a second colon in one value", advice, (failure.last[0], found.start(3) + 1)


def _too_many(failure: _Failure, reading: SourceReading) -> _Said | None:
    """Explain a comma or closing bracket behind a closed list or map."""
    line, column = failure.last
    text = reading.lines.line(line)
    sign = text[column - 1 : column]
    if sign == "," and "node content" in failure.problem:
        right = f"{text[: column - 1].rstrip()} {text[column:].lstrip()}".replace("{ ", "{").replace("[ ", "[")
        return "one comma too many", f"remove it: {to_write(right.strip())}", failure.last
    if text.startswith("//", column - 1) and "flow" not in failure.context:
        advice = f"write {to_write(f'# {text[column + 1 :].strip()}')}"
        return "`//` begins no comment in YAML", advice, failure.last
    if "flow" in failure.context or sign not in set(",]}") or _open_in(text[: column - 1]) != "":
        return None
    what = "a comma behind the end of a value" if sign == "," else f"one `{sign}` too many"
    return what, f"remove it: {to_write((text[: column - 1].rstrip() + text[column:]).strip())}", failure.last


def _unclosed(failure: _Failure, reading: SourceReading) -> _Said | None:
    """Explain a list or map in brackets that is not closed, or closed by the bracket of the other."""
    if "expected ','" not in failure.problem or "flow" not in failure.context:
        return None
    (first, column), (last, behind) = failure.first, failure.last
    text = reading.lines.line(last)
    if last == first or text[behind - 1 : behind] in {"]", "}"}:
        missing = _open_in("\n".join([*map(reading.lines.line, range(first, last)), text[: behind - 1]]), column)
        inner = _PAIR_IN_LIST.search(text[: behind - 1])
        if missing[:1] == "]" and text[behind - 1 : behind] == "}" and inner is not None:
            right = f"{text[: inner.end(1)]}], {text[inner.start(2) :]}"
            right = right.rstrip() + _open_in(right)
            begun = inner.start(1) + 1
            message = f"`[` of line {last}, column {begun}, is not closed"
            return message, f"write {to_write(right.strip())}", (last, begun)
        if missing and text[behind - 1 : behind] in {"]", "}"}:
            right = (text[: behind - 1] + missing[0] + text[behind:]).rstrip()
            right += "" if last != first else _open_in(right)
            message = f"{shown(text[behind - 1])} does not close what `{_OPENING[missing[0]]}` opens on line {first}"
            return message, f"write `{missing[0]}` in its place: {to_write(right.strip())}", failure.last
        return None
    end = last if not text[behind - 1 :].strip() else last - 1
    while end > first and not reading.lines.line(end).strip():
        end -= 1
    missing = _open_in("\n".join(map(reading.lines.line, range(first, end + 1))))
    ended = reading.lines.line(end).split(" #")[0].strip()
    if not missing:
        return None
    if text[behind - 1 :].strip() and _indent(text) > _indent(reading.lines.line(first)):
        return (
            f"no comma at the end of line {end}",
            f"write {to_write(ended + ',')}",
            (end, _indent(reading.lines.line(end)) + 1),
        )
    opened = f"`{_OPENING[missing[-1]]}` of line {first}, column {column}, is not closed"
    where = f"at the end of line {end}: " if end != first else ""
    return opened, f"write {where}{to_write(ended.rstrip(',') + missing)}", failure.first


def _indent(line: str) -> int:
    return len(line) - len(line.lstrip())


def _open_in(text: str, column: int = 1) -> str:
    """Return the brackets that close what a text opens from a column on, the innermost first."""
    missing = ""
    for part in _BRACKETS.finditer(text, column - 1):
        sign = part[0]
        if sign in _CLOSING:
            missing = _CLOSING[sign] + missing
        elif missing and sign == missing[0]:
            missing = missing[1:]
    return missing


def _late_quotes(failure: _Failure, reading: SourceReading) -> _Said | None:
    """Explain quotes that are closed on a later line, by those that open the next text."""
    line, column = failure.last
    sign = reading.lines.line(line)[column - 2 : column - 1]
    if sign not in {"'", '"'} or column < _BEHIND_QUOTES:
        return None
    for number in range(line - 1, max(0, line - _FEW), -1):
        text = reading.lines.line(number).split(" #")[0].rstrip()
        if text.count(sign) % 2:
            message = f"the quotes that are opened on line {number} are closed on line {line}"
            start = text.rindex(sign)
            return message, f"close them on line {number}: {to_write((text + sign).strip())}", (number, start + 1)
    return None


def _open_quotes(failure: _Failure, reading: SourceReading) -> _Said | None:
    """Explain quotes that are not closed before the end of the file."""
    if "unexpected end of stream" not in failure.problem or "quoted" not in failure.context:
        return None
    rest = reading.rest_of_line(*failure.first)
    word = _token(reading, failure.first)
    if word[-1] in "'\"" and word[-1] != rest[0]:
        word = word[:-1]  # closed by quotes of the other kind
    message = f"the quotes that are opened on line {failure.first[0]} are never closed"
    return message, f"close them at the end of the value: {to_write(word + rest[0])}", failure.first


def _other(failure: _Failure, reading: SourceReading) -> _Said:
    """Return the parser's message in our own words, at the best place."""
    start = reading.lines.start(failure.last[0])
    at_end = start is None or not reading.lines.text[start + failure.last[1] - 1 :].strip()
    where = failure.first if at_end or _KEY in failure.context else failure.last
    line = reading.lines.line(failure.last[0])
    if (opened := re.search(r"(?<=[\s,\[{])(['\"])([^'\",\[\]{}]+),\s*\1\w", line)) is not None:
        message = f"the quotes before {shown(opened[2])} are not closed"
        return message, f"write {to_write(opened[1] + opened[2] + opened[1])}", (failure.last[0], opened.start() + 1)
    if (doubled := re.search(r"(''|\"\")([^'\"]+)\1", line)) is not None:
        message = f"{shown(doubled[0])} begins and ends with two quotes each"
        return message, f"write {to_write(doubled[2])}", (failure.last[0], doubled.start() + 1)
    round_ = re.search(r":\s*\((\w[\w.]*:\s[^()]{1,200})\)", line)
    if "flow" in failure.context and round_ is not None:
        column = round_.start(1)
        return "round brackets make no map", f"write `{{{round_[1]}}}`", (failure.last[0], column)
    for pattern, message, advice in _FAULTS:
        if re.search(pattern, failure.problem):
            return message.format(line=failure.first[0]), advice, where
    return failure.problem, None, where


def _hash_advice(failure: _Failure, reading: SourceReading) -> str | None:
    """Suspect a ``#`` that was meant as a name, in one of the lines that were being read."""
    first, last = failure.first[0] - 1, min(failure.last[0], failure.first[0] + _FEW)
    for line in map(reading.lines.line, range(first, last + 1)):
        if _UNQUOTED_HASH.search(line):
            return f'in {shown(line.strip())} the `#` begins a comment; write a filter with `#` in quotes: "#"'
    return None


def _explain_bytes(reading: SourceReading, error: ReaderError) -> None:
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
