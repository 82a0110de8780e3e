"""What most tests of tables need; it takes a second to import, so that happens where the first of them runs."""

import pytest

from plugins.fleet.tests.needed import needed


@pytest.fixture(scope="session")
def engines():
    for name in ("narwhals", "duckdb", "polars", "pyarrow"):
        needed(name)
