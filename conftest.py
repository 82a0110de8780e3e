"""Settings for all tests: hypothesis profiles, and the option of the soak."""

from __future__ import annotations

import gc
import os
import sys
from itertools import islice
from typing import TYPE_CHECKING

import pytest
from _pytest.pathlib import import_path
from hypothesis import HealthCheck, settings

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

if sys.version_info < (3, 11):
    import tomli

    sys.modules["tomllib"] = tomli  # the tests read the files of the project with it

pytest_plugins = ("tests.browsing",)  # the browser, for tests of pages in all folders

# No deadline: how long one example takes says nothing here, machines differ and coverage doubles it.
settings.register_profile("base", deadline=None, suppress_health_check=[HealthCheck.too_slow], print_blob=True)
# The tests give the same answer every time; `dev.py explore` looks for new examples, and what it finds becomes a case.
settings.register_profile("fixed", parent=settings.get_profile("base"), derandomize=True, max_examples=10)
settings.register_profile("explore", parent=settings.get_profile("base"), max_examples=2_000)
settings.load_profile(os.environ.get("CQOS_HYPOTHESIS", "fixed"))


# Slow tests, by what they share: a browser, a service, or nothing but long waits.
SLOW = (
    ("tests/modeler/test_qos.py", "plugins/pictures/tests/"),
    ("tests/modeler/",),
    (
        *(
            f"tests/service/test_{name}.py"
            for name in ("memory", "process", "hostile_callers", "resource_limits", "fairness")
        ),
    ),
    ("tests/service/",),
    ("tests/conformance/", "tests/test_build.py", "tests/growth/", "tests/decisive/"),
)


@pytest.hookimpl(tryfirst=True)
def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    """Let each worker begin with slow tests that share what they start.

    xdist gives each worker an equal part of the list, and one that is done takes tests from the end of another's part.
    A random order, where it is asked for, comes after this.
    """
    workers: int = getattr(config, "workerinput", {}).get("workercount", 1)
    if workers > 1:
        items[:] = in_parts(items, workers)


def in_parts(items: Sequence[pytest.Item], workers: int) -> Iterator[pytest.Item]:
    """Yield all items, with the slow ones at the beginning of each worker's part."""
    slow: list[list[pytest.Item]] = [[] for _ in SLOW]
    quick: list[pytest.Item] = []
    for item in items:
        group = next((group for names, group in zip(SLOW, slow, strict=True) if item.nodeid.startswith(names)), quick)
        group.append(item)
    rest = iter(quick)
    for worker in range(workers):
        part = [item for group in slow[worker::workers] for item in group]
        size = (len(items) * (worker + 1)) // workers - (len(items) * worker) // workers
        yield from part
        yield from islice(rest, max(0, size - len(part)))
    yield from rest


NEW_OBJECTS = 5_000
"""So many more objects than before make Python look for garbage; after 10,000 our own code counts those that are frozen, which are many here."""


@pytest.hookimpl(tryfirst=True)
def pytest_collection(session: pytest.Session) -> None:
    """Collect no garbage while tests are found: nearly all that is made stays, and looking through it again and again takes twice as long."""
    gc.disable()
    if session.config.args == session.config.getini("testpaths"):
        import_all(session.config)


def import_all(config: pytest.Config) -> None:
    """Import every test file, in each worker from another one on: where nothing is compiled yet, none compiles what another has."""
    given: dict[str, int | str] = getattr(config, "workerinput", {})
    if not given:
        return
    files = sorted(file for name in config.args for file in config.rootpath.joinpath(name).rglob("test_*.py"))
    first = len(files) * int(str(given["workerid"]).removeprefix("gw")) // int(given["workercount"])
    for file in files[first:] + files[:first]:
        try:
            import_path(file, mode="importlib", root=config.rootpath, consider_namespace_packages=False)
        except (Exception, pytest.skip.Exception):  # noqa: BLE001 - its collection imports it again, and says so
            for name, each in list(sys.modules.items()):
                if getattr(each, "__file__", None) == str(file):
                    del sys.modules[name]


def pytest_collection_finish() -> None:
    """Leave what the tests are made of out of every later collection of garbage, and look for it less often."""
    gc.freeze()
    gc.set_threshold(NEW_OBJECTS)
    gc.enable()


@pytest.hookimpl(optionalhook=True)
def pytest_xdist_auto_num_workers() -> int:
    """Return two more workers than there are cores: many tests wait for a service, a browser or the middleware."""
    return (os.cpu_count() or 1) + 2


def pytest_addoption(parser: pytest.Parser) -> None:
    """Add our options."""
    seconds = 10.0 if os.environ.get("CQOS_HYPOTHESIS") == "explore" else 0.0
    parser.addoption(
        "--soak", type=float, default=seconds, help="seconds of mixed load for the service; 0: a few calls"
    )
