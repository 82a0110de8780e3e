"""What a command imports, which is what it costs to start: no clock is looked at."""

import json
import subprocess
import sys

import pytest

HEAVY = ("grpc", "lxml", "yaml", "pydantic", "rich")


def imported(files, *arguments):
    """Run a command in a process of its own; return its exit code and the modules it has imported."""
    script = (
        "import json, sys\n"
        "from cqos_core.cli import main\n"
        f"code = main({list(arguments)!r})\n"
        "sys.stderr.write(json.dumps([code, sorted(sys.modules)]))\n"
    )
    done = subprocess.run(
        [sys.executable, "-c", script], cwd=files, capture_output=True, check=True, text=True, timeout=60
    )
    code, modules = json.loads(done.stderr)
    return code, set(modules)


@pytest.mark.parametrize("arguments", [["--help"], ["check", "--help"], ["--version"]], ids=" ".join)
def test_help_imports_neither_parsers_nor_packs(files, arguments):
    code, modules = imported(files, *arguments)
    assert code == 0
    assert not modules & {*HEAVY, "cqos_ros2.pack", "cqos_ros2.rules", "cqos_core.config"}


def test_help_imports_no_command(files):
    _, modules = imported(files, "--help")
    assert not modules & {
        f"cqos_core.{name}" for name in ("cli.check", "cli.explain", "checking.checker", "packs.pack", "api")
    }


def test_checking_a_system_file_imports_no_other_parser(files):
    code, modules = imported(files, "check", "fits.yaml")
    assert code == 0
    assert modules & {*HEAVY} == {"yaml"}
    assert "cqos_ros2.pack" in modules


def test_checking_a_small_file_imports_nothing_that_it_does_not_use(files):
    """Each of these costs 1 to 30 ms. What a system states (bridges, chains, control flow) brings its own modules."""
    _, modules = imported(files, "check", "fits.yaml")
    unused = {
        "cqos_core.analysis.baseline",
        "cqos_core.cli.check_fixes",
        "cqos_core.cli.watch",
        "cqos_ros2_workspace.launch",
        "html",
        "tomllib",
        "cqos_core.matching.routes",
        "cqos_core.matching.bridge_values",
        "cqos_core.matching.pair_guarantees",
        "cqos_core.behaviour.paths.chains",
        "cqos_core.behaviour.paths.budgets",
        "cqos_core.behaviour.paths.bridge_findings",
        "cqos_core.behaviour.findings",
    }
    assert not modules & unused


def test_dataclasses_of_a_small_check_are_made_on_use(files):
    """See `cqos_core.model.dataclass`: each class that the library makes takes 0.5 ms."""
    script = (
        "import dataclasses, collections\n"
        "made, real = collections.Counter(), dataclasses._process_class\n"
        "def count(cls, init, *more):\n    made[cls.__module__] += init\n    return real(cls, init, *more)\n"
        "dataclasses._process_class = count\n"
        "from cqos_core.cli import main\n"
        "main(['check', 'fits.yaml'])\n"
        "import sys, json; sys.stderr.write(json.dumps({n: c for n, c in made.items() if c and n.startswith('cqos_core')}))\n"
    )
    done = subprocess.run(
        [sys.executable, "-c", script], cwd=files, capture_output=True, check=True, text=True, timeout=60
    )
    # A dataclass that inherits from another one is left to the library.
    assert sum(json.loads(done.stderr).values()) <= 3, done.stderr


def test_importing_the_package_imports_next_to_nothing(files):
    script = "import cqos_core, sys, json; print(json.dumps([name for name in sys.modules if name.startswith('cqos')]))"
    done = subprocess.run(
        [sys.executable, "-c", script], cwd=files, capture_output=True, check=True, text=True, timeout=60
    )
    assert json.loads(done.stdout) == ["cqos_core"]


def test_a_small_check_binds_only_rules_that_it_asks(files):
    script = (
        "from cqos_core.packs import bound_rule\n"
        "bound, real = [], bound_rule.bind\n"
        "bound_rule.bind = lambda *given: bound.append(given) or real(*given)\n"
        "from cqos_core.cli import main\n"
        "main(['check', 'fits.yaml'])\n"
        "import sys; sys.stderr.write(str(len(bound)))\n"
    )
    done = subprocess.run(
        [sys.executable, "-c", script], cwd=files, capture_output=True, check=True, text=True, timeout=60
    )
    assert 0 < int(done.stderr) <= 60
