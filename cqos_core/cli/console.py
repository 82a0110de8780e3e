"""What the command prints: results to standard output, all else to standard error."""

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
    """Whether to write colours to ``stream``.

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
    """Whether a person reads ``stream`` as it is written."""
    try:
        return stream is not None and stream.isatty()
    except ValueError:  # it is closed
        return False


def width() -> int:
    """Columns of the terminal, or of what takes its place."""
    stated = os.environ.get("COLUMNS", "")
    if stated.isascii() and stated.isdigit() and int(stated):
        return int(stated)
    try:  # as `shutil` does, which takes 2 ms to import
        return os.get_terminal_size(sys.__stdout__.fileno()).columns or _USUAL_WIDTH  # type: ignore[union-attr]
    except (AttributeError, ValueError, OSError):
        return _USUAL_WIDTH


def say(text: str, *, severity: str = "", head: str = "", choice: str = "auto", lines: bool = False) -> None:
    """Write one message to standard error: ``warning: text``, or ``head text``.

    A closed output is no reason to fail. Text of several ``lines`` must be clean.
    """
    colors = paint(color=colored(choice, sys.stderr))
    lead = f"{severity}:" if severity else head
    start = f"{colors(clean(lead), severity if severity in _ROLES else 'error')} " if lead else ""
    with contextlib.suppress(OSError):
        click.echo(f"{start}{text if lines else clean(text)}", err=True, color=True)


def say_problems(problems: Iterable[Problem], choice: str = "auto") -> None:
    """Write what is wrong with inputs to standard error, each with its place, the line there, and what to do."""
    # Most runs have no problem to show, and `--help` has none.
    from cqos_core.formatters.full import render_excerpt
    from cqos_core.model.entrance import ProblemWithLines
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
    """The bytes of a file that a problem is about; None where it is no file of readable size."""
    try:
        if not os.path.isfile(path) or os.path.getsize(path) > _SHOWN_BYTES:  # noqa: PTH113, PTH202 - `pathlib` takes 3 ms
            return None
        with open(path, "rb") as file:  # noqa: PTH123
            return file.read()
    except (OSError, ValueError):
        return None


def emit(text: str) -> None:
    """Write a result to standard output.

    Where the reader has gone away (``cqos … | head``) the rest is dropped: what was found is still the exit code.

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
    """Send what is still buffered nowhere, or Python would complain about it at its end."""
    with contextlib.suppress(OSError, ValueError):
        nowhere = os.open(os.devnull, os.O_WRONLY)
        os.dup2(nowhere, sys.stdout.fileno())
        os.close(nowhere)
