"""Finds a text that several regular expressions allow, such as a name that all bridges of a circle carry.

It reads what programs commonly write of RE2: characters, classes, groups, alternatives, and repetitions. Beyond that, and beyond a
number of steps, it finds nothing.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Final, NamedTuple

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Sequence

_Ranges = tuple[tuple[int, int], ...]
_LAST: Final = 0x10FFFF
_ANY: Final[_Ranges] = ((0, 9), (11, _LAST))  # RE2 takes `.` for all but a line feed
_CLASSES: Final[dict[str, _Ranges]] = {
    "d": ((48, 57),),
    "w": ((48, 57), (65, 90), (95, 95), (97, 122)),
    "s": ((9, 10), (12, 13), (32, 32)),
}
_MOST_STATES: Final = 5_000
_MOST_STEPS: Final = 5_000
_MOST_TIMES: Final = 100
_PLAIN: Final = ord("x")
_BLANK: Final = ord(" ")


class Allowed(NamedTuple):
    """Texts of which the whole of ``before``, the text and ``after`` matches one of ``only``, if there are any, and none of ``but``."""

    before: str
    after: str
    only: tuple[str, ...]
    but: tuple[str, ...]


def common_text(conditions: Iterable[Allowed]) -> str | None:
    """Return a shortest text of at least one character that all conditions allow; None if none is found."""
    try:
        gates = [gate for each in conditions for gate in _gates(each)]
    except ValueError:
        return None
    letters = _letters(gates)
    start = tuple(gate.start for gate in gates)
    texts = {start: ""}
    waiting = [start]
    for states in waiting:
        for letter in letters:
            following = tuple(gate.machine.step(own, letter) for gate, own in zip(gates, states, strict=True))
            if any(not own and not gate.refuses for gate, own in zip(gates, following, strict=True)):
                continue
            if all(gate.lets_end(own) for gate, own in zip(gates, following, strict=True)):
                return texts[states] + chr(letter)
            if following not in texts:
                if len(texts) >= _MOST_STEPS:
                    return None
                texts[following] = texts[states] + chr(letter)
                waiting.append(following)
    return None


class _Gate(NamedTuple):
    """One automaton, where it stands before the text, what follows the text, and whether it refuses what it matches."""

    machine: _Machine
    start: frozenset[int]
    after: str
    refuses: bool

    def lets_end(self, states: frozenset[int]) -> bool:
        for character in self.after:
            states = self.machine.step(states, ord(character))
        return (self.machine.end in states) is not self.refuses


def _gates(condition: Allowed) -> Iterator[_Gate]:
    for expressions, refuses in ((condition.only, False), (condition.but, True)):
        if expressions:
            machine = _Machine(expressions)
            states = machine.closed({machine.start})
            for character in condition.before:
                states = machine.step(states, ord(character))
            yield _Gate(machine, states, condition.after, refuses)


def _letters(gates: Sequence[_Gate]) -> list[int]:
    """Return one character for each set of characters that no automaton tells apart; `x` first, if it is one."""
    marks = {_PLAIN, _PLAIN + 1}
    for gate in gates:
        for moves in gate.machine.moves:
            for ranges, _ in moves:
                marks.update(mark for low, high in ranges for mark in (low, high + 1))
    return sorted(
        (mark for mark in marks if _PLAIN == mark or _BLANK < mark <= _LAST), key=lambda each: (each != _PLAIN, each)
    )


class _Machine:
    """A nondeterministic automaton of the texts that match one of several expressions as a whole (Thompson's construction)."""

    def __init__(self, expressions: Sequence[str]) -> None:
        self.free: list[list[int]] = []
        self.moves: list[list[tuple[_Ranges, int]]] = []
        self.start, self.end = self.state(), self.state()
        for text in expressions:
            first, last = _Expression(self, text).whole()
            self.free[self.start].append(first)
            self.free[last].append(self.end)

    def state(self) -> int:
        """Add a state.

        Raises:
            ValueError: there are too many.
        """
        if len(self.free) >= _MOST_STATES:
            raise ValueError("too large")
        self.free.append([])
        self.moves.append([])
        return len(self.free) - 1

    def closed(self, states: set[int]) -> frozenset[int]:
        """Return states with those that are reached without a character."""
        waiting = list(states)
        while waiting:
            further = [each for each in self.free[waiting.pop()] if each not in states]
            states.update(further)
            waiting += further
        return frozenset(states)

    def step(self, states: frozenset[int], letter: int) -> frozenset[int]:
        """Return the states after one more character."""
        return self.closed(
            {
                target
                for state in states
                for ranges, target in self.moves[state]
                if any(low <= letter <= high for low, high in ranges)
            }
        )


class _Expression:
    """Reads one expression into an automaton; each method returns the first and the last state of what it read."""

    def __init__(self, machine: _Machine, text: str) -> None:
        self.machine = machine
        self.text = text
        self.at = 0

    def whole(self) -> tuple[int, int]:
        """Read all of it.

        Raises:
            ValueError: it has what is not read here.
        """
        found = self.alternatives()
        if self.at < len(self.text):
            raise ValueError("a bracket too many")
        return found

    def alternatives(self) -> tuple[int, int]:
        first, last = self.machine.state(), self.machine.state()
        while True:
            begin, end = self.sequence()
            self.machine.free[first].append(begin)
            self.machine.free[end].append(last)
            if not self.takes("|"):
                return first, last

    def sequence(self) -> tuple[int, int]:
        first = last = self.machine.state()
        while self.at < len(self.text) and self.text[self.at] not in "|)":
            begin, end = self.repeated()
            self.machine.free[last].append(begin)
            last = end
        return first, last

    def repeated(self) -> tuple[int, int]:
        begin_at = self.at
        first, last = self.part()
        least, most = self.times()
        if (least, most) == (1, 1):
            return first, last
        end_at = self.at
        begin = end = self.machine.state()
        for number in range(least + 1 if most is None else most):
            self.at = begin_at
            first, last = self.part()
            self.machine.free[end].append(first)
            following = self.machine.state()
            self.machine.free[last].append(following)
            if number >= least:
                self.machine.free[end].append(following)
                if most is None:
                    self.machine.free[last].append(first)
            end = following
        self.at = end_at
        return begin, end

    def times(self) -> tuple[int, int | None]:
        """Read how often a part may come; None: as often as one likes."""
        found: tuple[int, int | None] = (1, 1)
        for sign, times in (("*", (0, None)), ("+", (1, None)), ("?", (0, 1))):
            if self.takes(sign):
                found = times
                break
        else:
            if not self.takes("{"):
                return found
            written, brace, _ = self.text[self.at :].partition("}")
            least, comma, most = written.partition(",")
            if not (brace and least.isdecimal() and (most.isdecimal() or not most)):
                raise ValueError("a repetition that is not read")
            found = int(least), int(most) if most else (None if comma else int(least))
            if max(found[0], found[1] or 0) > _MOST_TIMES:
                raise ValueError("too large")
            self.at += len(written) + 1
        self.takes("?")  # as little as possible, which matches the same whole texts
        return found

    def part(self) -> tuple[int, int]:
        if self.takes("("):
            if self.takes("?") and not self.takes(":"):
                raise ValueError("a group that is not read")
            found = self.alternatives()
            if not self.takes(")"):
                raise ValueError("a bracket too few")
            return found
        ranges = self.characters()
        first, last = self.machine.state(), self.machine.state()
        self.machine.moves[first].append((ranges, last))
        return first, last

    def characters(self) -> _Ranges:
        character = self.next()
        if character == ".":
            return _ANY
        if character == "[":
            return self.listed()
        if character == "\\":
            return self.escaped()
        if character in "^$*+?{":
            raise ValueError("a sign that is not read")
        return ((ord(character), ord(character)),)

    def escaped(self) -> _Ranges:
        character = self.next()
        if character.lower() in _CLASSES:
            ranges = _CLASSES[character.lower()]
            return ranges if character.islower() else _others(ranges)
        if character.isalnum():
            raise ValueError("an escape that is not read")
        return ((ord(character), ord(character)),)

    def listed(self) -> _Ranges:
        none_of = self.takes("^")
        found: list[tuple[int, int]] = []
        while not (found and self.takes("]")):
            if self.text.startswith("[:", self.at):
                raise ValueError("a class that is not read")
            character = self.next()
            ranges = self.escaped() if character == "\\" else ((ord(character), ord(character)),)
            if (
                len(ranges) == 1
                and self.text[self.at : self.at + 1] == "-"
                and self.text[self.at + 1 : self.at + 2] not in {"]", ""}
            ):
                self.at += 1
                last = self.next()
                end = self.escaped()[0][0] if last == "\\" else ord(last)
                ranges = ((ranges[0][0], end),)
            found += ranges
        return _others(found) if none_of else tuple(found)

    def next(self) -> str:
        if self.at >= len(self.text):
            raise ValueError("it ends too early")
        self.at += 1
        return self.text[self.at - 1]

    def takes(self, sign: str) -> bool:
        """Whether a sign stands here; if so, go on behind it."""
        found = self.text.startswith(sign, self.at)
        self.at += len(sign) if found else 0
        return found


def _others(ranges: Iterable[tuple[int, int]]) -> _Ranges:
    """Return the characters that are in none of some ranges."""
    found, begin = [], 0
    for low, high in sorted(ranges):
        if begin < low:
            found.append((begin, low - 1))
        begin = max(begin, high + 1)
    return (*found, (begin, _LAST)) if begin <= _LAST else tuple(found)
