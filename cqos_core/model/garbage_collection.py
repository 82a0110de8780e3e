"""When Python's garbage collector runs: not while many objects are built, and rarely over old objects."""

from __future__ import annotations

import gc
from contextlib import contextmanager
from typing import TYPE_CHECKING, Final

if TYPE_CHECKING:
    from collections.abc import Iterator

_WORTH_IT: Final = 1_000
_MANY: Final = 10_000


@contextmanager
def gc_paused(size: int = _WORTH_IT) -> Iterator[None]:
    """Pause the garbage collector while many objects are built; ``size`` below 1,000 changes nothing.

    The collector would visit the new objects again and again, which takes longer than building them. They have no cycles,
    so many of them are put into the oldest generation without a visit. Several threads may pause it at the same time: the
    thread that found it running starts it again.
    """
    collecting = gc.isenabled() and size >= _WORTH_IT
    if collecting:
        gc.disable()
    try:
        yield
    finally:
        if collecting:
            if gc.get_count()[0] > _MANY and not gc.get_freeze_count():
                gc.freeze()
                gc.unfreeze()
            gc.enable()


_NEW_OBJECTS: Final = 2_000
_SELDOM: Final = 1_000


def collect_new_objects_only() -> None:
    """Exempt all loaded objects from garbage collection, and make full collections rare.

    For a process that answers calls. With the caches of some thousand pairs, a full collection stops it for 0.2 s; one of the
    new objects takes 0.5 ms. Cycles that survive one such collection stay until 1,000 times as many objects came.
    """
    gc.collect()
    gc.freeze()
    gc.set_threshold(_NEW_OBJECTS, _SELDOM)
