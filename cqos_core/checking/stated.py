"""The endpoints of a system that is edited: found by id, and in the order in which they came."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator

    from cqos_core.model.system import Endpoint


class StatedEndpoints:
    """Endpoints of one system; what is put in is copied, and never changed after that.

    Attributes:
        twice: ids that several of them have, as files that are read together may use one.
    """

    def __init__(self, endpoints: Iterable[Endpoint]) -> None:
        """Begin with some."""
        self._by_number: dict[int, Endpoint] = {}
        self._number: dict[str, int] = {}
        self._next = 0
        self.twice: set[str] = set()
        for each in endpoints:
            if each.id in self._number:
                self.twice.add(each.id)
            self._number.setdefault(each.id, self._next)
            self._by_number[self._next] = copied(each)
            self._next += 1

    def __len__(self) -> int:
        return len(self._by_number)

    def __iter__(self) -> Iterator[Endpoint]:
        """All, in their order; they are not to be changed."""
        return iter(self._by_number.values())

    def find(self, name: str) -> tuple[int, Endpoint] | None:
        """Return the first endpoint of an id with its place among all."""
        number = self._number.get(name)
        return None if number is None else (number, self._by_number[number])

    def kind_of(self, name: str) -> str:
        """Return the kind of the endpoint of an id, which there has to be."""
        return self._by_number[self._number[name]].kind

    def put(self, endpoint: Endpoint) -> None:
        """Add an endpoint, or replace the first one with its id, whose place it takes."""
        number = self._number.get(endpoint.id)
        if number is None:
            number = self._number[endpoint.id] = self._next
            self._next += 1
        self._by_number[number] = copied(endpoint)

    def remove(self, name: str) -> None:
        """Remove all endpoints with an id.

        Raises:
            KeyError: no endpoint has it.
        """
        del self._by_number[self._number.pop(name)]
        if name in self.twice:
            self.twice.discard(name)
            self._by_number = {number: each for number, each in self._by_number.items() if each.id != name}

    def remove_of(self, participant: str) -> None:
        """Remove the endpoints of a participant."""
        for name in {each.id for each in self if each.participant == participant}:
            self.remove(name)


def copied(endpoint: Endpoint) -> Endpoint:
    """Return a copy, whose settings are its own."""
    settings, overlay, needs = dict(endpoint.settings), dict(endpoint.overlay), dict(endpoint.needs)
    return replace(endpoint, settings=settings, overlay=overlay, needs=needs)
