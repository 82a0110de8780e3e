"""Asserts that something costs no more than in proportion to its size."""

from __future__ import annotations

import gc
import time
from contextlib import contextmanager
from typing import TYPE_CHECKING, Final

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

LIMIT: Final = 1.3
"""Of the exponent."""
_TIMES: Final = 4
# Seconds: what costs less is not measured exactly enough, and large allocations cost more per byte.
_LEAST: Final = 0.04
_TRIES: Final = 3


def assert_linear(work: Callable[[int], object], size: int) -> None:
    """Assert that four times the size takes hardly more than four times the processor time.

    Args:
        work: does it once; made for a size.
        size: the smaller one, such that the larger one is what hurts.
    """
    bound = _TIMES**LIMIT
    tries = []
    for _ in range(_TRIES):  # other work of the machine makes a try look steeper, hardly ever flatter
        small, large = _seconds(work, size), _seconds(work, size * _TIMES)
        if large <= bound * max(small, _LEAST):
            return
        tries.append((small, large))
    raise AssertionError(f"{_TIMES} times the size takes more than {bound:.1f} times as long: {tries}")


def _seconds(work: Callable[[int], object], size: int) -> float:
    with gc_paused():
        started = time.process_time()
        work(size)
        return time.process_time() - started


@contextmanager
def gc_paused() -> Iterator[None]:
    """Collect no garbage meanwhile: that takes as long as the whole process is large, whatever is measured."""
    gc.disable()
    try:
        yield
    finally:
        gc.enable()
