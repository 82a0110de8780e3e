"""Random models in which message flows bring what one signal brought."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING, Final

if TYPE_CHECKING:
    from collections.abc import Mapping
    from random import Random

_THROWN: Final = re.compile(r"^(\w+): (?:throw|end)\b.* ?\bz\b", re.MULTILINE)
_CAUGHT: Final = re.compile(r"^(\w+): (?:start|catch|boundary)\b.* ?\bz\b", re.MULTILINE)
_Z: Final = re.compile(r"^(\w+: (?:throw|end|start|catch|boundary)\b.*? ?)\bz\b(.*)$", re.MULTILINE)


def with_messages(random: Random, pools: Mapping[str, str]) -> dict[str, str]:
    """Return a model whose events for the signal z are for messages, with flows between some of them."""
    whole = "\n".join(pools.values())
    thrown, caught = _THROWN.findall(whole), _CAUGHT.findall(whole)
    share = random.choice((0.2, 0.5, 1.0))
    flows = [f"{source} ~> {target}" for source in thrown for target in caught if random.random() < share]
    texts = {name: _Z.sub(r"\1message\2", text) for name, text in pools.items()}
    first = next(iter(texts))
    return {**texts, first: "\n".join([texts[first], *flows])}
