"""What `dev.py build` makes is what users need: it is installed without network, and used."""

import json
import os
import subprocess
import sys
import sysconfig
import venv
from importlib.metadata import distributions
from pathlib import Path

from packaging.utils import canonicalize_name

ROOT = Path(__file__).resolve().parent.parent
OURS = (
    "cqos",
    *(f"cqos-{name}" for name in ("core", "dds", "fleet", "live", "lsp", "mqtt", "pictures", "planning")),
    *(f"cqos-ros2{name}" for name in ("", "-sources", "-workspace")),
)


def run(*command, **settings):
    done = subprocess.run(
        [str(part) for part in command],
        capture_output=True,
        text=True,
        check=False,
        cwd=settings.pop("cwd", ROOT),
        **settings,
    )
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout


def lend(site):
    """Link everything that others wrote and is installed here into an environment; of ours, nothing."""
    here = Path(sysconfig.get_path("purelib"))
    for found in distributions(path=[str(here)]):
        if canonicalize_name(found.metadata["Name"]) not in OURS:
            for name in {file.parts[0] for file in found.files or () if file.parts[0] not in {"..", "__pycache__"}}:
                if (here / name).exists() and not (site / name).exists() and not name.endswith(".pth"):
                    (site / name).symlink_to(here / name)


def test_what_is_built_can_be_installed_without_network_and_used(tmp_path):
    dist, place = tmp_path / "dist", tmp_path / "venv"
    sums = run(sys.executable, "scripts/build_distributions.py", "--output", dist)
    assert len(sums.splitlines()) == 2 * len(OURS)

    venv.create(place, symlinks=os.name != "nt")
    python = place / ("Scripts/python.exe" if os.name == "nt" else "bin/python")
    lend(Path(run(python, "-c", "import sysconfig; print(sysconfig.get_path('purelib'), end='')")))
    pip = (sys.executable, "-m", "pip", "--python", python, "install", "--quiet", "--no-compile")
    environment = {name: value for name, value in os.environ.items() if not name.startswith(("PIP_", "PYTHON"))}
    run(*pip, "--no-index", "--find-links", dist, "cqos[web,metrics,otel]", env=environment)

    cqos = python.with_name("cqos.exe" if os.name == "nt" else "cqos")
    assert "smart-agriculture: compatible" in run(cqos, "check", ROOT / "examples/smart_agriculture.yaml", cwd=tmp_path)
    assert "editor" in run(cqos, "lsp", "--help", cwd=tmp_path)
    listed = run(cqos, "packs", cwd=tmp_path)
    assert all(each in listed for each in ("cqos-core 0", "cqos-ros2 0", "cqos-dds 0", "cqos-mqtt 0"))
    script = """
import cqos, json, cqos_core
pair = cqos.check_pair("ros2", offered={"durability": "volatile"}, requested={"durability": "transient_local"})
print(json.dumps([str(pair.verdict), cqos.__all__ == cqos_core.__all__, cqos_core.__file__]))
"""
    verdict, same, file = json.loads(run(python, "-c", script, cwd=tmp_path))
    assert (verdict, same) == ("incompatible", True)
    assert Path(file).is_relative_to(place)

    with subprocess.Popen(
        [cqos, "serve", "--listen", "127.0.0.1:0", "--web", "127.0.0.1:0"],
        cwd=tmp_path,
        stderr=subprocess.PIPE,
        stdout=subprocess.DEVNULL,
        text=True,
    ) as service:
        try:
            lines = (json.loads(line) for line in service.stderr)
            address = next(line["grpc"] for line in lines if line["event"] == "serving")
            checked = run(cqos, "check", "--server", address, ROOT / "examples/smart_agriculture.yaml", cwd=tmp_path)
            assert "smart-agriculture: compatible" in checked
        finally:
            service.terminate()
            service.stderr.read()
