"""Python 3.10 to 3.14: what one interpreter cannot try is held by what the sources say."""

import ast
import re
import sys
import tomllib
from pathlib import Path

import pytest

parser = pytest.importorskip("re._parser")

ROOT = Path(__file__).resolve().parent.parent
SHIPPED = [ROOT / "cqos_core", *sorted(ROOT.glob("plugins/*/cqos_*")), ROOT / "examples"]
VERSIONS = ["3.10", "3.11", "3.12", "3.13", "3.14"]
NEWER = {"POSSESSIVE_REPEAT", "ATOMIC_GROUP"}  # parts of patterns that Python 3.10 does not know


def modules():
    """Every shipped module that imports the module ``re`` itself, with its tree."""
    for file in sorted(file for folder in SHIPPED for file in folder.rglob("*.py")):
        text = file.read_text(encoding="utf-8")
        if "import re" not in text:
            continue
        tree = ast.parse(text, feature_version=(3, 10))
        if file.name != "regular_expressions.py" and any(
            alias.name == "re" for node in ast.walk(tree) if isinstance(node, ast.Import) for alias in node.names
        ):
            yield file, tree


def patterns(tree):
    """Texts that may be patterns, the fixed parts of f-strings among them."""
    for node in ast.walk(tree):
        if isinstance(node, ast.Constant) and isinstance(node.value, str | bytes):
            yield node.lineno, node.value


WRITTEN = re.compile(r"[*+?}]\+|\(\?>")  # how these are written; most texts have neither


def newer(pattern):
    """Say whether a pattern has what Python 3.10 does not know."""
    if not WRITTEN.search(pattern if isinstance(pattern, str) else pattern.decode("latin-1")):
        return False
    try:
        parsed = parser.parse(pattern)
    except (re.error, ValueError, OverflowError, TypeError):
        return False
    waiting = [parsed]
    while waiting:
        part = waiting.pop()
        if str(part) in NEWER:
            return True
        if isinstance(part, list | tuple) or type(part).__name__ == "SubPattern":
            waiting.extend(part)
    return False


def test_the_search_finds_them():
    assert [newer(text) for text in ("a*+b", "(?:x(?>ab?))", "a+b", "C++ or g++")] == [True, True, False, True]


@pytest.mark.filterwarnings("ignore::FutureWarning", "ignore::DeprecationWarning")  # of texts that are no patterns
def test_patterns_of_newer_pythons_are_compiled_by_regular():
    """Where they stand beside a plain ``import re``, Python 3.10 fails on import."""
    # "++" of a name such as g++ is such a pattern too, so only texts with an escape, a class or a group count.
    found = [
        f"{file.relative_to(ROOT)}:{line}: {text!r}"
        for file, tree in modules()
        for line, text in patterns(tree)
        if re.search(r"[\\(\[]", text if isinstance(text, str) else text.decode("latin-1")) and newer(text)
    ]
    assert found == []


@pytest.mark.parametrize("project", [ROOT, *(file.parent for file in ROOT.glob("plugins/*/pyproject.toml"))])
def test_every_distribution_says_the_same_versions(project):
    metadata = tomllib.loads((project / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    said = re.findall(r"Python :: (3\.\d+)", "\n".join(metadata["classifiers"]))
    assert (metadata["requires-python"], said) == (f">={VERSIONS[0]}", VERSIONS)


def test_linters_hold_the_oldest_version():
    settings = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["tool"]
    assert settings["ruff"]["target-version"] == "py" + VERSIONS[0].replace(".", "")
    assert f"{sys.version_info.major}.{sys.version_info.minor}" in VERSIONS
