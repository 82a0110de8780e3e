"""What a check costs grows with its input and its output, and hardly faster.

`dev.py test` counts calls of functions, which is the same on every machine. `dev.py explore` measures processor time instead: it also
sees what grows within one call.
"""

from __future__ import annotations

import cProfile
import math
import time
from typing import TYPE_CHECKING, Final

import pytest

from tests.effort import EXPLORE
from tests.growth.cache_reset import forget
from tests.growth.linear import gc_paused
from tests.growth.models import ALWAYS, MODELS

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from tests.growth.models import Model

LIMIT: Final = 1.3
"""Of the exponent over bytes in plus bytes out."""
SIZES: Final = (2, 4, 8) if EXPLORE else (1, 4)
"""Times the smallest; of three sizes the one between has no weight in the slope, but shows a bend in the table."""
TRIES: Final = 8
"""At most; the first that is within the limit is the last."""

Point = tuple[int, float]


def measured(model: Callable[[int], Model], smallest: int, sizes: Sequence[int] = SIZES) -> list[Point]:
    """Bytes in and out, and processor time, of some sizes; each is new to the process."""
    points: list[Point] = []
    model(max(2, smallest // 2)).work()  # what is read once in a process
    for times in sizes:
        size, work = model(smallest * times)
        with gc_paused():
            started = time.process_time()
            out = work()
            points.append((size + out, time.process_time() - started))
    return points


def counted(model: Callable[[int], Model], smallest: int) -> list[Point]:
    """Bytes in and out, and calls of functions, of some sizes.

    Before each, the process forgets all systems and meets one of two elements, so that a figure does not depend on what else it met.
    """
    points: list[Point] = []
    for times in SIZES:
        forget()
        model(2).work()
        size, work = model(smallest * times)
        profile = cProfile.Profile()
        out = profile.runcall(work)
        points.append((size + out, float(sum(entry.callcount for entry in profile.getstats()))))
    return points


def exponent(points: Sequence[Point]) -> float:
    """The slope of the line through the points, on logarithmic scales."""
    xs, ys = zip(*((math.log(size), math.log(max(seconds, 1e-4))) for size, seconds in points), strict=True)
    x, y = sum(xs) / len(xs), sum(ys) / len(ys)
    return float(sum((a - x) * (b - y) for a, b in zip(xs, ys, strict=True)) / sum((a - x) ** 2 for a in xs))


@pytest.mark.explored
@pytest.mark.parametrize("model", MODELS if EXPLORE else ALWAYS, ids=lambda model: model.__name__)
def test_calls_grow_like_the_input_and_the_output(model):
    points = counted(model, MODELS[model] // 2 + 4)
    assert exponent(points) <= LIMIT, points


if EXPLORE:

    @pytest.mark.explored
    @pytest.mark.parametrize("model", MODELS, ids=lambda model: model.__name__)
    def test_time_grows_like_the_input_and_the_output(model):
        # Other work of the machine makes a try look slower, never faster, so the best time of each size counts.
        best: list[Point] = []
        for number in range(TRIES):
            points = measured(model, MODELS[model] + number)
            best = [min(pair, key=lambda point: point[1]) for pair in zip(best or points, points, strict=True)]
            if exponent(best) <= LIMIT:
                return
        pytest.fail(f"grows with the power {exponent(best):.2f}, not {LIMIT}: {best}")
