"""Regular expressions over names, matched by RE2 in linear time.

Such expressions mostly come from the configuration of programs in Rust or Go, whose matchers are linear. Python's matcher may take
exponential time for an expression from a file. RE2 is linear and has nearly the same syntax.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import lru_cache
from typing import Any, Final

from cqos_core.model.problems import CqosError
from cqos_core.model.regular_expressions import re, regular_expression

_OPERATOR: Final = regular_expression(
    r"\[\^?\]?(?:\\.|\[:\^?[a-z]+:\]|[^\]\\\[&~-]|[&~-](?![&~-]))*+(&&|~~|--|\[)", re.DOTALL
)
"""Operators of Rust within a class of characters, which RE2 takes for characters."""


class PatternError(CqosError):
    """A regular expression is wrong or uses an unsupported operator; the text names the part."""


@lru_cache(maxsize=1_024)
def name_matcher(text: str) -> Callable[[str], bool]:
    """Return a function that tells whether a whole name matches a regular expression in the syntax of Rust, Go and RE2.

    Raises:
        PatternError: it is not a regular expression, or uses operators on classes of characters (``[a-z&&[^b]]``), which Rust has.
    """
    import re2

    operator = _OPERATOR.search(text)
    if operator is not None:
        raise PatternError(f"`{operator[1]}` within a class of characters is not read here")
    options: Any = re2.Options()
    options.log_errors = False
    options.never_capture = True
    try:
        compiled: Any = re2.compile(_sound(text), options)
    except re2.error as error:
        raise PatternError(_reason(error)) from None
    return lambda name: compiled.fullmatch(_sound(name)) is not None


@lru_cache(maxsize=256)
def any_name_matcher(texts: tuple[str, ...]) -> Callable[[str], bool]:
    """Return a function that tells whether a whole name matches one of several regular expressions; their number hardly changes its cost.

    Raises:
        PatternError: one of them is not a regular expression.
    """
    names = frozenset(re.sub(r"\\(\W)", r"\1", text) for text in texts if _LITERAL.fullmatch(text))
    expressions = [text for text in texts if not _LITERAL.fullmatch(text)]
    matchers = [name_matcher(text) for text in expressions]
    if len(matchers) > 1:
        try:
            matchers = [name_matcher("|".join(f"(?:{text})" for text in expressions))]
        except PatternError:
            return lambda name: name in names or any(matches(name) for matches in matchers)  # too large for RE2 as one
    return lambda name: name in names or any(matches(name) for matches in matchers)


_LITERAL: Final = regular_expression(r"(?:[\w/~:-]|\\[^\w\s])*")


def _sound(text: str) -> str:
    """Return a text without lone surrogates, which a damaged file may contain."""
    return text.encode("utf-8", "replace").decode()


def _reason(error: Exception) -> str:
    """Return the message of RE2: ``missing ): (a``."""
    said = error.args[0]
    return said.decode("utf-8", "replace") if isinstance(said, bytes) else str(said)
