"""Reads a package of a workspace: its sources in C++ and Python as programs, and what it installs. Limits are here."""

from __future__ import annotations

import os
import posixpath
import re
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from cqos_core.model.system import Place
from cqos_ros2.launch.values import Unknown
from cqos_ros2.learn.executables import Executables, read_cmake, read_setup_cfg, read_setup_py
from cqos_ros2.learn.program import Program

if TYPE_CHECKING:
    from collections.abc import Iterator

    from cqos_ros2.launch.workspace import Workspace
    from cqos_ros2.learn.program import Expression
    from cqos_ros2.learn.table import Table

MOST_FILES: Final = 2_000
"""How many sources of one package are read."""
MOST_DEPENDENCIES: Final = 12
MOST_NESTED: Final = 400
"""How deep the syntax of a file may be nested."""
_TESTS: Final = frozenset(
    ("test", "tests", "benchmark", "benchmarks", "doc", "docs", "third_party", "thirdparty", "3rdparty")
)
_TEST_NAMES: Final = re.compile(r"(test_.*|.*_test|conftest|gtest.*)\.\w+")
_EXPORTS: Final = re.compile(rb"\b[A-Z][A-Z0-9_]*_(?:EXPORT|PUBLIC|LOCAL|API)\b")
"""Macros before names of classes and functions, which no parser of C++ understands."""
_DEPENDS: Final = re.compile(rb"<(?:depend|build_depend|exec_depend)[^>]*>\s*([\w-]+)\s*<")


class NoParserError(Exception):
    """The extra ``source`` is not installed."""


@dataclass(slots=True)
class Package:
    """One package.

    Attributes:
        folder: where it is.
        programs: by language; a language without files is absent.
        own: paths of its own files, as in places.
        gaps: files that were not read, and why.
    """

    name: str
    folder: str
    programs: dict[str, Program] = field(default_factory=dict)
    executables: Executables = field(default_factory=Executables)
    own: set[str] = field(default_factory=set)
    gaps: list[tuple[str, Place]] = field(default_factory=list)


def read_package(name: str, workspace: Workspace, tables: dict[str, Table]) -> Package:
    """Return a package with its sources, and with those of the packages in the workspace that it depends on.

    Raises:
        NoParserError: it has sources in C++, and their parser is not installed.
    """
    package = Package(name, workspace.packages[name])
    for path in _files(name, workspace):
        last = posixpath.basename(path)
        if last in {"CMakeLists.txt", "setup.py", "setup.cfg"}:
            data = workspace.read(path, None)
            if not isinstance(data, Unknown):
                _installed(last, data, posixpath.dirname(os.path.relpath(path, package.folder)), package.executables)
    others = _dependencies(name, workspace)
    for language, table in tables.items():
        endings = table.lists["files"]
        if not any(path.endswith(endings) for path in _files(name, workspace)):
            continue
        program = package.programs[language] = Program(language)
        macros: dict[str, Expression] = {}
        for each in (name, *others):
            target = (
                program
                if each == name
                else Program(language, program.classes, program.functions, program.constants, program.aliases)
            )
            paths = [path for path in _files(each, workspace) if path.endswith(endings)]
            if len(paths) > MOST_FILES and each == name:
                package.gaps.append((f"only {MOST_FILES} of its {len(paths)} files are read", Place(package.folder)))
            _read(paths[:MOST_FILES], each, workspace, target, macros)
            if each == name:
                package.own |= set(paths)
                package.gaps += target.gaps
    return package


def _files(name: str, workspace: Workspace) -> Iterator[str]:
    """Yield the files of a package, without its tests."""
    folder = workspace.packages[name]
    for path in sorted(path for paths in workspace.files_of(name).values() for path in paths):
        inner = Path(os.path.relpath(path, folder)).parts
        if not _TESTS & set(inner[:-1]) and not _TEST_NAMES.fullmatch(inner[-1]):
            yield path


def _dependencies(name: str, workspace: Workspace) -> list[str]:
    """Return the packages of the workspace that a package depends on, near ones first."""
    found: list[str] = []
    waiting = [name]
    while waiting and len(found) < MOST_DEPENDENCIES:
        data = workspace.read(posixpath.join(workspace.packages[waiting.pop(0)], "package.xml"), None)
        for each in _DEPENDS.findall(data) if isinstance(data, bytes) else ():
            other = each.decode("ascii", "replace")
            if (
                other in workspace.packages
                and other != name
                and other not in found
                and not other.endswith(("_msgs", "_interfaces"))
            ):
                found.append(other)
                waiting.append(other)
    return found[:MOST_DEPENDENCIES]


def _installed(last: str, data: bytes, folder: str, found: Executables) -> None:
    if last == "setup.py":
        read_setup_py(data, found)
    elif last == "setup.cfg":
        read_setup_cfg(data.decode("utf-8", "replace"), found)
    else:
        read_cmake(data.decode("utf-8", "replace"), folder, found)


def _read(
    paths: list[str], package: str, workspace: Workspace, program: Program, macros: dict[str, Expression]
) -> None:
    if program.language == "cpp":
        _read_cpp(paths, workspace, program, macros)
        return
    from cqos_ros2.learn.python_files import read_module

    for path in paths:
        data = workspace.read(path, Place(path))
        if isinstance(data, Unknown):
            program.gaps.append((data.cause, Place(path)))
            continue
        try:
            read_module(data, path, _module(path, package, workspace), program)
        except (SyntaxError, ValueError) as error:
            program.gaps.append(
                (f"it is no Python that can be read: {str(error)[:120]}", Place(path, getattr(error, "lineno", None)))
            )
        except (RecursionError, MemoryError):
            program.gaps.append(("it is nested too deeply", Place(path)))


def _module(path: str, package: str, workspace: Workspace) -> str:
    inner = Path(os.path.relpath(path, workspace.packages[package]).removesuffix(".py")).parts
    inner = inner[:-1] if inner[-1] == "__init__" else inner
    return ".".join(inner) or package


def _read_cpp(paths: list[str], workspace: Workspace, program: Program, macros: dict[str, Expression]) -> None:
    from cqos_ros2.learn.cpp_expressions import CppFile

    try:
        from cqos_ros2.learn.cpp_files import block, complete, parser, read_definitions, read_macros

        parse = parser()
    except ImportError:
        raise NoParserError from None
    trees: list[tuple[Any, CppFile]] = []
    for path in sorted(paths, key=lambda each: not each.endswith((".h", ".hpp", ".hh", ".hxx"))):
        data = workspace.read(path, Place(path))
        if isinstance(data, Unknown):
            program.gaps.append((data.cause, Place(path)))
            continue
        root = parse.parse(_EXPORTS.sub(lambda each: b" " * len(each[0]), data)).root_node
        if _deeper(root, MOST_NESTED):
            program.gaps.append(("it is nested too deeply", Place(path)))
            continue
        file = CppFile(path, block, macros)
        trees.append((root, file))
        read_macros(root, file, parse, program)
    for root, file in trees:
        try:
            read_definitions(root, file, program)
        except RecursionError:
            program.gaps.append(("it is nested too deeply", Place(file.path)))
    complete(program)


def _deeper(root: Any, limit: int) -> bool:
    """Whether a syntax tree is deeper than a limit."""
    cursor, depth = root.walk(), 0
    while True:
        if cursor.goto_first_child():
            depth += 1
            if depth > limit:
                return True
            continue
        while not cursor.goto_next_sibling():
            depth -= 1
            if not cursor.goto_parent():
                return False
