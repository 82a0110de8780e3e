"""The lowest runtime of the stated ranges, as service and as client; all other tests run with the newest."""

import os
import subprocess
import sys
import tomllib
from importlib.metadata import version
from pathlib import Path

import pytest
from packaging.requirements import Requirement

import cqos_core as cqos
from tests.service.service_process import serving

ROOT = Path(__file__).resolve().parents[2]
RUNTIME = (
    "googleapis-common-protos",
    "grpcio",
    "grpcio-health-checking",
    "grpcio-reflection",
    "protobuf",
)
EXAMPLE = ROOT / "examples" / "smart_agriculture_incompatible.bpmn"
ASK = """\
import sys
from importlib.metadata import version
import cqos_core as cqos
from cqos_core.remote.client import Client
print(version("grpcio"), version("protobuf"))
example, *addresses = sys.argv[1:]
for address in addresses:
    with Client(address) as client:
        assert client.check(example) == cqos.check(example)
        with client.session(cqos.read(example)) as session:
            assert session.report() == cqos.check(example)
"""


def lowest():
    """The lowest versions that pyproject.toml allows."""
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    for need in map(Requirement, project["dependencies"]):
        if need.name in RUNTIME:
            (least,) = [each.version for each in need.specifier if each.operator == ">="]
            yield need.name, least if least.count(".") == 2 else f"{least}.0"


@pytest.fixture(scope="module")
def oldest(kept):
    wanted = [f"{name}=={least}" for name, least in lowest()]
    assert len(wanted) == len(RUNTIME)
    folder = kept(sys.version, *wanted)
    if (folder / "done").exists():
        return {"PYTHONPATH": str(folder)}
    command = [
        sys.executable,
        "-m",
        "pip",
        "install",
        "--quiet",
        "--upgrade",
        "--no-deps",
        "--target",
        str(folder),
        *wanted,
    ]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    if done.returncode != 0:
        if os.environ.get("CI") == "true":
            pytest.fail(done.stderr)
        pytest.skip("the lowest versions cannot be installed here")
    (folder / "done").touch()
    return {"PYTHONPATH": str(folder)}


def test_the_lowest_runtime_serves_the_newest_and_asks_it(oldest, service):
    with serving(environment=oldest) as old, old.client() as client:
        assert client.check(EXAMPLE) == cqos.check(EXAMPLE)
        assert client.pack("ros2").title == "ROS 2"
        done = subprocess.run(
            [sys.executable, "-c", ASK, str(EXAMPLE), old.grpc, service.grpc],
            env={**os.environ, **oldest},
            capture_output=True,
            text=True,
            check=False,
            timeout=240,
        )
        assert done.returncode == 0, done.stderr
        assert done.stdout.split() == [dict(lowest())["grpcio"], dict(lowest())["protobuf"]]
    assert version("grpcio") != dict(lowest())["grpcio"]
