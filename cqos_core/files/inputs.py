"""Reads the inputs of the library as one system: paths, bytes, and systems that a program built."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from os import PathLike, fspath
from pathlib import Path
from typing import Final, TypeAlias

from cqos_core.files.path_loader import load_paths
from cqos_core.files.source_files import open_file, read_path
from cqos_core.files.source_reader import GivenSource, read_together
from cqos_core.files.system_copy import copied
from cqos_core.files.system_faults import faults
from cqos_core.files.system_merge import merge
from cqos_core.model.problems import InputError, Problem
from cqos_core.model.source import Source, no_files
from cqos_core.model.system import (
    System,
)

Input: TypeAlias = "str | PathLike[str] | bytes | System"

_NO_INPUT: Final = "an input is a path, bytes or a System, found {}; pass several one by one: `*inputs`"


def read(*inputs: Input, importer: str | None = None, protocol: str | None = None) -> System:
    """Read paths, directories, bytes or systems into one system; formats are detected.

    ``protocol`` is that of inputs that state none. Systems are copied, so that those of the caller do not change.

    Raises:
        InputError: with every problem of every input.
    """
    found: dict[int, list[System]] = {}
    given: dict[int, GivenSource] = {}
    problems: dict[int, Sequence[Problem]] = {}
    for position, each in enumerate(inputs):
        if isinstance(each, System):
            if wrong := faults(each):
                problems[position] = wrong
                continue
            found[position] = [replace(copied(each), protocol=each.protocol or protocol)]
            continue
        if not isinstance(each, (bytes, str, PathLike)):
            raise TypeError(_NO_INPUT.format(type(each).__name__))
        try:
            if not isinstance(each, bytes) and Path(each).is_dir():
                loaded = load_paths([fspath(each)], importer, protocol=protocol)
                problems[position] = loaded.problems
                found[position] = [system for _, system in loaded.systems]
            else:
                opener = no_files if isinstance(each, bytes) else open_file
                given[position] = GivenSource(source_of(inputs, position), opener)
        except InputError as error:
            problems[position] = error.problems
    others = [system for systems in found.values() for system in systems]
    results = read_together([*given.values()], importer, protocol=protocol, others=others)
    for position, result in zip(given, results, strict=True):
        if isinstance(result, System):
            found[position] = [result]
        else:
            problems[position] = result.problems
    all_problems = [problem for position in sorted(problems) for problem in problems[position]]
    if all_problems or not any(found.values()):
        raise InputError(all_problems or [Problem("CQ003", "there is nothing to read")])
    return merge([system for position in sorted(found) for system in found[position]])


def source_of(inputs: Sequence[Input], position: int) -> Source:
    """Return a file as a source, or bytes under a unique name."""
    data = inputs[position]
    if not isinstance(data, bytes):
        return read_path(fspath(data))  # type: ignore[arg-type]
    number = sum(isinstance(other, bytes) for other in inputs[: position + 1])
    return Source("<bytes>" if number == 1 else f"<bytes {number}>", data)
