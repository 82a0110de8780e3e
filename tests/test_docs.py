"""The documentation does what it says: its commands and examples run, its links lead somewhere, its lists are complete.

A page is followed from top to bottom, in a folder of its own that has the examples in it:

- a block with a title, as in ``` ```yaml title="robot.yaml" ```, is written to that file;
- a `console` block is executed, `cqos` without a shell in this process unless the page installs something. A line with
  `$ ` in front is a command, what follows is its output. There, `…` stands for any text within a line, and alone on a
  line for any lines. `echo $?` prints the exit code of the command before;
- a `python` block with prompts is a doctest. All of a page share their variables;
- a `sentence` block has one sentence of the rule language per line, in its one text form.

`python -m tests.test_docs [PAGE ...]` writes the output of commands and prompts that have another one now into the pages.
"""

from __future__ import annotations

import doctest
import importlib.util
import os
import re
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import pytest

from cqos_core.language import expression
from cqos_core.language.parser import parse
from tests.command_process import Done, run, run_here

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

ROOT = Path(__file__).resolve().parents[1]
FOLLOWED: tuple[str, ...] = (
    "README.md",
    "docs/quick-start.md",
    "docs/verdicts.md",
    "docs/silent-topic.md",
    "docs/ci.md",
    "docs/configuration.md",
    "docs/mixed-versions.md",
    "docs/behaviour.md",
    "docs/ros2-files.md",
    "docs/ros2-bridges.md",
    "docs/repair.md",
    "docs/ros2-launch.md",
    "docs/ros2-workspace.md",
    "docs/learn.md",
    "docs/dds.md",
    "docs/dds-xml.md",
    "docs/convert-and-diff.md",
    "docs/library.md",
    "docs/guarantees.md",
    "docs/time-and-budgets.md",
    "docs/mqtt.md",
    "docs/paper.md",
    "docs/conditions.md",
    "docs/packs.md",
    "docs/packs-python.md",
    "docs/pack-tutorial.md",
    "docs/plugins.md",
    "docs/plugin-examples.md",
    "examples/README.md",
)
if importlib.util.find_spec("ortools") is None and os.environ.get("CI") != "true":
    FOLLOWED = tuple(page for page in FOLLOWED if page not in {"docs/repair.md", "docs/library.md"})
PAGES = (*ROOT.glob("*.md"), *ROOT.glob("docs/*.md"), *ROOT.glob("examples/*.md"))
SHELL = re.compile(r"""[|&;<>$*?'"\\]""")
"""What makes a line one for the shell."""
INSTALLS = re.compile(r"^\$ .*pip install ", re.MULTILINE)
"""What makes a page one that installs something, which only a new process finds."""
OUR_OWN = frozenset({"COLUMNS", "CQOS_DEBUG", "FORCE_COLOR", "PYTEST_ADDOPTS"})
"""Variables of who runs these tests; they would change what the commands of a page print."""
BLOCK = re.compile(r'^```(?P<kind>\w+)(?: title="(?P<title>[^"]+)")?\n(?P<text>.*?)^```$', re.MULTILINE | re.DOTALL)


class Said(NamedTuple):
    """What a command or a Python prompt of a page printed, beside what the page says at `start` to `end`."""

    command: str
    start: int
    end: int
    expected: str
    actual: str


# Following a page ---------------------------------------------------------------------------------------------------


def follow(page: str, folder: Path) -> Iterator[Said]:
    """Do everything that a page says; yield what its commands print."""
    text = (ROOT / page).read_text(encoding="utf-8")
    shutil.copytree(ROOT / "examples", folder / "examples")
    cqos = run if INSTALLS.search(text) else run_here
    variables: dict[str, object] = {}
    code = 0
    for block in BLOCK.finditer(text):
        if block["title"]:
            file = folder / block["title"]
            file.parent.mkdir(parents=True, exist_ok=True)
            file.write_text(block["text"], encoding="utf-8")
        elif block["kind"] == "console":
            for command, start, end in commands(block):
                code, printed = execute(command, folder, code, cqos)
                yield Said(command, start, end, text[start:end], printed)
        elif block["kind"] == "python":
            yield from run_doctest(block, variables, page, folder)
        elif block["kind"] == "sentence":
            for line in block["text"].splitlines():
                assert str(parse(line)) == line


def commands(block: re.Match[str]) -> Iterator[tuple[str, int, int]]:
    """Yield every command of a console block, and where its output begins and ends."""
    found = list(re.finditer(r"^\$ (.+)\n", block["text"], re.MULTILINE))
    assert found, "a console block begins with a command"
    assert found[0].start() == 0, "a console block begins with a command"
    ends = [*(match.start() for match in found[1:]), len(block["text"])]
    offset = block.start("text")
    for match, end in zip(found, ends, strict=True):
        yield match[1], offset + match.end(), offset + end


def execute(command: str, folder: Path, code: int, cqos: Callable[..., Done]) -> tuple[int, str]:
    """Run one command of a page as a reader would, ``cqos`` by a function; return its exit code and all that it prints."""
    site = folder / ".site"
    path = os.pathsep.join([str(Path(sys.executable).parent), os.environ["PATH"]])
    python_path = os.pathsep.join(filter(None, [str(site), os.environ.get("PYTHONPATH")]))
    kept = {name: value for name, value in os.environ.items() if name not in OUR_OWN}
    environment = kept | {"PATH": path, "PYTHONPATH": python_path, "PIP_DISABLE_PIP_VERSION_CHECK": "1"}
    environment["XDG_CACHE_HOME"] = str(folder / ".cache")
    words = command.split()
    if words[0] == "cqos" and not SHELL.search(command):
        done = cqos(words[1:], folder, environment, together=True)
        return done.code, without_ends(done.out)
    # A reader installs into an environment of their own; this is one.
    command = command.replace(
        "pip install", f"{sys.executable} -m pip install --no-build-isolation --no-deps --no-index --target {site}"
    )
    ended = subprocess.run(
        ["sh", "-c", f"(exit {code}); {command}"],
        cwd=folder,
        env=environment,
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        encoding="utf-8",
        check=False,
        timeout=120,
    )
    return ended.returncode, without_ends(ended.stdout)


def without_ends(text: str) -> str:
    """Return a text without the spaces at the ends of its lines."""
    return "".join(f"{line.rstrip()}\n" for line in text.splitlines())


class Prompts(doctest.DocTestRunner):
    """Runs Python prompts and keeps what each of them printed."""

    def __init__(self) -> None:
        super().__init__(verbose=False, optionflags=doctest.ELLIPSIS | doctest.NORMALIZE_WHITESPACE)
        self.printed: list[tuple[doctest.Example, str]] = []

    def report_success(self, out: object, test: object, example: doctest.Example, got: str) -> None:
        self.printed.append((example, example.want))

    def report_failure(self, out: object, test: object, example: doctest.Example, got: str) -> None:
        self.printed.append((example, got))

    def report_unexpected_exception(self, out: object, test: object, example: object, exc_info: Any) -> None:
        raise exc_info[1]


def run_doctest(block: re.Match[str], variables: dict[str, object], page: str, folder: Path) -> Iterator[Said]:
    """Run the prompts of a block; yield what each of them prints."""
    text = block["text"]
    assert ">>> " in text, f"{page}: a block of Python without a title has prompts, so that it can be executed"
    test = doctest.DocTestParser().get_doctest(text, variables, page, page, 0)
    runner = Prompts()
    before = Path.cwd()
    os.chdir(folder)
    try:
        runner.run(test, clear_globs=False)
    finally:
        os.chdir(before)
    variables.update(test.globs)
    lines = text.splitlines(keepends=True)
    for example, got in runner.printed:
        first = example.lineno + example.source.count("\n")
        start = block.start("text") + len("".join(lines[:first]))
        yield Said(example.source.rstrip(), start, start + len(example.want), example.want, got)


def agrees(expected: str, actual: str) -> bool:
    """Whether a command printed what the page says; the output of a prompt that agrees is the page's own."""
    lines = (
        "(?:.*\n)*?" if line == "…" else re.escape(line).replace("…", ".*?") + "\n" for line in expected.splitlines()
    )
    return re.fullmatch("".join(lines), actual) is not None


def rewrite(page: str) -> None:
    """Write into a page what its commands print, where it says something else."""
    with tempfile.TemporaryDirectory() as folder:
        outputs = list(follow(page, Path(folder)))
    text = (ROOT / page).read_text(encoding="utf-8")
    for said in reversed(outputs):
        if not agrees(said.expected, said.actual):
            sys.stdout.write(f"{page}: {said.command}\n")
            text = text[: said.start] + said.actual + text[said.end :]
    (ROOT / page).write_text(text, encoding="utf-8")


# Tests --------------------------------------------------------------------------------------------------------------


@pytest.mark.skipif(os.name == "nt", reason="the pages are written for a POSIX shell")
@pytest.mark.parametrize("page", FOLLOWED)
def test_a_page_can_be_followed(page, tmp_path):
    for said in follow(page, tmp_path):
        assert agrees(said.expected, said.actual), (
            f"{page} says that `{said.command}` prints\n\n{said.expected}\nbut it prints\n\n{said.actual}\n"
            "if that is right, run: python -m tests.test_docs"
        )


def test_outputs_of_commands_and_prompts_are_renewed(tmp_path):
    page = tmp_path / "page.md"
    text = "```console\n$ echo one\n{}\n$ echo two…\n…\n```\n\n```python\n>>> def two():\n...     return 2\n>>> two()\n{}\n>>> 3\n3\n```\n"
    page.write_text(text.format("none", "7"), encoding="utf-8")
    rewrite(str(page))
    assert page.read_text(encoding="utf-8") == text.format("one", "2")


@pytest.mark.parametrize("page", PAGES, ids=lambda page: str(page.relative_to(ROOT)))
def test_links_lead_somewhere(page):
    text = re.sub(r"^```.*?^```$", "", page.read_text(encoding="utf-8"), flags=re.MULTILINE | re.DOTALL)
    for target in re.findall(r"\]\(([^)\s]+)\)", text):
        if "://" in target:
            continue
        path, _, anchor = target.partition("#")
        file = (page.parent / path).resolve() if path else page
        assert file.exists(), f"{target} does not exist"
        if anchor:
            assert anchor in headings(file), f"{target}: there is no such heading"


def headings(file: Path) -> set[str]:
    """The anchors of a page, as GitHub and zensical make them."""
    text = re.sub(r"^```.*?^```$", "", file.read_text(encoding="utf-8"), flags=re.MULTILINE | re.DOTALL)
    titles = re.findall(r"^#+ (.+)$", text, re.MULTILINE)
    return {re.sub(r"[^\w\- ]", "", title.lower()).replace(" ", "-") for title in titles}


@pytest.mark.parametrize("page", PAGES, ids=lambda page: str(page.relative_to(ROOT)))
def test_pages_name_no_machine(page):
    assert not re.search(r"/(?:work|tmp|home|root|Users)/", page.read_text(encoding="utf-8"))


@pytest.mark.parametrize("page", sorted((ROOT / "docs").glob("*.md")), ids=lambda page: page.name)
def test_a_page_is_read_in_one_go(page):
    text = page.read_text(encoding="utf-8")
    lines = [line for line in text.splitlines() if not line.startswith("|")]
    assert len(lines) <= 300 or page.name == "command.md", (
        "tables apart, a page has 300 lines at most: split it by reader"
    )


def test_every_page_is_in_the_index():
    index = (ROOT / "docs" / "README.md").read_text(encoding="utf-8")
    pages = {page.name for page in (ROOT / "docs").glob("*.md")} - {"README.md"}
    assert pages == {page for page in pages if f"]({page})" in index}


def test_contributors_find_every_file_that_is_named():
    text = (ROOT / "CONTRIBUTING.md").read_text(encoding="utf-8")
    named = re.findall(r"`((?:plugins|docs|tests|cqos_core)/[\w./]*)`", text)
    assert [name for name in named if not (ROOT / name).exists()] == []


def test_every_example_is_described():
    text = (ROOT / "examples" / "README.md").read_text(encoding="utf-8")
    names = {path.name for path in (ROOT / "examples").iterdir()} - {"README.md"}
    assert names == {name for name in names if f"]({name}" in text}


def test_every_word_of_the_language_is_explained():
    text = (ROOT / "docs" / "conditions.md").read_text(encoding="utf-8")
    words = {*expression.SCOPES, *expression.VALUE_FUNCTIONS, *expression.CONDITION_FUNCTIONS} - {"own"}
    assert words == {word for word in words if f"`{word}(" in text}


def test_the_map_has_every_sub_package():
    text = (ROOT / "ARCHITECTURE.md").read_text(encoding="utf-8")
    core = ROOT / "cqos_core"
    files = {file.name for file in core.glob("*.py")} - {"__init__.py"}
    folders = {f"{folder.parent.name}/" for folder in core.glob("*/__init__.py")}
    assert files | folders == {name for name in files | folders if f"`{name}`" in text}


if __name__ == "__main__":
    for each in sys.argv[1:] or FOLLOWED:
        rewrite(each)
