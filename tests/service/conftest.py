"""The service that tests share."""

import pytest

from tests.service.running import serving


@pytest.fixture(scope="session")
def service():
    """The service that tests share; whoever harms it starts another one."""
    with serving("--web", "127.0.0.1:0", "--metrics", "127.0.0.1:0", "--max-message-bytes", "2000000") as running:
        yield running


@pytest.fixture(scope="session")
def client(service):
    with service.client() as connected:
        yield connected


@pytest.fixture
def start():
    return serving
