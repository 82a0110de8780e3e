"""Which partitions meet, as the standard says and as implementations do it (DDS 1.4, 2.2.3.13).

Two lists meet when some name of one matches some name of the other. A name with wildcards is an expression; it matches
names without any, but not another expression.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from fnmatch import fnmatchcase, translate
from functools import lru_cache, reduce
from operator import or_
from typing import Final, TypeAlias

from cqos_core.language.name_index import NameIndex
from cqos_core.model.re2_patterns import PatternError, name_matcher
from cqos_core.model.regular_expressions import re
from cqos_dds.implementations import CYCLONE_DDS, FAST_DDS, IMPLEMENTATION

Names: TypeAlias = tuple[str, ...]
NO_NAME: Final = ("",)
"""What an empty list stands for."""


def meet(writer: Names, reader: Names, implementation: int) -> bool:
    """Whether an end of this implementation takes the partitions of writer and reader for a match."""
    name = IMPLEMENTATION.domain.format(implementation)
    return _meet(writer, reader, name)


@lru_cache(maxsize=10_000)
def _meet(writer: Names, reader: Names, implementation: str) -> bool:
    return OTHERS.get(implementation, as_the_standard_says)(writer, reader)


def meet_many(writers: Sequence[Names], readers: Mapping[Names, int], implementation: int) -> list[int]:
    """Return for each list of a writer the bits of all lists of readers that `meet` takes for a match with it.

    Two lists match where a name of one matches a name of the other, so each two names that look alike are compared once.
    """
    name = IMPLEMENTATION.domain.format(implementation)
    if OTHERS.get(name) is ignoring_partitions:
        return [reduce(or_, readers.values())] * len(writers)
    offered = {part: 0 for names in writers for part in _parts(names)}
    requested: dict[Names, int] = {}
    for names, bits in readers.items():
        for part in _parts(names):
            requested[part] = requested.get(part, 0) | bits
    for one, other, turned in ((offered, requested, False), (requested, offered, True)):
        index = NameIndex(((_text(part), part) for part in other), _WILD)
        for part in one:
            for found in index.candidates(_text(part)):
                writer, reader = (found, part) if turned else (part, found)
                if requested[reader] & ~offered[writer] and _meet(writer, reader, name):
                    offered[writer] |= requested[reader]
    return [reduce(or_, (offered[part] for part in _parts(names))) for names in writers]


def _parts(names: Names) -> list[Names]:
    """Each name of a list as a list of its own; an empty list is one itself."""
    return [(name,) for name in names] or [()]


def _text(names: Names) -> str:
    """The name without backslashes, which some implementations leave out."""
    return "".join(names).replace("\\", "")


_WILD: Final = re.compile(r"[*?\[\]+]")
"""What stands for something else in a name with any implementation."""


def as_the_standard_says(writer: Names, reader: Names) -> bool:
    """Compare by POSIX `fnmatch`: ``*``, ``?``, ``[abc]``, ``[!a-z]``, ``[[:alpha:]_]``."""
    return _some(writer or NO_NAME, reader or NO_NAME, _is_expression, posix)


def as_cyclone_dds_does(writer: Names, reader: Names) -> bool:
    """Compare with ``*`` and ``?`` only, byte by byte in UTF-8; brackets are plain characters."""
    return _some(_in_bytes(writer), _in_bytes(reader), _has_star_or_mark, _star_and_mark)


def _in_bytes(names: Names) -> Names:
    return tuple(map(_bytes, names or NO_NAME))


def _bytes(name: str) -> str:
    """Each byte in UTF-8 as one character."""
    return name.encode("utf-8", "surrogatepass").decode("latin-1")


def as_opendds_does(writer: Names, reader: Names) -> bool:
    """Compare as the standard says, with a backslash before a wildcard that is meant as it stands; classes have no names."""
    return _some(writer or NO_NAME, reader or NO_NAME, _is_unescaped_expression, _with_escapes)


def as_fast_dds_does(writer: Names, reader: Names) -> bool:
    """Compare in both directions, so that two expressions may match; an empty list meets only what names nothing.

    `fnmatch` compares bytes in the locale C, and characters where the program has set another: both must match.
    """
    if not writer or not reader:
        return "" in (writer or NO_NAME) and "" in (reader or NO_NAME)
    return any(
        all(posix(one, other) or posix(other, one) for one, other in {(a, b), (_bytes(a), _bytes(b))})
        for a in writer
        for b in reader
    )


def as_dust_dds_does(writer: Names, reader: Names) -> bool:
    """Compare as regular expressions in both directions, ``+`` among them; an empty list meets an empty list only."""
    if not writer or not reader:
        return writer == reader
    return any(a == b or _as_regular_expression(a, b) or _as_regular_expression(b, a) for a in writer for b in reader)


def ignoring_partitions(writer: Names, reader: Names) -> bool:  # noqa: ARG001 - the signature of all
    """Compare nothing: the implementation has no partitions."""
    return True


OTHERS: Final[dict[str, Callable[[Names, Names], bool]]] = {
    **dict.fromkeys(CYCLONE_DDS, as_cyclone_dds_does),
    "opendds": as_opendds_does,
    "dust": as_dust_dds_does,
    "rustdds": ignoring_partitions,
    **dict.fromkeys(FAST_DDS, as_fast_dds_does),
}


def _some(
    writer: Names, reader: Names, is_expression: Callable[[str], bool], matches: Callable[[str, str], bool]
) -> bool:
    """Whether some name of one list matches some name of the other, two expressions never."""
    offered, offering = _sorted(writer, is_expression)
    requested, requesting = _sorted(reader, is_expression)
    return (
        not offered.isdisjoint(requested)
        or any(matches(name, expression) for expression in offering for name in requested)
        or any(matches(name, expression) for expression in requesting for name in offered)
    )


@lru_cache(maxsize=10_000)
def _sorted(names: Names, is_expression: Callable[[str], bool]) -> tuple[frozenset[str], tuple[str, ...]]:
    """The plain names of a list, and its expressions."""
    expressions = tuple(name for name in names if is_expression(name))
    return frozenset(names).difference(expressions), expressions


# Which characters have each name in the POSIX locale, as ranges of a regular expression.
_CLASSES: Final = {
    "alnum": "0-9A-Za-z",
    "alpha": "A-Za-z",
    "blank": " \\t",
    "cntrl": r"\x00-\x1f\x7f",
    "digit": "0-9",
    "graph": "!-~",
    "lower": "a-z",
    "print": " -~",
    "punct": r"!-/:-@\[-`{-~",
    "space": r" \t\n\v\f\r",
    "upper": "A-Z",
    "xdigit": "0-9A-Fa-f",
}
_PART: Final = re.compile(r"(?P<bracket>\[([!^]?+)(\]?+(?:\[:[a-z]+:\]|[^\]])*+)\])|.", re.DOTALL)
_MEMBER: Final = re.compile(r"\[:([a-z]+):\]|(.)-(.)|(.)", re.DOTALL)


def posix(name: str, expression: str) -> bool:
    """Match as `fnmatch` of POSIX does without escapes; ``^`` negates as ``!`` does, which POSIX leaves open."""
    return _posix_pattern(expression).fullmatch(name) is not None


@lru_cache(maxsize=10_000)
def _posix_pattern(expression: str) -> re.Pattern[str]:
    pieces = [""]
    for found in _PART.finditer(expression):
        if found[0] == "*":
            pieces.append("")
        else:
            pieces[-1] += _part(found)
    first, *others = pieces
    if not others:
        return re.compile(first, re.DOTALL)
    # What stands between two stars is as good where it is found first, so nothing has to be tried again.
    *between, last = others
    return re.compile(f"{first}{''.join(f'(?>.*?{piece})' for piece in between if piece)}.*{last}", re.DOTALL)


def _part(found: re.Match[str]) -> str:
    """Return the regular expression for a mark, a set of characters or a plain character."""
    if found["bracket"] is None:
        return "." if found[0] == "?" else re.escape(found[0])
    members = list(map(_member, _MEMBER.finditer(found[3])))
    if None in members:
        return "(?!)"  # a class that is none makes the expression one that matches nothing
    listed = "".join(member for member in members if member is not None)
    return f"[{'^' if found[2] else ''}{listed}]" if listed else "." if found[2] else "(?!)"


def _member(found: re.Match[str]) -> str | None:
    """Return what stands in a set as a part of one of a regular expression; None for a class that is none."""
    named, first, last, single = found.groups()
    if named is not None:
        return _CLASSES.get(named)
    if single is not None:
        return re.escape(single)
    return f"{re.escape(first)}-{re.escape(last)}" if first <= last else ""


_WILDCARD: Final = re.compile(r"[*?]|\[!?\]?[^\]]*\]")
_ESCAPED: Final = re.compile(r"\\(.)", re.DOTALL)


def _is_expression(name: str) -> bool:
    return _WILDCARD.search(name) is not None


def _has_star_or_mark(name: str) -> bool:
    return "*" in name or "?" in name


def _star_and_mark(name: str, expression: str) -> bool:
    return fnmatchcase(name, expression.replace("[", "[[]"))


def _is_unescaped_expression(name: str) -> bool:
    return _is_expression(_ESCAPED.sub("", name))


def _with_escapes(name: str, expression: str) -> bool:
    """Match with escaped wildcards taken as they stand, in the name as well."""
    plain = _ESCAPED.sub(lambda match: f"[{match[1]}]" if match[1] in "*?[" else match[1], expression)
    return fnmatchcase(_ESCAPED.sub(r"\1", name), plain)


_TOKEN: Final = re.compile(r"\\.|\[\^?\]?(?:\\.|[^\]\\])*+\]|\(\?>|\.\*\??\+", re.DOTALL)
_OPENED: Final = re.compile(r"\\?\[")
_PLUS: Final = re.compile(r"(?:\\\+)++")


def _as_regular_expression(name: str, expression: str) -> bool:
    translated = _PLUS.sub("+", translate(expression)).removesuffix(r"\Z").removesuffix(r"\z")
    try:
        return name_matcher(_TOKEN.sub(_in_re2, translated))(name)
    except PatternError:
        return False


def _in_re2(found: re.Match[str]) -> str:
    """Return a token as RE2 has it: without atomic groups, brackets in sets escaped, nothing repeated that is already."""
    token = found[0]
    if token == "(?>":  # noqa: S105 - a bracket
        return "(?:"
    if token.startswith("["):
        return "[" + _OPENED.sub(r"\\[", token[1:])
    return token.removesuffix("+") if token.startswith(".*") else token
