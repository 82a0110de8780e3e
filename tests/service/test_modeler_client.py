"""The example client in another language runs, and the command lines of the docs say what the service says."""

import os
import runpy
import shutil
import subprocess
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
BUF = ROOT / ".venv" / "generate" / "1.75.0" / "node_modules" / ".bin" / "buf"


def needed(found, what):
    """A missing toolchain is a skip on a laptop, and a failure where CI runs."""
    if not found:
        if os.environ.get("CI") == "true":
            pytest.fail(f"{what} is missing")
        pytest.skip(f"{what} is missing")


def buf():
    """Return the path of buf, which CI installs if it is missing."""
    if os.environ.get("CI") == "true":
        return runpy.run_path(str(ROOT / "proto" / "generate.py"))["buf"]()
    needed(BUF.exists(), "buf, which proto/generate.py gets from npm,")
    return str(BUF)


def run(*command, folder):
    path = os.pathsep.join([str(folder / "node_modules" / ".bin"), os.environ["PATH"]])
    done = subprocess.run(
        command, cwd=folder, env={**os.environ, "PATH": path}, capture_output=True, text=True, check=False, timeout=180
    )
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout


def test_the_modeler_in_javascript_runs_against_the_service(service, kept):
    needed(shutil.which("npm") and shutil.which("node"), "npm")
    example = ROOT / "examples" / "modeler_client"
    here = kept(str(example), (example / "package-lock.json").read_text(encoding="utf-8"))
    folder = here / "examples" / "modeler_client"
    ours = shutil.ignore_patterns("node_modules", "gen")
    shutil.rmtree(folder / "gen", ignore_errors=True)
    shutil.copytree(example, folder, ignore=ours, dirs_exist_ok=True)
    shutil.copytree(ROOT / "proto", here / "proto", dirs_exist_ok=True)
    if not (here / "done").exists():
        run("npm", "ci", "--ignore-scripts", folder=folder)
        (here / "done").touch()
    run(*([BUF, "generate"] if BUF.exists() else ["npm", "run", "generate"]), folder=folder)
    said = run("node", "modeler.js", service.grpc, folder=folder)
    assert "reliability: select [best_effort, reliable," in said
    assert "verdict: INCOMPATIBLE\nmark Event_Catch and Event_Throw: ROS101 " in said
    assert "offer to set reliability of Event_Throw to reliable (configuration)" in said
    assert "after the edit: COMPATIBLE" in said
    assert "a wrong request: InvalidArgument: protocol: there is no rule pack `telegraph`" in said


def buf_curl_of_the_docs():
    """The commands of docs/service.md that use reflection, each with what the page says it prints."""
    text = (ROOT / "docs" / "service.md").read_text(encoding="utf-8")
    blocks = [block.partition("```")[0] for block in text.split("```text\n")[1:]]
    for block in blocks:
        for part in block.split("$ ")[1:]:
            lines = part.splitlines()
            command = [lines.pop(0)]
            while command[-1].endswith("\\"):
                command.append(lines.pop(0))
            yield " ".join(line.rstrip("\\").strip() for line in command), "\n".join(lines).strip()


COMMANDS = list(buf_curl_of_the_docs())


def test_the_docs_have_such_commands():
    assert len(COMMANDS) >= 3


@pytest.mark.parametrize(("command", "printed"), COMMANDS, ids=[command[-40:] for command, _ in COMMANDS])
def test_command_lines_of_the_docs_print_what_they_say(command, printed, service):
    ours = command.replace("127.0.0.1:50051", service.grpc).replace("buf ", f"{buf()} ", 1)
    done = subprocess.run(["sh", "-c", ours], capture_output=True, text=True, check=False, timeout=60)
    wanted = printed.split("…")
    at = 0
    for part in wanted:
        found = done.stdout.find(part.strip(), at)
        assert found >= 0, f"{ours}\n{done.stdout}{done.stderr}\nlacks: {part}"
        at = found
