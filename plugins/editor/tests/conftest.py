"""One server for all tests of a process: its start costs more than most tests."""

import pytest

from plugins.editor.tests.client import Client


@pytest.fixture(scope="session")
def server():
    with Client() as client:
        yield client


@pytest.fixture
def editor(server):
    """The server without open documents and folders."""
    yield server
    server.close_all()
