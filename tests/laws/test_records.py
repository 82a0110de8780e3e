"""Law: a data class whose methods are written later is as one of the standard library."""

from __future__ import annotations

import copy
import dataclasses
import pickle
from typing import TYPE_CHECKING, Any

import pytest

from cqos_core.model import records

if TYPE_CHECKING:
    from collections.abc import Callable


def made_by(dataclass: Callable[..., Any], **wishes: bool) -> Any:
    @dataclass(**wishes)
    class Point:
        """A point."""

        x: int
        y: str = "y"
        more: list[int] = dataclasses.field(default_factory=list, hash=False, repr=False)
        seen: list[str] = dataclasses.field(default_factory=list, compare=False)

        def __post_init__(self) -> None:
            self.seen.append(f"made with {self.x}")

    return Point


def outcome(work: Callable[[], Any]) -> Any:
    try:
        return work()
    except Exception as error:  # noqa: BLE001 - any error is compared
        return type(error), str(error).replace("made_by.<locals>.", "")


WISHES = [{"frozen": frozen, "slots": slots, "eq": eq} for frozen in (0, 1) for slots in (0, 1) for eq in (0, 1)]


@pytest.mark.parametrize(
    "wishes", [*WISHES, {"kw_only": True, "slots": True}, {"frozen": True, "repr": False}], ids=str
)
def test_it_does_as_a_data_class_of_the_standard_library(wishes, monkeypatch):
    works: dict[str, Callable[[Any], Any]] = {
        "fields": lambda made: [(each.name, each.init, each.hash) for each in dataclasses.fields(made)],
        "parameters": lambda made: repr(made.__dataclass_params__),
        "matched": lambda made: made.__match_args__,
        "text": lambda made: repr(made(x=1)).partition(" at 0x")[0],
        "too few": lambda made: made(),
        "by place": lambda made: made(1, "z", [3]).more,
        "equal": lambda made: (made(x=1) == made(x=1), made(x=1) == made(x=2), made(x=1) == 1),
        "hash": lambda made: len({made(x=1), made(x=1), made(x=1, more=[2])}),
        "replaced": lambda made: dataclasses.replace(made(x=1), x=2).x,
        "as a mapping": lambda made: dataclasses.asdict(made(x=1)),
        "set": lambda made: setattr(made(x=1), "x", 2),
        "deleted": lambda made: delattr(made(x=1), "x"),
        "copied": lambda made: copy.deepcopy(made(x=1, more=[1])).more,
        "pickled": lambda made: pickle.loads(pickle.dumps(made(x=1, y="b"))).y,  # noqa: S301 - our own bytes
        "built upon": lambda made: (
            dataclasses.dataclass(frozen=bool(wishes.get("frozen")))(
                type("More", (made,), {"__annotations__": {"z": "int"}, "z": 3})
            )(x=1).z
        ),
    }
    for name, work in works.items():
        found = []
        for dataclass in (dataclasses.dataclass, records.dataclass):
            made = made_by(dataclass, **wishes)
            made.__qualname__ = "Point"
            monkeypatch.setitem(globals(), "Point", made)
            found.append([outcome(lambda: work(made)) for _ in range(2)])  # noqa: B023 - called at once
        assert found[0] == found[1], name
