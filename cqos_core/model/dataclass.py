"""Dataclasses whose methods are written on first use.

`dataclasses.dataclass` compiles up to six functions for each class, which takes 0.55 ms. A check of a small file loads 137 classes:
the whole process takes 3.9 times the bare imports of click, yaml and pluggy with the library's, 2.9 times with this one, and 2.5
times without any. This `dataclass` leaves fields and slots to the standard library, shares all other methods, and compiles
``__init__`` for the first instance of a class.
"""

from __future__ import annotations

import dataclasses
from dataclasses import MISSING, FrozenInstanceError, fields
from functools import partial
from operator import attrgetter
from reprlib import recursive_repr
from types import MemberDescriptorType
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from collections.abc import Callable

__all__ = ["dataclass"]


def _dataclass(
    cls: Any = None,
    /,
    *,
    frozen: bool = False,
    slots: bool = False,
    eq: bool = True,
    repr: bool = True,  # noqa: A002 - as the library
    kw_only: bool = False,
) -> Any:
    """Do what `dataclasses.dataclass` does with these arguments, at less cost until the class is used."""
    if cls is None:
        return partial(_dataclass, frozen=frozen, slots=slots, eq=eq, repr=repr, kw_only=kw_only)
    if any(map(dataclasses.is_dataclass, cls.__bases__)):
        return dataclasses.dataclass(cls, frozen=frozen, slots=slots, eq=eq, repr=repr, kw_only=kw_only)
    stated = {name for name in ("__init__", "__eq__", "__hash__", "__repr__") if cls.__dict__.get(name)}
    made = _with_fields(cls, slots=slots, kw_only=kw_only)
    # Dataclasses that inherit from it look here.
    for name, value in (("init", True), ("frozen", frozen), ("eq", eq), ("repr", repr)):
        setattr(made.__dataclass_params__, name, value)
    if "__init__" not in stated:
        _add_init(made, frozen=frozen)
    if eq:
        _add_equality(made, stated, frozen=frozen)
    if repr and "__repr__" not in stated:
        made.__repr__ = _shown
    if frozen:
        _freeze(made, slots=slots)
    return made


if TYPE_CHECKING:  # with the arguments above
    from dataclasses import dataclass
else:
    dataclass = _dataclass


def _with_fields(cls: Any, *, slots: bool, kw_only: bool) -> Any:
    """Leave the fields to the library, which reads each annotation twice where it is a text."""
    stated = cls.__dict__.get("__annotations__", {})  # noqa: RUF063 - `inspect` takes longer
    plain = stated and all(
        isinstance(each, str) and "Var" not in each and "KW_ONLY" not in each for each in stated.values()
    )
    if plain:
        cls.__annotations__ = dict.fromkeys(stated, object)
    made = dataclasses.dataclass(cls, init=False, repr=False, eq=False, slots=slots, kw_only=kw_only)
    if plain:
        made.__annotations__ = stated
        for name, each in stated.items():
            made.__dataclass_fields__[name].type = each
    return made


def _add_init(cls: Any, *, frozen: bool) -> None:
    def first(self: Any, *args: Any, **kwargs: Any) -> None:
        cls.__init__ = _init(cls, frozen=frozen)
        cls.__init__(self, *args, **kwargs)

    cls.__init__ = first


def _init(cls: Any, *, frozen: bool) -> Callable[..., None]:
    """Compile the method from the names of the fields, which Python took as identifiers before."""
    known: dict[str, Any] = {"_set": object.__setattr__, "_absent": MISSING}
    parameters, keywords, body = ["self"], ["*"], []
    for number, each in enumerate(fields(cls)):
        value, default = each.name, ""
        if each.default_factory is not MISSING:
            known[f"_{number}"], default = each.default_factory, " = _absent"
            value = f"_{number}() if {each.name} is _absent else {each.name}" if each.init else f"_{number}()"
        elif each.default is not MISSING:
            known[f"_{number}"], default = each.default, f" = _{number}"
            value = each.name if each.init else f"_{number}"
        if each.init:
            (keywords if each.kw_only else parameters).append(each.name + default)
        if each.init or default:
            slot = cls.__dict__.get(each.name)
            if frozen and isinstance(slot, MemberDescriptorType):  # a third less time than by its name
                known[f"_set_{number}"] = slot.__set__
                body.append(f"_set_{number}(self, {value})")
            else:
                body.append(f"_set(self, {each.name!r}, {value})" if frozen else f"self.{each.name} = {value}")
    if hasattr(cls, "__post_init__"):
        body.append("self.__post_init__()")
    signature = ", ".join(parameters + (keywords if len(keywords) > 1 else []))
    exec(f"def __init__({signature}):\n " + "\n ".join(body or ["pass"]), known)  # noqa: S102 - see above
    made: Callable[..., None] = known["__init__"]
    made.__qualname__ = f"{cls.__qualname__}.__init__"
    return made


def _add_equality(cls: Any, stated: set[str], *, frozen: bool) -> None:
    every = fields(cls)
    compared = _values([each.name for each in every if each.compare])
    hashed = _values([each.name for each in every if (each.compare if each.hash is None else each.hash)])

    def equal(self: Any, other: object) -> Any:
        return compared(self) == compared(other) if other.__class__ is self.__class__ else NotImplemented

    def hash_of(self: Any) -> int:
        return hash(hashed(self))

    if "__eq__" not in stated:
        cls.__eq__ = equal
    if "__hash__" not in stated:
        cls.__hash__ = hash_of if frozen else None


def _values(names: list[str]) -> Callable[[Any], Any]:
    """Return a function from an instance to the tuple of these fields."""
    if len(names) > 1:
        return attrgetter(*names)
    return lambda each: tuple(getattr(each, name) for name in names)


@recursive_repr()
def _shown(self: Any) -> str:
    shown = ", ".join(f"{each.name}={getattr(self, each.name)!r}" for each in fields(self) if each.repr)
    return f"{self.__class__.__qualname__}({shown})"


def _freeze(cls: Any, *, slots: bool) -> None:
    def assign(self: Any, name: str, value: object) -> None:
        if type(self) is cls or name in cls.__dataclass_fields__:
            raise FrozenInstanceError(f"cannot assign to field {name!r}")
        object.__setattr__(self, name, value)

    def delete(self: Any, name: str) -> None:
        if type(self) is cls or name in cls.__dataclass_fields__:
            raise FrozenInstanceError(f"cannot delete field {name!r}")
        object.__delattr__(self, name)

    cls.__setattr__, cls.__delattr__ = assign, delete
    if slots:  # copies and pickles would assign
        cls.__getstate__, cls.__setstate__ = _state, _restore


def _state(self: Any) -> list[Any]:
    return [getattr(self, each.name) for each in fields(self)]


def _restore(self: Any, state: list[Any]) -> None:
    for each, value in zip(fields(self), state, strict=True):
        object.__setattr__(self, each.name, value)
