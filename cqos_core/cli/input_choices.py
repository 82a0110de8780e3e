"""Notes and problems about inputs that were detected at a path, with the command lines that read them."""

from __future__ import annotations

import os
import shlex
from typing import TYPE_CHECKING, Final

import click

from cqos_core.cli.parameters import Run
from cqos_core.model.finding import plural
from cqos_core.model.folder_suggestion import ProblemWithLines
from cqos_core.model.grouping import grouped
from cqos_core.model.settings import Place

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from cqos_core.files.detected_inputs import DetectedInput
    from cqos_core.files.file_search import File
    from cqos_core.files.path_loader import Loaded
    from cqos_core.model.problems import Problem
    from cqos_core.plugins import ImporterInfo

_OF_A_KIND: Final = 3
"""How many files of one format are listed, each with its command; one, if there are more formats than this."""
_FOLDERS: Final = 5
"""How many folders are listed that need a choice each."""


def input_notes(loaded: Loaded, paths: Sequence[str]) -> list[str]:
    """Return notes on inputs that are read without being named, and on files that are not read because of them."""
    detected = loaded.detected
    notes = [
        f"{' and '.join(item.entrance.reason for item in same)}, so {'they are' if same[1:] else 'it is'} checked, "
        f"as `{_command(same, paths)}` does"
        for same in detected.taken.values()
    ]
    notes += [
        _at_hand(item) for item in detected.beside if item.entrance.inside and loaded.systems and not detected.open
    ]
    left = [] if detected.open else [each for each, _ in loaded.left]
    if left:
        one = f"cqos check {shlex.quote(_named(left[0], loaded.left[0][1]))}"
        notes.append(f"{plural(len(left), 'part')} of other systems there not read; `{one}` checks the first")
    unused = [] if detected.open else loaded.unused
    if unused:
        some = ", ".join([*unused[:_OF_A_KIND], *(["..."] if unused[_OF_A_KIND:] else [])])
        notes.append(f"{plural(len(unused), 'file')} there that nothing refers to, so not read: {some}")
    return notes


def choice_problems(loaded: Loaded, paths: Sequence[str]) -> list[Problem]:
    """Return a problem for each path that offers several inputs, with the command line of each."""
    by_path = grouped((item.path, item) for item in loaded.detected.open)
    return [_problem(path, detected, loaded, paths) for path, detected in by_path.items()]


def command_problems(loaded: Loaded) -> list[Problem]:
    """Return a problem for each path that only another command makes readable, with its command lines."""
    return [
        ProblemWithLines("CQ003", item.entrance.message, Place(item.path), "write", item.entrance.commands)
        for item in loaded.detected.beside
    ]


def lacking_problems(loaded: Loaded) -> list[Problem]:
    """Return which files in folders are not read, and the line that installs what reads them."""
    if not loaded.lacking:
        return []
    from cqos_core.model.optional_features import advice

    return [
        ProblemWithLines(
            "CQ003", f"`{row.distribution}` reads it and is not installed", Place(path), "write", (advice(row.name),)
        )
        for path, row in loaded.lacking.items()
    ]


def _problem(path: str, detected: Sequence[DetectedInput], loaded: Loaded, paths: Sequence[str]) -> Problem:
    left = grouped((info.name, (file, info)) for file, info in loaded.left if file.folder == path)
    beside = [item for item in loaded.detected.beside if item.path == path]
    first = detected[0]
    if not left and not beside and len(detected) == 1:
        message = f"{first.entrance.message}, and {_option(first)} names none, so nothing that they start is checked"
        own = (f"  {_command([first], paths)}", *first.entrance.details)
        return ProblemWithLines("CQ062", message, Place(path), "write, for the most likely one,", own)
    count = len(detected) + len(beside) + sum(map(len, left.values()))
    message = f"{count} inputs lie here that need a command each, so none of them is checked"
    lines: list[str] = []
    for item in detected[:_FOLDERS]:
        lines += [f"{item.entrance.folder}: {item.entrance.message}", f"  {_command([item], paths)}"]
        lines += item.entrance.details if item is first else ()
    for item in beside[:_FOLDERS]:
        lines += [f"{item.entrance.folder}: {item.entrance.message}", *(f"  {each}" for each in item.entrance.commands)]
    more = sum(max(len(each) - _FOLDERS, 0) for each in (detected, beside))
    lines += [f"and {more} more folders"] if more else []
    for parts in left.values():
        lines += _listed(parts, _OF_A_KIND if len(left) <= _OF_A_KIND else 1)
    advice = "write one of these commands; the most likely is the first"
    return ProblemWithLines("CQ062", message, Place(path), advice, (*lines,))


def _at_hand(item: DetectedInput) -> str:
    return f"{item.entrance.folder}: {item.entrance.message}; write `{item.entrance.commands[0]}`"


def _listed(parts: Sequence[tuple[File, ImporterInfo]], most: int) -> Iterator[str]:
    for file, info in parts[:most]:
        named = _named(file, info)
        yield f"{named}: {info.summary}"
        yield f"  cqos check {shlex.quote(named)}"
    if len(parts) > most:
        yield f"and {len(parts) - most} more of this format"


def _named(file: File, info: ImporterInfo) -> str:
    """Return the path to name for a file: its folder, if all files of the format have the same name."""
    folder, name = os.path.split(file.path)
    return folder if name in info.suffixes else file.path


def _option(item: DetectedInput) -> str:
    return item.importer.options[0].option  # with which it reads folders


def _command(detected: Sequence[DetectedInput], paths: Sequence[str]) -> str:
    """Return the command line with the folder to read and the option that reads it."""
    words, folder = _words(paths), detected[0].entrance.folder
    for item in detected:
        if folder != item.path and item.path in words:
            at = words.index(item.path)
            words[at : at + 1] = [] if folder in words else [folder]
        words += [_option(item), item.entrance.value or item.entrance.choices[0]]
    return shlex.join(["cqos", *words])


def command_with_folder(info: ImporterInfo, value: str, paths: Sequence[str]) -> str:
    """Return the command line with the folder in which ``value`` of the option for folders is looked up."""
    found = info.load_folder_suggester()(value, None) if info.folder_suggestions and os.path.isfile(value) else ()  # noqa: PTH113
    read = {each: info.load_folder_suggester()(each, None) for each in paths if os.path.isfile(each)}  # noqa: PTH113
    folder = next((each.folder for each in found if each.value), ".")
    words = _words(paths)
    for path in (path for path, entrances in read.items() if path in words and any(each.value for each in entrances)):
        words.remove(path)
    return shlex.join(["cqos", words[0], folder, *words[1:]])


def _words(paths: Sequence[str]) -> list[str]:
    """Return the command line."""
    ctx = click.get_current_context(silent=True)
    run = ctx.find_root().obj if ctx is not None else None
    return list(run.arguments) if isinstance(run, Run) and run.arguments else ["check", *paths]
