"""Regular expressions over names, matched in a time that no pattern can blow up.

What is configured by regular expressions mostly comes from programs whose own matcher is linear (Rust, Go, RE2). Python's is
not, so a pattern from a file could keep it busy for ever. Here all ways through a pattern are followed at once.
"""

from __future__ import annotations

import re
from dataclasses import dataclass, field
from functools import lru_cache
from typing import Final

from cqos_core.problems import CqosError

_MOST_STATES: Final = 2_000
_DEEPEST: Final = 50
_MOST_REPEATED: Final = 1_000
_SPECIAL: Final = frozenset("|)*+?{")
_QUANTIFIER: Final = re.compile(r"(?:([*+?])|\{([0-9]{1,5})(,?)([0-9]{0,5})\})\??")
_GROUP: Final = re.compile(r"\((?:\?(?:P?<[A-Za-z_][A-Za-z0-9_]*>|:))?")
_CLASS: Final = re.compile(r"\[\^?\]?(?:\\[dDwWsSnrt]|\\[^A-Za-z0-9]|[^\]\\\[])*+\]")
_ESCAPE: Final = re.compile(r"\\(?:[dDwWsSnrt]|[^A-Za-z0-9])")
_SET_OPERATORS: Final = ("&&", "--", "~~")
_ANCHORS: Final = {"^": "start", "$": "end", r"\A": "start", r"\z": "end"}


class PatternError(CqosError):
    """A regular expression is wrong, or uses what is not read here; the text says which part."""


@dataclass(frozen=True, slots=True)
class _Node:
    """A part of a pattern: ``one`` character, ``all`` of its parts, ``any`` of them, its part ``again``, or an anchor."""

    kind: str
    text: str = ""
    parts: tuple[_Node, ...] = ()
    least: int = 0
    most: int | None = None


@dataclass(slots=True)
class _State:
    """Where a match can be: it goes on to all of ``then``, at once or after a character or anchor."""

    then: list[int]
    one: re.Pattern[str] | None = None
    anchor: str = ""


@dataclass(slots=True)
class Pattern:
    """A regular expression that a whole name has to match."""

    _states: list[_State] = field(default_factory=list)
    _first: int = 0

    def matches(self, name: str) -> bool:
        """Whether the pattern matches ``name`` from its beginning to its end."""
        now = self._reached([self._first], 0, len(name))
        for at, char in enumerate(name):
            after = [
                follower
                for index in now
                if (one := self._states[index].one) is not None and one.fullmatch(char)
                for follower in self._states[index].then
            ]
            now = self._reached(after, at + 1, len(name))
            if not now:
                return False
        return 0 in now

    def _reached(self, begun: list[int], at: int, end: int) -> set[int]:
        """Follow everything that needs no character."""
        found: set[int] = set()
        while begun:
            index = begun.pop()
            state = self._states[index]
            held = (state.anchor == "start" and at > 0) or (state.anchor == "end" and at < end)
            if index not in found and not held:
                found.add(index)
                if state.one is None:
                    begun += state.then
        return found

    def _add(self, then: list[int], one: re.Pattern[str] | None = None, anchor: str = "") -> int:
        if len(self._states) >= _MOST_STATES:
            raise PatternError("it repeats more than any name needs")
        self._states.append(_State(then, one, anchor))
        return len(self._states) - 1

    def _build(self, node: _Node, then: int) -> int:
        """Add the states of a part that goes on with ``then``; return the first of them."""
        match node.kind:
            case "one":
                return self._add([then], re.compile(node.text, re.DOTALL if node.text != "." else 0))
            case "all":
                first = self._add([then])
                for part in reversed(node.parts):
                    first = self._build(part, first)
                return first
            case "any":
                return self._add([self._build(part, then) for part in node.parts])
            case "again":
                first = then
                if node.most is None:
                    first = self._add([then])
                    self._states[first].then.append(self._build(node.parts[0], first))
                for _ in range((node.most or 0) - node.least):
                    first = self._add([then, self._build(node.parts[0], first)])
                for _ in range(node.least):
                    first = self._build(node.parts[0], first)
                return first
        return self._add([then], anchor=node.kind)


@lru_cache(maxsize=1_024)
def pattern(text: str) -> Pattern:
    """Read a regular expression as Rust, Go and RE2 write them: no look-around, no references back.

    Raises:
        PatternError: it is none, or uses flags, word boundaries, named classes of characters or operators on them.
    """
    read = _Parser(text)
    root = read.choice(0)
    if read.at < len(text):
        raise PatternError("a `)` closes nothing")
    found = Pattern()
    found._add([])  # noqa: SLF001 - state 0 is the end
    found._first = found._build(root, 0)  # noqa: SLF001
    return found


class _Parser:
    def __init__(self, text: str) -> None:
        self.text = text
        self.at = 0

    def choice(self, depth: int) -> _Node:
        """Read what ends with the pattern or before a bracket."""
        if depth > _DEEPEST:
            raise PatternError(f"its brackets are nested deeper than {_DEEPEST}")
        ways = [self.row(depth)]
        while self.text.startswith("|", self.at):
            self.at += 1
            ways.append(self.row(depth))
        return ways[0] if len(ways) == 1 else _Node("any", parts=tuple(ways))

    def row(self, depth: int) -> _Node:
        """Read what follows each other."""
        parts: list[_Node] = []
        while self.at < len(self.text) and self.text[self.at] not in "|)":
            parts.append(self.repeated(self.one(depth)))
        return _Node("all", parts=tuple(parts))

    def repeated(self, part: _Node) -> _Node:
        """Read how often a part may come."""
        for _ in range(_DEEPEST):
            found = _QUANTIFIER.match(self.text, self.at)
            if found is None:
                return part
            self.at = found.end()
            least, most = {"*": (0, None), "+": (1, None), "?": (0, 1)}.get(found[1], (int(found[2] or 0), None))
            if found[2] is not None:
                most = int(found[4]) if found[4] else None if found[3] else least
            if max(least, most or 0) > _MOST_REPEATED or (most is not None and most < least):
                raise PatternError(f"`{found[0]}` is no range up to {_MOST_REPEATED}")
            part = _Node("again", "", (part,), least, most)
        raise PatternError("one repetition follows the other")

    def one(self, depth: int) -> _Node:
        """Read a character, a class of them, an anchor, or a group."""
        char = self.text[self.at]
        if char == "(":
            found = _GROUP.match(self.text, self.at)
            self.at = found.end() if found else self.at
            if self.text.startswith("?", self.at):
                raise PatternError(f"`({self.text[self.at : self.at + 2]}` is not read here: no flags, no look-around")
            inner = self.choice(depth + 1)
            if not self.text.startswith(")", self.at):
                raise PatternError("a `(` is not closed")
            self.at += 1
            return inner
        if char in _SPECIAL:
            raise PatternError(f"`{char}` has nothing to repeat")
        if char == "[":
            return self.a_class()
        token = self.text[self.at : self.at + 2] if char == "\\" else char
        self.at += len(token)
        if token in _ANCHORS:
            return _Node(_ANCHORS[token])
        if char == "\\" and not _ESCAPE.fullmatch(token):
            raise PatternError(f"`{token}` is not read here")
        return _Node("one", token if char in "\\." else re.escape(char))

    def a_class(self) -> _Node:
        """Read a class of characters in brackets."""
        found = _CLASS.match(self.text, self.at)
        if found is None or any(each in found[0] for each in _SET_OPERATORS):
            raise PatternError(f"`{self.text[self.at : self.at + 20]}` is no class of characters that is read here")
        self.at = found.end()
        try:
            re.compile(found[0])
        except re.error as error:
            raise PatternError(f"`{found[0]}`: {error.msg}") from None
        return _Node("one", found[0])
