"""`dataclass`, whose methods are written when they are first called: writing them is most of what importing a class costs."""

from __future__ import annotations

import dataclasses
from dataclasses import field
from typing import TYPE_CHECKING, Any, Final

if TYPE_CHECKING:
    from collections.abc import Callable
    from dataclasses import dataclass

__all__ = ["dataclass", "field"]

_OWN: Final = {
    "__init__",
    "__repr__",
    "__eq__",
    "__hash__",
    "__setattr__",
    "__delattr__",
    "__getstate__",
    "__setstate__",
}

if not TYPE_CHECKING:

    def dataclass(**wishes: bool) -> Callable[[type], type]:
        """Return what makes a class a data class, as `dataclasses.dataclass` does with the same arguments.

        A class that writes some of these methods itself, or builds on another data class, is left to that one.
        """

        def made(cls: type) -> type:
            unusual = (
                _OWN & cls.__dict__.keys() or cls.__doc__ is None or any(map(dataclasses.is_dataclass, cls.__bases__))
            )
            return dataclasses.dataclass(**wishes)(cls) if unusual else _made(cls, **wishes)

        return made


def _made(
    cls: type,
    *,
    frozen: bool = False,
    eq: bool = True,
    repr: bool = True,  # noqa: A002 - as in Python
    **layout: bool,
) -> type:
    made: Any = dataclasses.dataclass(init=False, repr=False, eq=False, **layout)(cls)
    asked = made.__dataclass_params__
    asked.init, asked.repr, asked.eq, asked.frozen = True, repr, eq, frozen
    _await(made, "__init__")
    if repr:
        _await(made, "__repr__")
    if eq:
        _await(made, "__eq__")
        made.__hash__ = None
    if frozen:
        made.__setattr__, made.__delattr__ = _refuse_setting, _refuse_deleting
        if eq:
            _await(made, "__hash__")
        if layout.get("slots"):
            made.__getstate__, made.__setstate__ = _get_state, _set_state
    return made  # type: ignore[no-any-return]


def _await(made: type, name: str) -> None:
    """Give ``made`` a method that writes what takes its place."""

    def method(self: Any, *given: Any, **named: Any) -> Any:
        written = _written(made, name)
        setattr(made, name, written)
        return written(self, *given, **named)

    method.__name__, method.__qualname__ = name, f"{made.__qualname__}.{name}"
    setattr(made, name, method)


def _written(made: Any, name: str) -> Callable[..., Any]:
    """Let the standard library write one method, for a class of the same fields."""
    fields = made.__dict__["__dataclass_fields__"]
    body = {
        "__module__": made.__module__,
        "__qualname__": made.__qualname__,
        "__doc__": made.__doc__,
        "__annotations__": {each.name: each.type for each in fields.values()},
        **fields,
    }
    if hasattr(made, "__post_init__"):
        body["__post_init__"] = made.__post_init__
    write: Any = dataclasses.dataclass(
        init=name == "__init__",
        repr=name == "__repr__",
        eq=name == "__eq__",
        unsafe_hash=name == "__hash__",
        frozen=name == "__init__" and made.__dataclass_params__.frozen,
    )
    return write(type(made.__name__, (), body)).__dict__[name]  # type: ignore[no-any-return]


def _refuse_setting(_self: Any, name: str, _value: Any) -> None:
    raise dataclasses.FrozenInstanceError(f"cannot assign to field {name!r}")


def _refuse_deleting(_self: Any, name: str) -> None:
    raise dataclasses.FrozenInstanceError(f"cannot delete field {name!r}")


def _get_state(self: Any) -> list[Any]:
    return [getattr(self, each.name) for each in dataclasses.fields(self)]


def _set_state(self: Any, state: list[Any]) -> None:
    for each, value in zip(dataclasses.fields(self), state, strict=True):
        object.__setattr__(self, each.name, value)
