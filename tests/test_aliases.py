"""Module paths from before there were rooms."""

from __future__ import annotations

import importlib
import subprocess
import sys

import pytest

from cqos_core.aliases import LEFT, MOVED


@pytest.mark.parametrize("old", sorted(MOVED))
def test_an_old_path_is_the_module_itself(old):
    moved = importlib.import_module(f"cqos_core.{old}")
    new = importlib.import_module(f"cqos_core.{MOVED[old]}")
    assert moved is new or vars(moved)["__getattr__"].args == (new,)  # a package hands on names
    assert new.__spec__.name == f"cqos_core.{MOVED[old]}"


def test_a_room_that_became_a_distribution_has_its_modules():
    for old, module in (("bulk", "command"), ("pictures", "page")):
        new = importlib.import_module(f"{LEFT[old]}.{module}")
        assert importlib.import_module(f"cqos_core.{old}.{module}") is new


def test_a_room_has_the_names_of_the_module_that_was_called_so():
    room, module = (importlib.import_module(f"cqos_core.{path}") for path in ("files", "files.opening"))
    for name in ("find_files", "read_path", "STDIN"):
        assert getattr(room, name) is getattr(module, name)
    assert not hasattr(room, "never")


def test_the_table_is_read_only_where_an_old_path_is_used():
    script = "import sys, cqos_core.packs; print('cqos_core.aliases' in sys.modules)"
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=True)
    assert done.stdout == "False\n"


def test_a_path_that_never_was_is_not_found():
    with pytest.raises(ModuleNotFoundError, match=r"No module named 'cqos_core\.never'"):
        importlib.import_module("cqos_core.never")
