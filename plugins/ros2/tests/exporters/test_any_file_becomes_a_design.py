"""Whatever the importers read can be written as a system file, with which everything is judged as before."""

from pathlib import Path

import pytest

import cqos_core as cqos
from cqos_core.api import context
from cqos_core.files.export import ExportContext
from cqos_core.files.yaml_writer import write

CASES = Path(__file__).parents[1] / "importers" / "cases"
FILES = sorted(path for path in CASES.rglob("*") if path.is_file())


def judged(system):
    report = cqos.check(system)
    pairs = sorted((pair.topic, pair.publisher, pair.subscriber, pair.verdict) for pair in report.pairs)
    reported = {note.code for note in system.notes}
    found = sorted((each.code, each.severity, each.message) for each in report.findings if each.code not in reported)
    return report.verdict, pairs, found


@pytest.mark.parametrize("path", FILES, ids=lambda path: f"{path.parent.name}/{path.name}")
def test_any_file_becomes_a_design(path):
    try:
        system = cqos.read(path, protocol="ros2")
    except cqos.InputError:
        pytest.skip("a file that is refused")
    exported = write(system, ExportContext(context().find_pack))
    again = cqos.read(exported.text.encode())
    assert again.notes == []
    assert len(again.endpoints) == len(system.endpoints) == exported.expressed
    assert again.partial == system.partial
    if exported.expressed:
        assert judged(again) == judged(system)
