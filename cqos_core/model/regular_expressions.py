"""`re` with possessive quantifiers and atomic groups.

Python 3.10 lacks them, and before 3.11.5 they match wrongly around groups (python/cpython#106052). There, the package `regex` has them.
"""

from __future__ import annotations

import re as standard
import sys
from typing import TYPE_CHECKING, Any, AnyStr, Final, cast

if TYPE_CHECKING or sys.version_info >= (3, 11, 5):
    import re
else:
    import regex as re

__all__ = ["re", "regular_expression"]


class _OnUse:
    """A regular expression that is compiled when one of its methods is first called."""

    def __init__(self, text: Any, flags: int, part: Any) -> None:
        self._stated = text, flags
        self._part = part

    def search(self, text: Any, *where: int) -> Any:
        """Search a text; one without the part needs no regular expression."""
        return None if self._part and self._part not in text else self.__getattr__("search")(text, *where)

    def __getattr__(self, name: str) -> Any:
        found = self.__dict__[name] = getattr(_compiled(*self._stated), name)
        return found


_NEWER: Final = "++", "*+", "?+", "}+", "(?>"
_FLAGS: Final = "ASCII", "DOTALL", "IGNORECASE", "MULTILINE", "VERBOSE"


def _compiled(text: Any, flags: Any) -> Any:
    """Compile by the standard module where it can: `regex` takes quadratic time for some expressions, and its flags have other numbers."""
    known = text.decode("latin-1") if isinstance(text, bytes) else text
    module: Any = re if any(part in known for part in _NEWER) else standard
    chosen = [name for name in _FLAGS if flags & getattr(type(flags), name)] if flags else []
    return module.compile(text, sum(int(getattr(module, name)) for name in chosen))


def regular_expression(text: AnyStr, flags: int = 0, part: AnyStr | None = None) -> re.Pattern[AnyStr]:
    """Return a regular expression. It is compiled on first use: a start of the command uses a tenth of those that it imports.

    Args:
        text: the expression.
        flags: as of `re.compile`.
        part: a text that every match contains. A search looks for it first.
    """
    return cast("re.Pattern[AnyStr]", _OnUse(text, flags, part))
