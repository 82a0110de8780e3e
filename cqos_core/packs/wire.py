"""The mapping of a protocol to the protocol underneath, such as ROS 2 to DDS."""

from __future__ import annotations

from dataclasses import field
from typing import TYPE_CHECKING

from cqos_core.model.dataclass import dataclass

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Mapping


@dataclass(frozen=True, slots=True)
class Wire:
    """The mapping of endpoints to the protocol that carries them, so that endpoints of both can match.

    A pair of one endpoint of each is judged by the wire's pack on wire values. Nothing here needs that pack installed.

    Attributes:
        protocol: id of the wire's pack.
        topic: from a topic key and the endpoint's plain values by policy name, the topic on the wire; None where the endpoint
            is not on that wire.
        policies: own endpoint policy to the wire policy, or the several, that it sets; wire policies that none stands for
            keep their defaults.
        options: own option to the wire's option or participant setting.
        facts: what is known of a topic, or of the network as an option, to the wire's policy for the same; where the wire's
            endpoints on the topic state nothing, they know it too.
        words: own value to wire value, where the two spell it differently.
        fixed: wire policies that endpoints of this protocol always have, with their values.
        type: from a type name to the one on the wire.
    """

    protocol: str
    topic: Callable[[str, Mapping[str, str]], str | None]
    policies: Mapping[str, str | tuple[str, ...]]
    options: Mapping[str, str] = field(default_factory=dict)
    facts: Mapping[str, str] = field(default_factory=dict)
    words: Mapping[str, str] = field(default_factory=dict)
    fixed: Mapping[str, str] = field(default_factory=dict)
    type: Callable[[str], str] = str

    def translations(self) -> Iterator[tuple[str, str]]:
        """Yield each own policy with each wire policy that it sets."""
        for own, on_wire in self.policies.items():
            for name in (on_wire,) if isinstance(on_wire, str) else on_wire:
                yield own, name
