"""Some of the goldens: `python3 dev.py goldens --check` compares all of them."""

from __future__ import annotations

from tests.goldens import record

EVERY = 61  # so that all packs, the fixtures and the random systems are among those compared


def test_a_sample_is_as_recorded():
    recorded = record.recorded()
    sample = [name for name in recorded if name in record.items()][::EVERY]
    found = record.differing({name: recorded[name] for name in sample}, record.digests(sample))
    assert not found, f"{found}: `python3 dev.py goldens --against main` shows how, `dev.py goldens` records it"
