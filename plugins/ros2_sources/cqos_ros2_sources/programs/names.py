"""Names as programs write them: their parts, which full names they may mean, and what pointers point to."""

from __future__ import annotations

from functools import lru_cache
from typing import Final


@lru_cache(maxsize=65536)
def last_part(name: str) -> str:
    """Return a qualified name without what it is in."""
    return name.rpartition("::")[2].rpartition(".")[2]


@lru_cache(maxsize=65536)
def fits(full: str, written: str) -> bool:
    """Whether a name as written may mean a qualified name: the one ends with the other, part by part."""
    one, other = full.replace("::", ".").split("."), written.strip(":").replace("::", ".").split(".")
    length = min(len(one), len(other))
    return one[-length:] == other[-length:]


@lru_cache(maxsize=65536)
def without_arguments(name: str) -> str:
    """Return a type without template arguments, qualifiers and marks of pointers and references."""
    plain = name.split("<", 1)[0]
    words = [each for each in plain.replace("*", " ").replace("&", " ").split() if each not in _QUALIFIERS]
    return words[-1] if words else ""


_QUALIFIERS: Final = frozenset(
    ("const", "static", "constexpr", "inline", "mutable", "typename", "class", "struct", "volatile")
)


def points(type_text: str) -> bool:
    """Whether a type is a pointer: copies of a value of it mean the same object."""
    inner = inner_type(type_text)
    pointer = inner != type_text.strip() and not last_part(type_text.partition("<")[0]).endswith("optional")
    return type_text.endswith("*") or pointer or "reference_wrapper" in type_text


def refers(type_text: str) -> bool:
    """Whether a type is a reference or a pointer."""
    return type_text.endswith("&") or points(type_text)


def inner_type(name: str) -> str:
    """Return what a smart pointer or optional points to; the type itself where it is none."""
    plain = name.strip()
    for mark in ("SharedPtr", "UniquePtr", "WeakPtr", "ConstSharedPtr", "Ptr"):
        if plain.endswith(f"::{mark}"):
            return plain[: -len(mark) - 2]
    head, opened, rest = plain.partition("<")
    if opened and last_part(without_arguments(head)) in {"shared_ptr", "unique_ptr", "weak_ptr", "optional"}:
        return rest.rpartition(">")[0].strip()
    return plain
