"""Prints results on standard output, and all messages on standard error."""

from __future__ import annotations

import contextlib
import os
import sys
from collections.abc import Iterable
from typing import TextIO

import click

from cqos_core.formatters.terminal import clean, paint, wrap
from cqos_core.model.problems import CqosError, Problem

COLOR_CHOICES = ("auto", "always", "never")

_EXCERPTS = 20  # problems of one run that are shown with their line

_USUAL_WIDTH = 100

_SHOWN_BYTES = 16 * 1024 * 1024

_ROLES = {"warning", "note", "help"}


def colored(choice: str, stream: TextIO | None) -> bool:
    """Whether to print colours on ``stream``.

    ``auto`` asks the variables ``NO_COLOR`` and ``FORCE_COLOR``, then the terminal and ``TERM``.
    """
    if choice != "auto":
        return choice == "always"
    if os.environ.get("NO_COLOR"):
        return False
    if forced := os.environ.get("FORCE_COLOR"):
        return forced != "0"
    return is_terminal(stream) and os.environ.get("TERM") != "dumb"


def is_terminal(stream: TextIO | None) -> bool:
    """Whether ``stream`` is a terminal."""
    try:
        return stream is not None and stream.isatty()
    except ValueError:  # it is closed
        return False


def width() -> int:
    """Return the columns of the terminal: those of ``COLUMNS``, else as the terminal says."""
    stated = os.environ.get("COLUMNS", "")
    if stated.isascii() and stated.isdigit() and int(stated):
        return int(stated)
    try:  # as `shutil` does, which takes 2 ms to import
        return os.get_terminal_size(sys.__stdout__.fileno()).columns or _USUAL_WIDTH  # type: ignore[union-attr]
    except (AttributeError, ValueError, OSError):
        return _USUAL_WIDTH


def say(text: str, *, severity: str = "", head: str = "", choice: str = "auto", lines: bool = False) -> None:
    """Print one message on standard error: ``warning: text``, or ``head text``.

    A closed output is ignored. Text of several ``lines`` must be clean already.
    """
    colors = paint(color=colored(choice, sys.stderr))
    lead = f"{severity}:" if severity else head
    start = f"{colors(clean(lead), severity if severity in _ROLES else 'error')} " if lead else ""
    with contextlib.suppress(OSError):
        click.echo(f"{start}{text if lines else clean(text)}", err=True, color=True)


def say_problems(problems: Iterable[Problem], choice: str = "auto") -> None:
    """Print problems of inputs on standard error, each with its place, the line there, and help."""
    # Most runs have no problem to show, and `--help` has none.
    from cqos_core.formatters.full import render_excerpt
    from cqos_core.model.folder_suggestion import ProblemWithLines
    from cqos_core.model.style import Style

    sources: dict[str, bytes] = {}
    style = Style(color=colored(choice, sys.stderr), width=width(), sources=sources)
    for number, problem in enumerate(problems):
        place = problem.place
        where = "" if place is None else f"{place}: "
        say(f"{where}{problem.message}", head=f"error[{problem.code}]", choice=choice)
        if place is not None and place.line is not None and number < _EXCERPTS:
            if place.source not in sources and (data := _content(place.source)) is not None:
                sources[place.source] = data
            if excerpt := render_excerpt(place, style):
                say(excerpt, choice=choice, lines=True)
        if problem.help is not None:
            further = map(clean, problem.lines if isinstance(problem, ProblemWithLines) else ())
            for line, text in enumerate([*wrap(clean(problem.help), width() - len("  help: ") - 1), *further]):
                say(f"{'        ' if line else '  help: '}{text}", choice=choice, lines=True)


def _content(path: str) -> bytes | None:
    """Return the bytes of a file; None if it is not a regular file, or too large to show."""
    try:
        if not os.path.isfile(path) or os.path.getsize(path) > _SHOWN_BYTES:  # noqa: PTH113, PTH202 - `pathlib` takes 3 ms
            return None
        with open(path, "rb") as file:  # noqa: PTH123
            return file.read()
    except (OSError, ValueError):
        return None


def emit(text: str) -> None:
    """Print a result on standard output.

    If the reader is gone (``cqos … | head``), the rest is dropped, and the exit code stays.

    Raises:
        CqosError: it cannot be written, because a disk is full, say.
    """
    try:
        _write(text)
    except BrokenPipeError:
        _discard_output()
    except OSError as error:
        _discard_output()
        raise CqosError(f"cannot write to standard output: {error.strerror}") from None


def _write(text: str) -> None:
    if sys.stdout is None:
        return
    binary = getattr(sys.stdout, "buffer", None)
    if binary is None:
        sys.stdout.write(text)
    else:
        # Files and pipes are UTF-8 whatever the locale says: JSON and XML have to be.
        encoding = sys.stdout.encoding if is_terminal(sys.stdout) else "utf-8"
        sys.stdout.flush()
        binary.write(text.encode(encoding, "backslashreplace"))
    sys.stdout.flush()


def _discard_output() -> None:
    """Redirect standard output to the null device, so that the flush at the end of Python succeeds."""
    with contextlib.suppress(OSError, ValueError):
        nowhere = os.open(os.devnull, os.O_WRONLY)
        os.dup2(nowhere, sys.stdout.fileno())
        os.close(nowhere)
