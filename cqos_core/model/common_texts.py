"""Finds a text that several regular expressions allow, such as a name that all bridges of a circle carry.

It reads what programs write of RE2: characters, classes, groups, flags, anchors, alternatives, and repetitions. Of what it does not
read, such as classes of Unicode, and beyond a number of steps, it tries a few texts. RE2 itself confirms each text that is found.
"""

from __future__ import annotations

from itertools import chain, islice, product
from typing import TYPE_CHECKING, Final, NamedTuple

from cqos_core.model.re2_patterns import any_name_matcher
from cqos_core.model.regular_expressions import regular_expression

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator, Sequence
    from re import Pattern

_Ranges = tuple[tuple[int, int], ...]
_Kind = bool | None
"""What stands beside a place in a text: a character of a word, another one, or nothing."""
_LAST: Final = 0x10FFFF
_ANY: Final[_Ranges] = ((0, 9), (11, _LAST))  # RE2 takes `.` for all but a line feed
_CLASSES: Final[dict[str, _Ranges]] = {
    "d": ((48, 57),),
    "w": ((48, 57), (65, 90), (95, 95), (97, 122)),
    "s": ((9, 10), (12, 13), (32, 32)),
}
_NAMED_CLASSES: Final[dict[str, _Ranges]] = {
    "alnum": ((48, 57), (65, 90), (97, 122)),
    "alpha": ((65, 90), (97, 122)),
    "ascii": ((0, 127),),
    "blank": ((9, 9), (32, 32)),
    "cntrl": ((0, 31), (127, 127)),
    "digit": _CLASSES["d"],
    "graph": ((33, 126),),
    "lower": ((97, 122),),
    "print": ((32, 126),),
    "punct": ((33, 47), (58, 64), (91, 96), (123, 126)),
    "space": ((9, 13), (32, 32)),
    "upper": ((65, 90),),
    "word": _CLASSES["w"],
    "xdigit": ((48, 57), (65, 70), (97, 102)),
}
_CONTROLS: Final = {"a": 7, "f": 12, "n": 10, "r": 13, "t": 9, "v": 11}
_GUARDS: Final[dict[str, Callable[[_Kind, _Kind], bool]]] = {
    "^": lambda before, _: before is None,
    "$": lambda _, after: after is None,
    "b": lambda before, after: (before is True) is not (after is True),
    "B": lambda before, after: (before is True) is (after is True),
}
"""What may be passed without a character, and between what."""
_ANCHORS: Final = {"^": "^", "$": "$", r"\A": "^", r"\z": "$", r"\b": "b", r"\B": "B"}
_TIMES: Final = regular_expression(r"\{([0-9]+)(?:(,)([0-9]*))?\}")
_FLAGS: Final = regular_expression(r"\?([imsU]*)(?:-([imsU]+))?([:)])")
_GROUP_NAME: Final = regular_expression(r"\?P?<\w+>")
_NAMED_CLASS: Final = regular_expression(r"\[:(\^?)([a-z]+):\]")
_NUMBER: Final = regular_expression(r"x([0-9A-Fa-f]{2})|x\{([0-9A-Fa-f]+)\}|(0[0-7]{0,2}|[1-7][0-7]{1,2})")
_PLAIN_RUN: Final = regular_expression(r"[\w/.:~-]+")
_ESCAPE: Final = regular_expression(r"\\(?:[pP](?:\{[^}]*\}|.)|(\W)|.)")
_MOST_STATES: Final = 5_000
_MOST_STEPS: Final = 5_000
_MOST_VISITS: Final = 1_000_000
_MOST_GUESSES: Final = 2_000
_MOST_FOLDED: Final = 2_000
_PLAIN: Final = ord("x")
_BLANK: Final = ord(" ")
_SAMPLES: Final = ("", "x", "X", "1", "_", "\u00e9", "\u03b1", "\u044f", "\u4e2d", "x/x")
"""Texts to try where an expression is not read: letters of several scripts, a digit, two levels."""


class Allowed(NamedTuple):
    """Texts of which the whole of ``before``, the text and ``after`` matches one of ``only``, if there are any, and none of ``but``."""

    before: str
    after: str
    only: tuple[str, ...]
    but: tuple[str, ...]

    def __call__(self, text: str) -> bool:
        """Whether this allows a text, by RE2."""
        whole = f"{self.before}{text}{self.after}"
        return (not self.only or any_name_matcher(self.only)(whole)) and not any_name_matcher(self.but)(whole)


def common_text(conditions: Iterable[Allowed]) -> str | None:
    """Return a text of at least one character that all conditions allow, a shortest one if all is read; None if none is found."""
    conditions = [*conditions]
    unread: list[str] = []
    gates = [gate for each in conditions for gate in _gates(each, unread)]
    try:
        found = _shortest(gates)
    except _TooLargeError:
        found = None
    else:
        if found is None and not unread:
            return None
    guesses = islice(_guesses(conditions), _MOST_GUESSES)
    return next(
        (
            text
            for text in chain(() if found is None else (found,), guesses)
            if all(allows(text) for allows in conditions)
        ),
        None,
    )


class _TooLargeError(Exception):
    """An automaton has too many states, or takes too many steps."""


def _shortest(gates: Sequence[_Gate]) -> str | None:
    """Return a shortest text that all automata let through; None if there is none.

    Raises:
        _TooLargeError: it takes too many steps.
    """
    letters = _letters(gates)
    start = tuple(gate.start for gate in gates)
    texts = {start: ""}
    waiting = [start]
    visits = 0
    for places in waiting:
        visits += len(letters) * sum(len(each.states) for each in places)
        if visits > _MOST_VISITS:
            raise _TooLargeError
        for letter in letters:
            following = tuple(gate.machine.step(own, letter) for gate, own in zip(gates, places, strict=True))
            if any(not own.states and not gate.refuses for gate, own in zip(gates, following, strict=True)):
                continue
            if all(gate.lets_end(own) for gate, own in zip(gates, following, strict=True)):
                return texts[places] + chr(letter)
            if following not in texts:
                if len(texts) >= _MOST_STEPS:
                    raise _TooLargeError
                texts[following] = texts[places] + chr(letter)
                waiting.append(following)
    return None


def _guesses(conditions: Sequence[Allowed]) -> Iterator[str]:
    """Yield texts that conditions may allow: what stands in their expressions as it is, with something before or behind it."""
    written = [text for each in conditions for text in (*each.only, *each.but)]
    plain = dict.fromkeys(run for text in written for run in _PLAIN_RUN.findall(_ESCAPE.sub(r"\1", text)))
    for before, run, after in product(_SAMPLES, ("", *plain), _SAMPLES):
        whole = f"{before}{run}{after}"
        for each in conditions:
            if whole.startswith(each.before) and whole.endswith(each.after):
                part = whole[len(each.before) : len(whole) - len(each.after)]
                if part:
                    yield part
        if whole:
            yield whole


class _Place(NamedTuple):
    """Where an automaton stands: its states, and what stands before them, if it asks."""

    states: frozenset[int]
    before: _Kind


class _Gate(NamedTuple):
    """One automaton, where it stands before the text, what follows the text, and whether it refuses what it matches."""

    machine: _Machine
    start: _Place
    after: str
    refuses: bool

    def lets_end(self, place: _Place) -> bool:
        for character in self.after:
            place = self.machine.step(place, ord(character))
        return self.machine.ends(place) is not self.refuses


def _gates(condition: Allowed, unread: list[str]) -> Iterator[_Gate]:
    """Yield the automata of a condition; expressions that are not read are left out, and added to ``unread``."""
    for expressions, refuses in ((condition.only, False), (condition.but, True)):
        machine, read = _Machine(), len(expressions)
        for text in expressions:
            try:
                machine.add(text)
            except ValueError:
                unread.append(text)
                read -= 1
        if read:
            place = machine.start_place()
            for character in condition.before:
                place = machine.step(place, ord(character))
            yield _Gate(machine, place, condition.after, refuses)


def _letters(gates: Sequence[_Gate]) -> list[int]:
    """Return one character for each set of characters that no automaton tells apart; `x` first, if it is one."""
    marks = {_PLAIN, _PLAIN + 1}
    for gate in gates:
        told = [ranges for moves in gate.machine.moves for ranges, _ in moves]
        if gate.machine.guards:
            told.append(_CLASSES["w"])
        for ranges in told:
            marks.update(mark for low, high in ranges for mark in (low, high + 1))
    return sorted(
        (mark for mark in marks if _PLAIN == mark or _BLANK < mark <= _LAST), key=lambda each: (each != _PLAIN, each)
    )


class _Machine:
    """A nondeterministic automaton of the texts that match one of several expressions as a whole (Thompson's construction)."""

    def __init__(self) -> None:
        self.free: list[list[int]] = []
        self.moves: list[list[tuple[_Ranges, int]]] = []
        self.guards: dict[int, list[tuple[Callable[[_Kind, _Kind], bool], int]]] = {}
        self.start, self.end = self.state(), self.state()

    def add(self, text: str) -> None:
        """Add an expression.

        Raises:
            ValueError: it is not read here, or too large.
        """
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

    def start_place(self) -> _Place:
        """Return where it stands at first."""
        return _Place(self._closed({self.start}), None)

    def step(self, place: _Place, letter: int) -> _Place:
        """Return where it stands after one more character."""
        kind = any(low <= letter <= high for low, high in _CLASSES["w"]) if self.guards else None
        states = self._closed(
            {
                target
                for state in self._passed(place, kind)
                for ranges, target in self.moves[state]
                if any(low <= letter <= high for low, high in ranges)
            }
        )
        return _Place(states, kind)

    def ends(self, place: _Place) -> bool:
        """Whether what led to a place matches as a whole."""
        return self.end in self._passed(place, None)

    def _passed(self, place: _Place, after: _Kind) -> frozenset[int]:
        """Return the states with those behind guards that let pass between what stands before and after."""
        return self._closed({*place.states}, (place.before, after)) if self.guards else place.states

    def _closed(self, states: set[int], between: tuple[_Kind, _Kind] | None = None) -> frozenset[int]:
        """Return states with those that are reached without a character."""
        waiting = list(states)
        while waiting:
            state = waiting.pop()
            further = [each for each in self.free[state] if each not in states]
            if between is not None:
                guarded = self.guards.get(state, ())
                further += [each for lets_pass, each in guarded if each not in states and lets_pass(*between)]
            states.update(further)
            waiting += further
        return frozenset(states)


class _Expression:
    """Reads one expression into an automaton; each method returns the first and the last state of what it read."""

    def __init__(self, machine: _Machine, text: str) -> None:
        self.machine = machine
        self.text = text
        self.at = 0
        self.folds = False  # upper and lower case are the same
        self.any: _Ranges = _ANY

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
            written = self.matches(_TIMES)
            if written is None:
                return found
            least, comma, most = written
            number = int(least or "")
            found = number, int(most) if most else (None if comma else number)
        self.takes("?")  # as little as possible, which matches the same whole texts
        return found

    def part(self) -> tuple[int, int]:
        for anchor, name in _ANCHORS.items():
            if self.takes(anchor):
                first, last = self.machine.state(), self.machine.state()
                self.machine.guards.setdefault(first, []).append((_GUARDS[name], last))
                return first, last
        if self.takes("("):
            return self.group()
        ranges = self.characters()
        first, last = self.machine.state(), self.machine.state()
        self.machine.moves[first].append((ranges, last))
        return first, last

    def group(self) -> tuple[int, int]:
        """Read what follows a bracket; flags hold up to its end, those without a colon up to the end of the group around them."""
        outer = self.folds, self.any
        flags = None if self.matches(_GROUP_NAME) else self.matches(_FLAGS)
        if flags is not None:
            on, off, sign = flags
            self.folds = ("i" in (on or "") or self.folds) and "i" not in (off or "")
            self.any = _ANY if "s" in (off or "") else ((0, _LAST),) if "s" in (on or "") else self.any
            if sign == ")":
                state = self.machine.state()
                return state, state
        found = self.alternatives()
        if not self.takes(")"):
            raise ValueError("a bracket too few")
        self.folds, self.any = outer
        return found

    def characters(self) -> _Ranges:
        character = self.next()
        if character == ".":
            return self.any
        if character == "[":
            return self.listed()
        if character == "\\":
            return self.folded(self.escaped())
        if character in "*+?":
            raise ValueError("a sign that is not read")
        return self.folded(((ord(character), ord(character)),))

    def folded(self, ranges: _Ranges) -> _Ranges:
        """Return characters with those that differ from them in case only, if that does not count here.

        Raises:
            ValueError: there are too many.
        """
        if not self.folds:
            return ranges
        if sum(high - low for low, high in ranges) > _MOST_FOLDED:
            raise ValueError("too large")
        same = {ord(each) for low, high in ranges for code in range(low, high + 1) for each in _cases(chr(code))}
        return (*ranges, *((each, each) for each in sorted(same)))

    def escaped(self) -> _Ranges:
        number = self.matches(_NUMBER)
        if number is not None:
            short, long, octal = number
            code = int(short or long or octal or "", 8 if octal else 16)
            return ((code, code),)
        character = self.next()
        if character.lower() in _CLASSES:
            ranges = _CLASSES[character.lower()]
            return ranges if character.islower() else _others(ranges)
        if character in _CONTROLS:
            return ((_CONTROLS[character], _CONTROLS[character]),)
        if character.isalnum():
            raise ValueError("an escape that is not read")
        return ((ord(character), ord(character)),)

    def listed(self) -> _Ranges:
        none_of = self.takes("^")
        found: list[tuple[int, int]] = []
        while not (found and self.takes("]")):
            named = self.matches(_NAMED_CLASS)
            if named is not None:
                none_of_these, name = named
                if name not in _NAMED_CLASSES:
                    raise ValueError("a class that is not read")
                found += _others(_NAMED_CLASSES[name]) if none_of_these else _NAMED_CLASSES[name]
                continue
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
        ranges = self.folded(tuple(found))
        return _others(ranges) if none_of else ranges

    def next(self) -> str:
        if self.at >= len(self.text):
            raise ValueError("it ends too early")
        self.at += 1
        return self.text[self.at - 1]

    def matches(self, expected: Pattern[str]) -> tuple[str | None, ...] | None:
        """Return the groups of an expression that matches here, and go on behind it; None if it does not."""
        found = expected.match(self.text, self.at)
        if found is None:
            return None
        self.at = found.end()
        return found.groups()

    def takes(self, sign: str) -> bool:
        """Whether a sign stands here; if so, go on behind it."""
        found = self.text.startswith(sign, self.at)
        self.at += len(sign) if found else 0
        return found


def _cases(character: str) -> set[str]:
    """Return a character in both cases, as far as each is one character."""
    both = {character.lower(), character.upper(), character.lower().upper(), character.upper().lower()}
    return {each for each in both if len(each) == 1}


def _others(ranges: Iterable[tuple[int, int]]) -> _Ranges:
    """Return the characters that are in none of some ranges."""
    found, begin = [], 0
    for low, high in sorted(ranges):
        if begin < low:
            found.append((begin, low - 1))
        begin = max(begin, high + 1)
    return (*found, (begin, _LAST)) if begin <= _LAST else tuple(found)
