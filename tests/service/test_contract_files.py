"""What is generated is what the .proto files say, it runs on every runtime we promise, and every field of the library travels."""

import os
import shutil
import subprocess
import sys
import tomllib
from dataclasses import fields
from pathlib import Path

import pytest
from packaging.requirements import Requirement

from cqos.v1 import check_pb2, report_pb2, system_pb2
from cqos_core.remote import messages

ROOT = Path(__file__).resolve().parents[2]
GENERATE = ROOT / "proto" / "generate.py"


def test_generated_code_matches_the_proto_files_and_breaks_no_client():
    if not os.environ.get("CI") and not (ROOT / ".venv" / "generate" / "pinned.txt").is_file():
        pytest.skip("the pinned tools are not there; `python proto/generate.py --check` gets them")
    done = subprocess.run([sys.executable, GENERATE, "--check"], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout + done.stderr


@pytest.mark.skipif(shutil.which("npm") is None and not os.environ.get("CI"), reason="buf comes through npm")
def test_a_change_that_breaks_callers_is_found(tmp_path):
    if not os.environ.get("CI") and not (ROOT / ".venv" / "generate" / "pinned.txt").is_file():
        pytest.skip("the pinned tools are not there; `python proto/generate.py --check` gets them")
    shutil.copytree(ROOT / "proto", tmp_path / "proto")
    (tmp_path / ".venv").symlink_to(ROOT / ".venv", target_is_directory=True)
    file = tmp_path / "proto" / "cqos" / "v1" / "report.proto"
    text = file.read_text(encoding="utf-8")
    file.write_text(text.replace("string topic = 1;", "string subject = 1;"), encoding="utf-8")
    script = tmp_path / "proto" / "generate.py"
    written = subprocess.run([sys.executable, script], capture_output=True, text=True, check=False)
    assert written.returncode == 0, written.stdout + written.stderr
    done = subprocess.run([sys.executable, script, "--check"], capture_output=True, text=True, check=False)
    assert done.returncode == 1
    assert 'changed name from "topic" to "subject"' in done.stdout + done.stderr


def test_generated_code_asks_for_no_newer_runtime_than_we_promise():
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    ranges = {need.name: need.specifier for need in map(Requirement, project["dependencies"])}
    generated = {path: path.read_text(encoding="utf-8") for path in (ROOT / "proto" / "python").rglob("*_pb2*.py")}
    assert generated
    for path, text in generated.items():
        if path.name.endswith("_grpc.py"):
            (line,) = [line for line in text.splitlines() if line.startswith("GRPC_GENERATED_VERSION")]
            asked, name = line.split("'")[1], "grpcio"
        else:
            (line,) = [line for line in text.splitlines() if line.startswith("# Protobuf Python Version")]
            asked, name = line.rpartition(" ")[2], "protobuf"
        assert asked in ranges[name], f"{path.name} refuses {name} before {asked}"
        assert str(ranges[name]).find(f">={asked.removesuffix('.0')}") >= 0


@pytest.mark.parametrize("name", sorted(messages._KINDS))
def test_every_field_of_the_library_has_one_in_its_message(name):
    made = messages._KINDS[name]
    descriptor = next(getattr(file, name) for file in (report_pb2, system_pb2, check_pb2) if hasattr(file, name))
    # What is not compared belongs to one run of the command, and does not travel.
    assert {each.name for each in fields(made) if each.compare} <= {
        each.name for each in descriptor.DESCRIPTOR.fields
    }, f"`{name}` has a field that proto/cqos/v1 does not: add it there and run proto/generate.py"
