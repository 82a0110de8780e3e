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
    """Keep the garbage collector away while what stays is built; below ``size`` 1,000 that is not worth it.

    It would look at all of that again and again, which takes longer than the building. What was built makes no cycles:
    many objects are put among the old ones unseen. Threads may do this at the same time: who found the collector running
    switches it on again.
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
    """Keep the garbage collector away from all that is loaded now, and for long from what is remembered later.

    For a process that answers calls. With the memories of some thousand pairs, a look at all of them stops it for 0.2 s; a
    look at the new objects takes 0.5 ms. Cycles that outlive one such look stay until 1,000 times as much came.
    """
    gc.collect()
    gc.freeze()
    gc.set_threshold(_NEW_OBJECTS, _SELDOM)
