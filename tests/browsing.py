"""A headless Chromium for the tests of pages, in a thread of its own."""

from __future__ import annotations

import threading
from concurrent.futures import ThreadPoolExecutor
from typing import TYPE_CHECKING

import pytest

from tests.browser import FLAGS, chromium

if TYPE_CHECKING:
    from collections.abc import Iterator

# Playwright leaves an event loop running in the thread that starts it, and no other test could run one there.
THREAD = ThreadPoolExecutor(1, thread_name_prefix="browser")


def is_in_thread() -> bool:
    """Return whether this is the thread of the browser."""
    return threading.current_thread().name.startswith("browser")


@pytest.hookimpl(tryfirst=True)
def pytest_runtest_protocol(item: pytest.Item, nextitem: pytest.Item | None) -> object | None:
    """Run the tests that need the browser in its thread, with their fixtures."""
    if is_in_thread() or "browser" not in getattr(item, "fixturenames", ()):
        return None
    done: object = THREAD.submit(item.config.hook.pytest_runtest_protocol, item=item, nextitem=nextitem).result()
    return done


@pytest.fixture(scope="session")
def browser() -> Iterator[object]:
    """One Chromium for the tests of a process."""
    program = chromium()
    from playwright.sync_api import sync_playwright

    playwright = sync_playwright().start()
    launched = playwright.chromium.launch(executable_path=program, args=list(FLAGS))
    yield launched

    def end() -> None:
        launched.close()
        playwright.stop()

    # The last test of a process may be one without a browser.
    end() if is_in_thread() else THREAD.submit(end).result()
