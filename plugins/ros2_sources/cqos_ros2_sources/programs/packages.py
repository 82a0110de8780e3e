"""Reads a package of a workspace: its sources in C++ and Python as programs, and what it installs. Limits are here."""

from __future__ import annotations

import os
import posixpath
import re
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from cqos_core.model.settings import Place
from cqos_ros2_sources.programs.program import Program
from cqos_ros2_workspace.executables import Executables, executables_of, files
from cqos_ros2_workspace.launch.values import Unknown

if TYPE_CHECKING:
    from cqos_ros2_sources.walk.call_tables import Table
    from cqos_ros2_workspace.launch.workspace import Workspace

MOST_FILES: Final = 2_000
"""How many sources of one package are read."""
MOST_DEPENDENCIES: Final = 12
_SOURCES: Final = (".cpp", ".hpp", ".h", ".cc", ".hh", ".cxx", ".hxx", ".py")
_IMPORTS: Final = re.compile(rb"""^[ \t]*(?:#[ \t]*include[ \t]*[<"](\w+)/|(?:from|import)[ \t]+(\w+))""", re.MULTILINE)
"""What a source includes or imports, by the package that it is in."""
_EXPORTS: Final = re.compile(
    rb"\b(?![A-Z_]*TRANSIENT_LOCAL\b)[A-Z][A-Z0-9_]*_(?:EXPORT|PUBLIC|LOCAL|API)\b(?=\s+(?:[A-Za-z_~]|::))"
)
"""Macros before names of classes and functions, which no parser of C++ understands."""
_MARKS: Final = re.compile(
    rb"(?<=\b(?:class|truct) )\s*[A-Z][A-Z0-9_]*_[A-Z0-9_]*(?=\s+[A-Za-z_]\w*\s*(?:final\s*)?[:{])"
)
"""Any other macro between `class` or `struct` and a name; what stands before must have one length, thus `truct`."""
_INCLUDES: Final = re.compile(rb"^\s*#\s*include\s*[<\"]([^>\"\n]+)[>\"]", re.MULTILINE)
_DEPENDS: Final = re.compile(rb"<(?:depend|build_depend|exec_depend)[^>]*>\s*([\w-]+)\s*<")


@dataclass(slots=True)
class Parsed:
    """Sources of a workspace that were read before.

    Attributes:
        programs: what the sources of a package define, by package and language.
        digests: of the sources of packages.
        sets: of parameters, by package.
    """

    programs: dict[tuple[str, str], Program] = field(default_factory=dict)
    digests: dict[str, bytes] = field(default_factory=dict)
    sets: dict[str, dict[str, Any]] = field(default_factory=dict)


class NoParserError(Exception):
    """The parser of C++ is not installed."""


@dataclass(slots=True)
class Package:
    """One package.

    Attributes:
        folder: where it is.
        programs: by language; a language without files is absent.
        own: paths of its own files, as in places.
        gaps: files that were not read, and why.
        present: paths of all its files, also of those that are not read.
    """

    name: str
    folder: str
    programs: dict[str, Program] = field(default_factory=dict)
    executables: Executables = field(default_factory=Executables)
    own: set[str] = field(default_factory=set)
    gaps: list[tuple[str, Place]] = field(default_factory=list)
    present: frozenset[str] = frozenset()


def read_package(name: str, workspace: Workspace, tables: dict[str, Table], parsed: Parsed) -> Package:
    """Return a package with its sources, and with those of the packages in the workspace that it depends on.

    Args:
        name: of the package.
        workspace: where it is.
        tables: calls by language.
        parsed: what sources of packages define that were parsed before; it is added to.

    Raises:
        NoParserError: it has sources in C++, and their parser is not installed.
    """
    present = frozenset(path for paths in workspace.files_of(name).values() for path in paths)
    package = Package(name, workspace.packages[name], executables=executables_of(name, workspace), present=present)
    others = dependencies(name, workspace)
    for language, table in tables.items():
        endings = _endings(table)
        if not any(path.endswith(endings) for path in files(name, workspace)):
            continue
        own = _program(name, language, table, workspace, parsed)
        program = package.programs[language] = Program(language)
        for each in (own, *(_program(other, language, table, workspace, parsed) for other in others)):
            program.add(each)
        for other in (*reversed(others), name):
            program.parameter_sets.update(_sets(other, workspace, parsed))
        for key in ("registered", "plugins", "scripts", "gaps"):
            setattr(program, key, getattr(own, key))
        package.own |= {path for path in files(name, workspace) if path.endswith(endings)}
        package.gaps += own.gaps
    return package


def _endings(table: Table) -> tuple[str, ...]:
    """Return the endings of sources of nodes: programs in C cannot use rclcpp."""
    return tuple(each for each in table.lists["files"] if each not in {".c", ".ino"})


def _sets(name: str, workspace: Workspace, parsed: Parsed) -> dict[str, Any]:
    if name not in parsed.sets:
        from cqos_ros2_sources.walk.parameter_sets import read_sets

        parsed.sets[name] = read_sets(name, workspace)
    return parsed.sets[name]


def _program(name: str, language: str, table: Table, workspace: Workspace, parsed: Parsed) -> Program:
    """Return what the sources of one package define; they are parsed once."""
    key = (name, language)
    if key not in parsed.programs:
        program = parsed.programs[key] = Program(language)
        paths = [path for path in files(name, workspace) if path.endswith(_endings(table))]
        if len(paths) > MOST_FILES:
            cause = f"only {MOST_FILES} of its {len(paths)} files are read"
            program.gaps.append((cause, Place(workspace.packages[name])))
        if language == "cpp":
            read_cpp(paths[:MOST_FILES], workspace, program)
        else:
            read_python(paths[:MOST_FILES], name, workspace, program)
    return parsed.programs[key]


def dependencies(name: str, workspace: Workspace) -> list[str]:
    """Return the packages of the workspace that a package depends on, near ones first.

    Those that its sources include or import count, even where its package.xml does not list them: a build may find them.
    """
    found: list[str] = []
    waiting = [name]
    while waiting and len(found) < MOST_DEPENDENCIES:
        package = waiting.pop(0)
        data = workspace.read(posixpath.join(workspace.packages[package], "package.xml"), None)
        listed = _DEPENDS.findall(data) if isinstance(data, bytes) else []
        for each in (*listed, *_imported(package, workspace)):
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


def _imported(name: str, workspace: Workspace) -> list[bytes]:
    """Return the first parts of what sources of a package include or import."""
    found: dict[tuple[bytes, bytes], None] = {}
    for path in [each for each in files(name, workspace) if each.endswith(_SOURCES)][:MOST_FILES]:
        data = workspace.read(path, None)
        found.update(dict.fromkeys(_IMPORTS.findall(data)) if isinstance(data, bytes) else {})
    return [each[0] or each[1] for each in found]


def read_python(
    paths: list[str], package: str, workspace: Workspace, program: Program, inner: str | None = None
) -> None:
    """Add what files of Python define; ``inner`` is the path of a file that is in no package."""
    from cqos_ros2_sources.programs.python_files import read_module

    for path in paths:
        data = workspace.read(path, Place(path))
        if isinstance(data, Unknown):
            program.gaps.append((data.cause, Place(path)))
            continue
        try:
            read_module(data, path, _module(path if inner is None else inner, package, workspace), program)
        except (SyntaxError, ValueError) as error:
            program.gaps.append(
                (f"it is no Python that can be read: {str(error)[:120]}", Place(path, getattr(error, "lineno", None)))
            )
        except (RecursionError, MemoryError):
            program.gaps.append(("it is nested too deeply", Place(path)))


def _module(path: str, package: str, workspace: Workspace) -> str:
    base = workspace.packages.get(package)
    inner = Path((path if base is None else os.path.relpath(path, base)).removesuffix(".py")).parts
    inner = inner[:-1] if inner[-1] == "__init__" else inner
    return ".".join(inner) or package


def _without_marks(data: bytes) -> bytes:
    """Return a file of C++ with spaces in place of macros that its parser does not understand."""
    for each in (_EXPORTS, _MARKS):
        data = each.sub(lambda found: b" " * len(found[0]), data)
    return data


def read_cpp(paths: list[str], workspace: Workspace, program: Program) -> None:
    """Add what files of C and C++ define.

    Raises:
        NoParserError: their parser is not installed.
    """
    from cqos_ros2_sources.programs.cpp_expressions import CppFile

    try:
        from cqos_ros2_sources.programs.cpp_files import complete, parser, read_definitions
        from cqos_ros2_sources.programs.cpp_preprocessor import divided, read_macros, without_lines
        from cqos_ros2_sources.programs.cpp_statements import block

        parse = parser()
    except ImportError:
        raise NoParserError from None
    for path in sorted(
        paths, key=lambda each: not each.endswith((".h", ".hpp", ".hh", ".hxx", ".ipp", ".inl", ".tpp"))
    ):
        data = workspace.read(path, Place(path))
        if isinstance(data, Unknown):
            program.gaps.append((data.cause, Place(path)))
            continue
        program.includes[path] = [each.decode("utf-8", "replace") for each in _INCLUDES.findall(data)]
        root = parse.parse(_without_marks(data)).root_node
        lines = divided(data) if root.has_error else []
        if lines:
            data = without_lines(data, lines)
            root = parse.parse(_without_marks(data)).root_node
            program.gaps.append(
                (
                    "a condition of the preprocessor divides a block or a list of parameters; its first branch is read",
                    Place(path, lines[0]),
                )
            )
        file = CppFile(path, block)
        read_macros(root, file, parse, program)
        try:
            read_definitions(root, file, program)
        except RecursionError:
            program.gaps.append(("it is nested too deeply", Place(path)))
    complete(program)
