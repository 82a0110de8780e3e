"""One measurement in a process of its own, so that nothing was seen before: python -m tests.benchmarks.cold WORK FORM SIZE

WORK is `base`, `read` or `check`, FORM `system_file` or `diagram`, SIZE the number of endpoints. Prints JSON: processor time
in seconds, and the largest amount of memory in bytes. `base` is the bare work that reading cannot avoid.
"""

from __future__ import annotations

import json
import re
import resource
import sys
import tempfile
import time
from collections import deque
from pathlib import Path
from typing import TYPE_CHECKING

import yaml
from lxml import etree

from tests.benchmarks import inputs

if TYPE_CHECKING:
    from collections.abc import Callable


def base(form: str, path: str) -> None:
    """Do the bare work: all events of libyaml, or lxml's tree and a walk over its attributes."""
    with Path(path).open("rb") as file:
        if form == "system_file":
            deque(yaml.parse(file, Loader=yaml.CLoader), maxlen=0)
        else:
            sum(len(element.attrib) for element in etree.parse(file).iter())


def work_of(work: str, form: str, path: str) -> Callable[[], object]:
    """Return what is measured; packs and modules are loaded before, by a small input of the same form."""
    if work == "base":
        return lambda: base(form, path)
    import cqos_core as cqos

    small = b"".join(getattr(inputs, form)(20))
    if work == "read":
        cqos.read(small)
        return lambda: cqos.read(path)

    def check() -> object:
        report = cqos.check(path)
        return [finding.message for finding in report.findings]

    [finding.message for finding in cqos.check(small).findings]
    return check


def peak() -> int:
    """Return the largest amount of memory of this program, in bytes."""
    status = Path("/proc/self/status")
    if status.exists():
        found = re.search(r"VmHWM:\s+(\d+) kB", status.read_text())
        if found is not None:
            return int(found[1]) * 1024
    # Not on Linux, where it counts memory of the process that started this one, such as a large session.
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * 1024


def main(work: str, form: str, size: int) -> None:
    """Measure once and print."""
    ending = ".yaml" if form == "system_file" else ".bpmn"
    with tempfile.NamedTemporaryFile(suffix=ending, delete=False) as file:
        file.writelines(getattr(inputs, form)(size))
    try:
        do = work_of(work, form, file.name)
        began = time.process_time()
        kept = do()
        seconds = time.process_time() - began
    finally:
        Path(file.name).unlink()
    del kept
    json.dump({"seconds": seconds, "bytes": peak()}, sys.stdout)


if __name__ == "__main__":
    main(sys.argv[1], sys.argv[2], int(sys.argv[3]))
