"""Topic names and filters: which are valid, which meet, and a fast index for 100,000 of each.

`+` stands for one level, also an empty one, `#` at the end for all further levels, also none. A level of wildcards at the
start meets no name that begins with `$` (MQTT 3.1.1 and 5.0, 4.7).
"""

from __future__ import annotations

from collections.abc import Collection, Iterable, Iterator, Sequence
from typing import Final, NamedTuple

LONGEST: Final = 65_535
"""Bytes of UTF-8 that a name or a filter may have."""
SHARE: Final = "$share/"
ONE: Final = "+"
REST: Final = "#"


class Share(NamedTuple):
    """The two parts of a shared subscription."""

    group: str
    filter: str


def share(written: str) -> Share | None:
    """Take ``$share/group/filter`` apart; None where it is none, however badly it is written."""
    if not written.startswith(SHARE):
        return None
    group, _, rest = written.removeprefix(SHARE).partition("/")
    return Share(group, rest)


def bare(written: str) -> str:
    """Return the filter that decides what a subscription meets."""
    shared = share(written)
    return written if shared is None else shared.filter


def has_wildcards(written: str) -> bool:
    """Whether some level of a filter stands for others."""
    return ONE in written or REST in written


def wrong_with_name(name: str) -> str | None:
    """Say what keeps a text from being the name of a topic, None where nothing does."""
    return _first(
        (has_wildcards(name), "it has a wildcard, and a message goes to one topic only"),
        (name.startswith(SHARE), f"it begins with `{SHARE}`, which belongs to shared subscriptions"),
        *_wrong_text(name),
    )


def wrong_with_filter(written: str) -> str | None:
    """Say what keeps a text from being a filter, None where nothing does."""
    group, own = share(written) or ("-", written)
    in_share = _first(
        (written.rstrip("/") == SHARE.rstrip("/"), "a shared subscription is `$share/group/filter`"),
        (not group, "the name of its share group is empty"),
        (has_wildcards(group), f"the name of its share group, `{group}`, has a wildcard"),
        (not own and own != written, "nothing follows the name of its share group"),
        *_wrong_text(written),
    )
    return in_share or wrong_wildcards(own)


def wrong_wildcards(written: str) -> str | None:
    """Say which wildcard is not where it may be."""
    levels = written.split("/")
    parts = (level for level in levels if has_wildcards(level) and len(level) > 1)
    return _first(
        (any(REST in level for level in levels[:-1]), "`#` stands for the rest, so it can only be the last level"),
        *((True, f"a wildcard is a whole level, not a part of one as in `{level}`") for level in parts),
    )


def _wrong_text(text: str) -> tuple[tuple[bool, str], ...]:
    return (
        (not text, "it is empty"),
        ("\0" in text, "it has the character U+0000"),
        (any("\ud800" <= each <= "\udfff" for each in text), "it has half a character, which UTF-8 cannot say"),
        (len(text.encode(errors="replace")) > LONGEST, f"it has more than {LONGEST} bytes"),
    )


def _first(*said: tuple[bool, str]) -> str | None:
    """Return what there is to say of the first thing that is wrong."""
    return next((message for wrong, message in said if wrong), None)


def matches(written: str, name: str) -> bool:
    """Whether a filter, also a shared one, matches the name of a topic."""
    levels, names = bare(written).split("/"), name.split("/")
    if name.startswith("$") and levels[0] in {ONE, REST}:
        return False
    for position, level in enumerate(levels):
        if level == REST:
            return True
        if position == len(names) or level not in {ONE, names[position]}:
            return False
    return len(levels) == len(names)


def intersect(one: str, other: str) -> bool:
    """Whether some topic matches both filters."""
    one, other = bare(one), bare(other)
    left, right = one.split("/"), other.split("/")
    if {one, other} == _EMPTY_ONLY:
        return False
    if _apart_by_dollar(left[0], right[0]) or _apart_by_dollar(right[0], left[0]):
        return False
    for a, b in zip(left, right, strict=False):
        if REST in {a, b}:
            return True
        if a != b and ONE not in {a, b}:
            return False
    if len(left) == len(right):
        return True
    # What is left over of the longer one may be nothing only if it is `#`.
    longer, shorter = (left, right) if len(left) > len(right) else (right, left)
    return longer[len(shorter)] == REST


def intersection(one: str, other: str) -> str | None:
    """Return the filter of all topics that match both of two filters; None where there is none."""
    if not intersect(one, other):
        return None
    left, right = bare(one).split("/"), bare(other).split("/")
    levels: list[str] = []
    for position in range(max(len(left), len(right))):
        a, b = (each[position] if position < len(each) else REST for each in (left, right))
        if REST in {a, b}:
            # `a/#` matches `a` too, so beside a filter that ends here only that is common.
            ends = len(left) == position or len(right) == position
            rest = right if a == REST else left
            return "/".join(levels if ends else (*levels, *rest[position:]))
        levels.append(b if a == ONE else a)
    return "/".join(levels)


_EMPTY_ONLY: Final = frozenset(("/#", "+"))
"""Two filters that both match the empty name, which no topic has, and have no other in common."""


def _apart_by_dollar(first: str, other: str) -> bool:
    return first.startswith("$") and other in {ONE, REST}


class _Node:
    """One level of the trie: what may follow, and the filters that end here, with or without a `#` after it."""

    __slots__ = ("below", "ending", "one", "rest")

    def __init__(self) -> None:
        self.below: dict[str, _Node] = {}
        self.one: _Node | None = None
        self.ending: list[str] = []
        self.rest: list[str] = []

    def follow(self, level: str) -> _Node:
        """Return the node of a further level, made where it is not there."""
        if level == ONE:
            if self.one is None:
                self.one = _Node()
            return self.one
        node = self.below.get(level)
        if node is None:
            node = self.below[level] = _Node()
        return node

    def everything(self) -> Iterator[str]:
        """Yield all filters here and below."""
        waiting = [self]
        while waiting:
            node = waiting.pop()
            yield from node.ending
            yield from node.rest
            waiting += node.below.values()
            if node.one is not None:
                waiting.append(node.one)


class Trie:
    """Filters by their levels, so that a name finds those that match it without looking at the others."""

    def __init__(self, filters: Iterable[str] = ()) -> None:
        """Hold ``filters``, shared ones among them."""
        self.root = _Node()
        for written in filters:
            self.add(written)

    def add(self, written: str) -> None:
        """Add a filter."""
        *levels, last = bare(written).split("/")
        node = self.root
        for level in levels:
            node = node.follow(level)
        if last == REST:
            node.rest.append(written)
        else:
            node.follow(last).ending.append(written)

    def matching(self, name: str) -> Iterator[str]:
        """Yield the filters that match the name of a topic."""
        levels = name.split("/")
        reached = [self.root]
        for position, level in enumerate(levels):
            wild = position > 0 or not name.startswith("$")
            following: list[_Node] = []
            for node in reached:
                if wild:
                    yield from node.rest
                    if node.one is not None:
                        following.append(node.one)
                below = node.below.get(level)
                if below is not None:
                    following.append(below)
            reached = following
        for node in reached:
            yield from node.ending
            yield from node.rest

    def intersecting(self, pattern: str) -> Iterator[str]:
        """Yield the filters that have a topic in common with another filter."""
        own = bare(pattern)
        found = self._intersecting(own.split("/"))
        if own not in _EMPTY_ONLY:
            return found
        return (each for each in found if bare(each) == own or bare(each) not in _EMPTY_ONLY)

    def _intersecting(self, levels: Sequence[str]) -> Iterator[str]:
        reached = [self.root]
        for position, level in enumerate(levels):
            start = position == 0
            if level == REST:
                yield from self._all(reached, start=start)
                return
            following: list[_Node] = []
            for node in reached:
                if not (start and level.startswith("$")):
                    yield from node.rest
                    if node.one is not None:
                        following.append(node.one)
                if level == ONE:
                    following += [each for name, each in node.below.items() if not (start and name.startswith("$"))]
                elif level in node.below:
                    following.append(node.below[level])
            reached = following
        for node in reached:
            yield from node.ending
            yield from node.rest

    def _all(self, nodes: Iterable[_Node], *, start: bool) -> Iterator[str]:
        """Yield what a `#` has a topic in common with."""
        for node in nodes:
            if not start:
                yield from node.everything()
                continue
            yield from node.rest
            yield from () if node.one is None else node.one.everything()
            for name, below in node.below.items():
                if not name.startswith("$"):
                    yield from below.everything()


def match(publishers: Collection[str], subscribers: Collection[str]) -> Iterator[tuple[str, str]]:
    """Yield all pairs of a published name, or pattern of names, and a different filter that meets it."""
    # A filter without wildcards meets its own name only, save where names are patterns or it is a share.
    patterns = any(map(has_wildcards, publishers))
    trie = Trie(each for each in subscribers if patterns or has_wildcards(each) or each.startswith(SHARE))
    for published in publishers:
        found = trie.intersecting(published) if has_wildcards(published) else trie.matching(published)
        for written in found:
            if written != published:
                yield published, written
