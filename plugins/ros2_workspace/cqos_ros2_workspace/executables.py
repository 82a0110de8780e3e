"""Which programs a package installs, and where they begin: CMakeLists.txt, setup.py and setup.cfg, read as text."""

from __future__ import annotations

import ast
import os
import posixpath
import re
from collections.abc import Iterator
from configparser import ConfigParser
from configparser import Error as ConfigError
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Final

from cqos_ros2_workspace.launch.values import Unknown

if TYPE_CHECKING:
    from cqos_ros2_workspace.launch.workspace import Workspace

_TESTS: Final = frozenset(
    ("test", "tests", "benchmark", "benchmarks", "doc", "docs", "third_party", "thirdparty", "3rdparty")
)
_TEST_NAMES: Final = re.compile(r"(test_.*|.*_test|conftest|gtest.*)\.\w+")
_MOST_COMMANDS: Final = 20_000
_DEEPEST: Final = 6
_COMMENT: Final = re.compile(r"#\[\[.*?\]\]|#[^\n]*", re.DOTALL)
_COMMAND: Final = re.compile(r"([A-Za-z_]\w*)\s*\(")
_WORD: Final = re.compile(r'"((?:[^"\\]|\\.)*)"|([^\s"()]+)')
_VARIABLE: Final = re.compile(r"\$\{(\w+)\}")
_MARKS: Final = frozenset(
    ("EXCLUDE_FROM_ALL", "WIN32", "MACOSX_BUNDLE", "NO_TARGET_LINK_LIBRARIES", "DIRECTORY", "PRIVATE", "PUBLIC")
)
_SCRIPT: Final = re.compile(r"\s*([\w.-]+)\s*=\s*([\w.]+)\s*:\s*(\w+)\s*")
_PREFIXES: Final = ("${CMAKE_CURRENT_SOURCE_DIR}/", "${PROJECT_SOURCE_DIR}/", "${CMAKE_SOURCE_DIR}/", "./")


@dataclass(slots=True)
class Executables:
    """The programs of a package.

    Attributes:
        sources: paths of the sources by executable, relative to the package.
        components: the class that an executable loads.
        scripts: module and function by executable.
        files: the Python file that an executable is.
    """

    sources: dict[str, list[str]] = field(default_factory=dict)
    components: dict[str, str] = field(default_factory=dict)
    scripts: dict[str, tuple[str, str]] = field(default_factory=dict)
    files: dict[str, str] = field(default_factory=dict)


def executables_of(name: str, workspace: Workspace) -> Executables:
    """Return the programs that a package installs."""
    found = Executables()
    for path in files(name, workspace):
        last = posixpath.basename(path)
        if last in {"CMakeLists.txt", "setup.py", "setup.cfg"}:
            data = workspace.read(path, None)
            if not isinstance(data, Unknown):
                _installed(last, data, posixpath.dirname(os.path.relpath(path, workspace.packages[name])), found)
    return found


def files(name: str, workspace: Workspace) -> Iterator[str]:
    """Yield the files of a package, without its tests."""
    folder = workspace.packages[name]
    for path in sorted(path for paths in workspace.files_of(name).values() for path in paths):
        *inner, last = path.removeprefix(folder).split("/")
        if _TESTS.isdisjoint(inner) and not _TEST_NAMES.fullmatch(last):
            yield path


def _installed(last: str, data: bytes, folder: str, found: Executables) -> None:
    if last == "setup.py":
        read_setup_py(data, found)
    elif last == "setup.cfg":
        read_setup_cfg(data.decode("utf-8", "replace"), found)
    else:
        read_cmake(data.decode("utf-8", "replace"), folder, found)


Command = tuple[str, list[str]]


def read_cmake(text: str, folder: str, found: Executables) -> None:
    """Add the programs that a CMakeLists.txt builds and installs."""
    commands = list(_commands(_COMMENT.sub("", text)))
    _Cmake(folder, found).run(commands, {})


def _commands(text: str) -> Iterator[Command]:
    at = 0
    for _ in range(_MOST_COMMANDS):
        match = _COMMAND.search(text, at)
        if match is None:
            return
        depth, end = 1, match.end()
        while end < len(text) and depth:
            depth += (text[end] == "(") - (text[end] == ")")
            end += 1
        words = [quoted or plain for quoted, plain in _WORD.findall(text[match.end() : end - 1])]
        yield match[1].lower(), words
        at = end


class _Cmake:
    """One walk of a CMakeLists.txt: variables, functions and loops over lists; conditions are taken as true."""

    def __init__(self, folder: str, found: Executables) -> None:
        self.folder, self.found = folder, found
        self.functions: dict[str, tuple[list[str], list[Command]]] = {}
        self.steps = 0

    def run(self, commands: list[Command], variables: dict[str, list[str]], depth: int = 0) -> None:
        at = 0
        while at < len(commands) and self.steps < _MOST_COMMANDS:
            self.steps += 1
            name, words = commands[at]
            if name in {"function", "macro", "foreach"}:
                end = self._end(commands, at, name)
                inner = commands[at + 1 : end]
                if name == "foreach":
                    self._each(words, inner, variables, depth)
                elif words:
                    self.functions[words[0].lower()] = (words[1:], inner)
                at = end
            else:
                self._one(name, self._filled(words, variables), variables, depth)
            at += 1

    @staticmethod
    def _end(commands: list[Command], at: int, name: str) -> int:
        depth = 0
        for index in range(at, len(commands)):
            depth += (commands[index][0] == name) - (commands[index][0] == f"end{name}")
            if depth == 0:
                return index
        return len(commands)

    def _each(self, words: list[str], inner: list[Command], variables: dict[str, list[str]], depth: int) -> None:
        if not words or depth > _DEEPEST:
            return
        rest = [each for each in words[1:] if each not in {"IN", "ITEMS"}]
        if "LISTS" in rest:
            rest = [f"${{{each}}}" for each in rest if each != "LISTS"]
        for value in self._filled(rest, variables):
            variables[words[0]] = [value]
            self.run(inner, variables, depth + 1)

    def _filled(self, words: list[str], variables: dict[str, list[str]]) -> list[str]:
        found: list[str] = []
        for each in words:
            word = each
            for prefix in _PREFIXES:
                word = word.removeprefix(prefix)
            whole = _VARIABLE.fullmatch(word)
            if whole is not None:
                found += variables.get(whole[1], [])
            else:
                text = _VARIABLE.sub(lambda each: ";".join(variables.get(each[1], [])), word)
                found += text.split(";") if ";" in text else [text]
        return found

    def _one(self, name: str, words: list[str], variables: dict[str, list[str]], depth: int) -> None:
        if name == "project" and words:
            variables["PROJECT_NAME"] = [words[0]]
        elif name == "set" and words:
            variables[words[0]] = [each for each in words[1:] if each not in {"PARENT_SCOPE", "CACHE"}]
        elif name == "list" and len(words) > 1 and words[0] == "APPEND":
            variables.setdefault(words[1], []).extend(words[2:])
        elif name in {"add_executable", "ament_auto_add_executable", "target_sources"} and words:
            if name != "target_sources":
                self.found.sources[words[0]] = []
            self.found.sources.get(words[0], []).extend(
                posixpath.normpath(posixpath.join(self.folder, each)) for each in words[1:] if each not in _MARKS
            )
        elif name == "rclcpp_components_register_node":
            self._registered(words)
        elif name == "install" and words[:1] == ["PROGRAMS"]:
            self._installed(words[1:])
        elif name == "set_target_properties" and "OUTPUT_NAME" in words and len(words) > words.index("OUTPUT_NAME") + 1:
            target, new = words[0], words[words.index("OUTPUT_NAME") + 1]
            if target in self.found.sources:
                self.found.sources[new] = self.found.sources.pop(target)
        elif name in self.functions and depth < _DEEPEST:
            names, inner = self.functions[name]
            bound = {key: [value] for key, value in zip(names, words, strict=False)}
            self.run(inner, {**variables, **bound, "ARGN": words[len(names) :]}, depth + 1)

    def _registered(self, words: list[str]) -> None:
        if "PLUGIN" in words and "EXECUTABLE" in words:
            plugin, executable = (words[words.index(key) + 1 :][:1] for key in ("PLUGIN", "EXECUTABLE"))
            if plugin and executable:
                self.found.components[executable[0]] = plugin[0]

    def _installed(self, words: list[str]) -> None:
        rename = words[words.index("RENAME") + 1] if "RENAME" in words[:-1] else ""
        for each in words:
            if each in {"DESTINATION", "RENAME", "PERMISSIONS"}:
                break
            self.found.files[rename or posixpath.basename(each)] = posixpath.normpath(posixpath.join(self.folder, each))


def read_setup_py(text: bytes, found: Executables) -> None:
    """Add the scripts that a setup.py declares; it is read as text, not run."""
    try:
        tree = ast.parse(text)
    except (SyntaxError, ValueError, RecursionError, MemoryError):
        return
    for node in ast.walk(tree):
        if isinstance(node, ast.Constant) and isinstance(node.value, str):
            _script(node.value, found)


def read_setup_cfg(text: str, found: Executables) -> None:
    """Add the scripts that a setup.cfg declares."""
    parser = ConfigParser(interpolation=None, strict=False)
    try:
        parser.read_string(text)
        lines = parser.get("options.entry_points", "console_scripts", fallback="")
    except (ConfigError, ValueError):
        return
    for line in lines.splitlines():
        _script(line, found)


def _script(text: str, found: Executables) -> None:
    match = _SCRIPT.fullmatch(text)
    if match is not None:
        found.scripts[match[1]] = (match[2], match[3])
