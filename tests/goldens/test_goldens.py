"""What C-QoS says of many systems is as recorded: `python3 dev.py goldens` records it anew, and `git diff` shows what changed."""

from __future__ import annotations

import pytest

from tests.goldens import inputs, record

MOST = 200  # lines of a difference that are shown


@pytest.mark.parametrize("name", inputs.files())
def test_golden(name, monkeypatch):
    monkeypatch.chdir(inputs.ROOT)
    found = [*record.difference(name, record.recorded(name), record.text(name))]
    more = [f"... and {len(found) - MOST} more lines"] if len(found) > MOST else []
    if found:
        pytest.fail("\n".join([*found[:MOST], *more, "intended? `python3 dev.py goldens` records it"]), pytrace=False)


def test_each_golden_is_of_something():
    assert record.kept() <= inputs.files().keys()
