"""Lists of names in messages, and ``did you mean`` for an unknown name."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence

    from cqos_core.model.spelling import KnownNames


def listed(names: Sequence[str], most: int = 40) -> str:
    """Return ``a, b, c``, or of many names the first and how many more there are."""
    more = [f"and {len(names) - most} more"] if len(names) > most else []
    return ", ".join([*names[:most], *more])


def suggestion(name: str, known: Iterable[str] | KnownNames) -> str:
    """Return ``did you mean X? known: …`` for a name that is not among ``known``.

    Where many names are looked up in many, make `KnownNames` once.
    """
    from cqos_core.model.spelling import KnownNames

    known = known if isinstance(known, KnownNames) else KnownNames(known)
    near = known.nearest(name)
    hint = f"did you mean `{near}`? " if near else ""
    return f"{hint}known: {listed(known.names) or 'none'}"
