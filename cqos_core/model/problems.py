"""Errors raised to callers: one base class, every problem located, all of them collected before raising."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Final

from cqos_core.model.dataclass import dataclass

if TYPE_CHECKING:
    from collections.abc import Sequence

    from cqos_core.model.settings import Place


_MOST_PROBLEMS: Final = 1000


class CqosError(Exception):
    """Base of every error C-QoS raises on purpose; its text can be shown to a person as it is.

    Attributes:
        what: is wrong.
        help: what to write or do instead; empty where nothing else is known.
    """

    what = help = ""

    def __init__(self, what: str = "", help: str = "") -> None:  # noqa: A002 - as of a problem
        """Keep both apart, and say them in one sentence."""
        self.what = what
        self.help = help
        super().__init__(f"{what}; {help}" if help else what)


class MissingError(CqosError):
    """A required package is not installed; ``help`` is the command that installs it."""


@dataclass(frozen=True, slots=True)
class Problem:
    """One thing that is wrong with an input: what was found, what is allowed, and where.

    Attributes:
        code: permanent code, for instance ``CQ001``.
        message: one sentence that makes sense alone.
        place: where it stands, or None where the input has no places.
        help: what to do about it, or None.
    """

    code: str
    message: str
    place: Place | None = None
    help: str | None = None

    def __str__(self) -> str:
        """``file:line:column: message (help)``, one line."""
        where = f"{self.place}: " if self.place is not None else ""
        more = f" ({self.help})" if self.help else ""
        return f"{where}{self.message}{more}"


class InputError(CqosError):
    """An input cannot be used. ``problems`` holds every problem found in it, never only the first."""

    def __init__(self, problems: Sequence[Problem]) -> None:
        """Collect ``problems``, at least one."""
        self.problems = tuple(problems)
        super().__init__("\n".join(str(problem) for problem in self.problems))


class PackError(CqosError):
    """A rule pack is not well formed: an unknown policy in a condition, a code used twice, a bad default.

    Attributes:
        mistakes: each mistake with where it stands, in the keys of a pack file; empty for a single one.
    """

    def __init__(self, message: str, mistakes: Sequence[tuple[tuple[str, ...], str]] = ()) -> None:
        """Keep every mistake beside the message."""
        self.mistakes = tuple(mistakes)
        super().__init__(message)


class ConditionError(CqosError):
    """A condition cannot be read, or does not fit its policies.

    Attributes:
        text: the condition, as far as there is a text.
        offset: zero-based offset into ``text`` where it went wrong, or None.
    """

    def __init__(self, message: str, text: str | None = None, offset: int | None = None) -> None:
        """Keep the place of the fault beside the message."""
        self.text = text
        self.offset = offset
        where = f" in `{text}`" if text else ""
        at = f" at character {offset + 1}" if text and offset is not None else ""
        super().__init__(f"{message}{where}{at}")


SentenceError = ConditionError  # the former name


class InvalidValueError(CqosError):
    """A setting's text is no value of its policy. ``expected`` says what is allowed, ``near`` what was probably meant."""

    def __init__(self, message: str, expected: str = "", near: str = "") -> None:
        """Keep the allowed values apart from the message."""
        self.expected = expected
        self.near = near
        self.message = message
        super().__init__(f"{message}; expected {expected}" if expected else message)

    def advice(self, expected: str = "") -> str:
        """The advice, where ``expected`` may have other words."""
        meant = f"did you mean `{self.near}`? " if self.near else ""
        return f"{meant}expected {expected or self.expected}"


def collect(problems: list[Problem], problem: Problem) -> None:
    """Add ``problem`` to ``problems``.

    Raises:
        InputError: with all of them, above a limit.
    """
    problems.append(problem)
    if len(problems) >= _MOST_PROBLEMS:
        message = f"reading stops here: {_MOST_PROBLEMS} problems were found"
        raise InputError([*problems, replace(problem, message=message, help=None)])


def describe(error: BaseException) -> str:
    """Return ``ValueError: its text``; of errors that are raised on purpose the text alone."""
    if isinstance(error, CqosError) or not str(error):
        return str(error) or type(error).__name__
    return f"{type(error).__name__}: {error}"


def add_note(error: BaseException, note: str) -> None:
    """Add a note to an error, as `BaseException.add_note` does from Python 3.11 on."""
    vars(error).setdefault("__notes__", []).append(note)


def keep_traceback(what: str, error: BaseException) -> None:
    """Pass an error that became a message to the logger ``cqos_core``, which ``cqos --debug`` shows."""
    import logging

    logging.getLogger("cqos_core").debug(what, exc_info=error)
