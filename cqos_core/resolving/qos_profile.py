"""The values of endpoints: those with equal values share one interned `QosProfile`."""

from __future__ import annotations

from functools import cache, lru_cache
from threading import Lock
from typing import TYPE_CHECKING, Any, Final, TypeVar
from weakref import WeakValueDictionary

from cqos_core.language.domains import Names, Text
from cqos_core.language.policy import NO, UNMATCHED, Policy
from cqos_core.language.values import KNOWN, UNREAD, Anything, Depends, FromPeers, Value, is_plain
from cqos_core.model.caches import MAXIMUM_REMEMBERED
from cqos_core.model.dataclass import dataclass

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping

    from cqos_core.language.values import Plain, Values, WrittenValue
    from cqos_core.packs.pack import RulePack


_Value = TypeVar("_Value")


class _Interned:
    """Base of interned objects: equal ones are one object as long as something uses it."""

    __slots__ = ("__weakref__",)


@dataclass(frozen=True, slots=True, eq=False)
class ProfileFrame(_Interned):
    """The part that profiles share if only known values of endpoints differ; equal frames are one object.

    Attributes:
        open: values that are not known, by index.
        options: values of the pack's options, by index.
        unmatched: indices of policies that the middleware in use does not match on.
        from_peers: indices of values that `settle` takes from the other side.
        needs: the guarantees that are needed.
        deciding: where a value decides more of a profile than itself.
    """

    open: Mapping[int, Any]
    options: Mapping[int, Any]
    unmatched: frozenset[int]
    from_peers: tuple[int, ...]
    needs: frozenset[str]
    deciding: frozenset[int]


class QosProfile(_Interned):
    """The values of one endpoint, shared by all endpoints with equal ones and compared by identity.

    Attributes:
        known: one value per policy of the pack, then one `WrittenValue` or None per policy; where one is not known, something
            of its type stands in for it.
        frame: unknown values, and values that decide the meaning of others.
        beside: codes of the findings about settings beside the values that are not understood.
        refused: codes of errors for which no pair of the endpoint works, beside those of the rules over its values.
        unread: those of `beside`, and of the findings about values that are not: no pair is compatible by ignorance of either.
    """

    __slots__ = ("_values", "beside", "frame", "known", "pack", "refused", "unread")

    def __init__(
        self,
        pack: RulePack,
        known: Values,
        frame: ProfileFrame,
        beside: tuple[str, ...] = (),
        refused: tuple[str, ...] = (),
        unread: tuple[str, ...] = (),
    ) -> None:
        """Take all of it; only `intern` and its own methods make profiles."""
        self.pack = pack
        self.known = known
        self.frame = frame
        self.beside = beside
        self.refused = refused
        self.unread = unread
        self._values: Values | None = None if frame.open else known

    @property
    def values(self) -> Values:
        """The known values, and those that are not known."""
        if self._values is None:
            every = [*self.known]
            for index, value in self.frame.open.items():
                every[index] = value
            self._values = tuple(every)
        return self._values

    @property
    def unmatched(self) -> frozenset[int]:
        """Indices of policies that the middleware in use does not match on."""
        return self.frame.unmatched

    @property
    def ignored(self) -> frozenset[int]:
        """Indices of policies that the middleware in use ignores."""
        return _treated_as(self.pack, NO, tuple([self.values[option] for option in _deciding(self.pack)]))

    @property
    def from_peers(self) -> tuple[int, ...]:
        """Indices of values that `settle` takes from the other side."""
        return self.frame.from_peers

    @property
    def needs(self) -> frozenset[str]:
        """The guarantees that are needed."""
        return self.frame.needs

    def with_values(
        self,
        changes: Mapping[int, Value | WrittenValue | None],
        beside: Iterable[str] = (),
        refused: Iterable[str] = (),
    ) -> QosProfile:
        """Return the interned profile with some values replaced, and with more codes beside them."""
        size = self.pack.vocabulary.size
        known = all(type(v) in KNOWN if at < size else v is not UNREAD for at, v in changes.items())
        plainly = known and not beside and not refused and self.frame.deciding.isdisjoint(changes)
        every = [*(self.known if plainly else self.values)]
        for index, value in changes.items():
            every[index] = value
        if plainly:
            return self.with_known(tuple(every))
        return intern(self.pack, tuple(every), (*self.beside, *beside), (*self.refused, *refused))

    def with_known(self, known: Values) -> QosProfile:
        """Return the interned profile with other known values, none of them at `ProfileFrame.deciding`."""
        # Most are new, and to make one in vain costs less than to hash all values twice.
        profile = QosProfile(self.pack, known, self.frame, self.beside, self.refused, self.unread)
        return _interned(_PROFILES, (known, self.frame, self.beside, self.refused), profile)


_PROFILES: Final[WeakValueDictionary[tuple[object, ...], QosProfile]] = WeakValueDictionary()
_FRAMES: Final[WeakValueDictionary[tuple[object, ...], ProfileFrame]] = WeakValueDictionary()
_INTERNING: Final = Lock()


def _interned(memory: WeakValueDictionary[tuple[object, ...], _Value], key: tuple[object, ...], made: _Value) -> _Value:
    """Return the one object for a key, of two threads too: unlike that of a dict, this `setdefault` is several steps."""
    with _INTERNING:
        return memory.setdefault(key, made)


def intern(pack: RulePack, values: Values, beside: Iterable[str] = (), refused: Iterable[str] = ()) -> QosProfile:
    """Return the one `QosProfile` of ``pack`` with these values and codes."""
    beside, refused = tuple(sorted({*beside})), tuple(sorted({*refused}))
    size = pack.vocabulary.size
    opened = {
        index: value
        for index, value in enumerate(values)
        if (type(value) not in KNOWN if index < size else value is UNREAD)
    }
    known = values
    if opened:
        known = tuple([_stand_in(pack, at) if at in opened else value for at, value in enumerate(values)])
    frame = _frame(pack, values, opened)
    key = (known, frame, beside, refused)
    profile = _PROFILES.get(key)
    if profile is None:
        codes = {value.code for value in opened.values() if isinstance(value, Anything) and value.code}
        profile = QosProfile(pack, known, frame, beside, refused, tuple(sorted({*beside, *codes})))
        profile = _interned(_PROFILES, key, profile)
    return profile


def _frame(pack: RulePack, values: Values, opened: Mapping[int, Any]) -> ProfileFrame:
    options = {index: values[index] for index in _options(pack)}
    needs = frozenset(name for name, (index, nothing) in pack.needs.items() if values[index] != nothing)
    key = (pack, tuple(opened.items()), tuple(options.values()), needs)
    found = _FRAMES.get(key)
    if found is None:
        from_peers = tuple(index for index, value in opened.items() if isinstance(value, FromPeers))
        unmatched = _treated_as(pack, UNMATCHED, tuple([values[index] for index in _deciding(pack)]))
        deciding = frozenset((*opened, *options, *(index for index, _ in pack.needs.values())))
        found = _interned(_FRAMES, key, ProfileFrame(opened, options, unmatched, from_peers, needs, deciding))
    return found


@cache
def _options(pack: RulePack) -> tuple[int, ...]:
    return tuple(index for index, policy in enumerate(pack.policies) if policy.level == "option")


def _stand_in(pack: RulePack, index: int) -> Plain | None:
    """Return a placeholder for an unknown value, so that conditions can be evaluated; their answer is not used."""
    if index >= pack.vocabulary.size:
        return None
    domain = pack.policies[index].domain
    return () if isinstance(domain, Names) else "" if isinstance(domain, Text) else 0


@cache
def _deciding(pack: RulePack) -> tuple[int, ...]:
    """Return the options that decide whether middleware ignores policies, or matches without them."""
    options = {pack.vocabulary.indices["option", name] for policy in pack.policies for name in policy.enforced}
    return tuple(sorted(options))


@lru_cache(maxsize=MAXIMUM_REMEMBERED)
def _treated_as(pack: RulePack, how: str, deciding: tuple[Value, ...]) -> frozenset[int]:
    """Return the policies that the middleware treats in one way, under these values of `_deciding`; the first option with an entry counts."""
    values = dict(zip(_deciding(pack), deciding, strict=True))
    found = set()
    for index, policy in enumerate(pack.policies):
        at = [(pack.vocabulary.indices["option", option], table) for option, table in policy.enforced.items()]
        said = (treated(table, pack.policies[option], values[option]) for option, table in at)
        if next((each for each in said if each is not None), "yes") == how:
            found.add(index)
    return frozenset(found)


def treated(by_value: Mapping[str, str], option: Policy, value: Value) -> str | None:
    """Return the entry of a table by option value; for an undetermined option the common entry of all its values."""
    if isinstance(value, Depends):
        found = {treated(by_value, option, case) for _, case in value.cases}
        return found.pop() if len(found) == 1 else None
    return by_value.get(option.domain.format(value)) if is_plain(value) else None  # type: ignore[arg-type]
