"""The service that tests share."""

import hashlib

import pytest

from tests.service.service_process import serving

PAGE = "https://modeler.example"
"""The origin of pages that may call the server for browsers."""


@pytest.fixture(scope="session")
def service():
    """The service that tests share; a test that harms it starts another one."""
    doors = ("--web", "127.0.0.1:0", "--origin", PAGE, "--metrics", "127.0.0.1:0")
    # Other tests take most of the machine meanwhile, and workers have a low priority.
    with serving(*doors, "--max-message-bytes", "2000000", "--max-seconds", "120") as running:
        yield running


@pytest.fixture(scope="session")
def narrow():
    """One that takes very little, which tests of its limits share."""
    with serving("--max-endpoints", "3", "--max-sessions", "4") as running:
        yield running


@pytest.fixture(scope="session")
def forgetful():
    """One that has a place for one session, and closes it soon where nothing is heard of it."""
    with serving("--max-sessions", "1", "--max-share", "1", "--max-idle-seconds", "0.5") as running:
        yield running


@pytest.fixture(scope="session")
def kept(request):
    """Folders that are the same for every run, by what makes them; what takes long to get is got once."""

    def folder(*parts):
        name = hashlib.sha256("\n".join(parts).encode()).hexdigest()[:16]
        return request.config.cache.mkdir(f"cqos-{name}")

    return folder


@pytest.fixture(scope="session")
def client(service):
    with service.client() as connected:
        yield connected


@pytest.fixture(scope="session")
def start():
    return serving
