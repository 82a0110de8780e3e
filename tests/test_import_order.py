"""Workers import test files in other orders, and each file is collected all the same."""

import sys
from types import SimpleNamespace
from typing import Any

import pytest

from conftest import import_all


@pytest.mark.parametrize("worker", ["gw0", "gw1"])
def test_what_cannot_be_imported_is_left_to_its_collection(tmp_path, worker):
    texts = {
        "test_right.py": "",
        "test_wrong.py": "import nothing_of_this_name",
        "test_skipped.py": "import pytest\npytest.skip('x', allow_module_level=True)",
    }
    for name, text in texts.items():
        tmp_path.joinpath(name).write_text(text, encoding="utf-8")
    given = {"args": ["."], "rootpath": tmp_path, "workerinput": {"workerid": worker, "workercount": 2}}
    config: Any = SimpleNamespace(**given)
    import_all(config)
    known = {str(each.__file__): name for name, each in list(sys.modules.items()) if getattr(each, "__file__", None)}
    found = {name for name in texts if str(tmp_path / name) in known}
    for name in found:
        del sys.modules[known[str(tmp_path / name)]]
    assert found == {"test_right.py"}
