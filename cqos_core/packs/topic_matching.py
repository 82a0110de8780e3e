"""Matching of topics: resolution of names, and pairs of different names that match."""

from __future__ import annotations

from dataclasses import field
from typing import TYPE_CHECKING, NamedTuple

from cqos_core.model.dataclass import dataclass
from cqos_core.model.wildcards import fits

if TYPE_CHECKING:
    from collections.abc import Callable, Collection, Iterable, Mapping

    from cqos_core.model.system import Endpoint


class NameProblem(NamedTuple):
    """A problem of a topic name: code of the core or the pack, severity, message and advice."""

    code: str
    severity: str
    message: str
    help: str = ""


class Naming(NamedTuple):
    """A topic name in the form on which endpoints match.

    ``key`` is that form (None: it names no topic), ``shown`` is its form in messages.
    """

    key: str | None
    shown: str
    problems: tuple[NameProblem, ...] = ()


@dataclass(frozen=True, slots=True)
class NameContext:
    """The surroundings in which a topic name is resolved; ``role`` is empty for a topic without an endpoint."""

    participant: str
    label: str | None
    settings: Mapping[str, str]
    remap: Mapping[str, str]
    kind: str
    dialect: str
    role: str = ""


def plain_name(written: str, context: NameContext) -> Naming:  # noqa: ARG001 - the signature of all naming functions
    """Take names as they are written."""
    return Naming(written, written)


def more_than_a_text_before(context: NameContext) -> str | None:  # noqa: ARG001 - the signature of all
    """Leave all names to `TopicMatching.resolve`."""
    return None


def plain_address(participant: str, settings: Mapping[str, str]) -> str:  # noqa: ARG001 - the signature of all
    """Take participants by their id."""
    return participant


def shell_pattern(pattern: str, address: str) -> bool:
    """Read patterns over addresses as the shell reads those over file names."""
    return fits(address, pattern)


def only_itself(endpoint: Endpoint) -> tuple[Endpoint, ...]:
    """Every endpoint stands for itself."""
    return (endpoint,)


@dataclass(frozen=True, slots=True)
class TopicMatching:
    """The functions by which topic names are resolved and matched.

    Attributes:
        resolve: returns a written name in the form on which endpoints match.
        address: how files that lay settings over a participant's endpoints name it, from its id and its settings
            (a ROS node's name with its namespace).
        covers: whether a pattern of such a file covers an address; ``*`` covers all.
        expand: returns the endpoints that one stands for: a service server is one subscriber and one publisher.
        folds: functions from a key to a coarser one; two lonely keys with an equal fold are a near miss.
            Each comes with the words that say how they differ.
        match: where equal keys are not all that meets (a filter and the names it matches): from the keys of publishers and of
            subscribers all pairs of different ones that meet.
        overlapping: the flag of an endpoint that says that its participant has another subscriber, with another key, on the
            same topic; set where that is so.
        one_way: values of a subscriber, by policy, under which several ways to it bring nothing twice, because it takes what
            comes over one of them (exclusive ownership) or another one gets the rest (a shared subscription).
        plain: a regular expression for names that are the form endpoints meet on for any participant, and about which no rule over
            topics reports; empty: no name is.
        longest: how many characters such a name may have; None: any number.
        before: returns the prefix with which `resolve` makes a name plain, if it does nothing else and keeps plain names; None if
            `resolve` does more.
        described: one sentence for docs and packs listings.
    """

    resolve: Callable[[str, NameContext], Naming] = plain_name
    expand: Callable[[Endpoint], tuple[Endpoint, ...]] = only_itself
    address: Callable[[str, Mapping[str, str]], str] = plain_address
    covers: Callable[[str, str], bool] = shell_pattern
    folds: tuple[tuple[str, Callable[[str], str]], ...] = (
        ("differ only in upper and lower case", str.casefold),
        ("differ only in slashes at the ends", lambda key: key.strip("/")),
    )
    match: Callable[[Collection[str], Collection[str]], Iterable[tuple[str, str]]] | None = None
    overlapping: str = ""
    one_way: Mapping[str, str] = field(default_factory=dict)
    plain: str = ""
    longest: int | None = None
    before: Callable[[NameContext], str | None] = more_than_a_text_before
    described: str = "endpoints on the same topic name"
