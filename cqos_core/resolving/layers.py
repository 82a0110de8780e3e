"""What is stated of endpoints and participants, by the places of the hierarchy where it stands."""

from __future__ import annotations

from typing import TYPE_CHECKING, Literal, NamedTuple

if TYPE_CHECKING:
    from collections.abc import Mapping

    from cqos_core.model.settings import Setting
    from cqos_core.model.system import Room


class Stated(NamedTuple):
    """A setting after its name was recognised.

    Attributes:
        name: the one it was written with.
        field: the key, where the value is one of a map.
        code: of the finding that reports why the value is not known, where there is one already.
    """

    text: str
    setting: Setting
    name: str = ""
    code: str = ""
    field: str = ""


class Layer(NamedTuple):
    """Settings from one place of the hierarchy, by policy index; ``origin`` says which in a message.

    Attributes:
        here: the attribute of the endpoint that has them; empty where they stand elsewhere.
        counts_as_stated: ``stated(P)`` holds for them.
        assumed: not stated: what the protocol gives an endpoint that states nothing.
        overlay: they are laid over the endpoint's own from elsewhere: ``holds``, or ``may_hold`` where that is not known.
        unread: codes of the errors that report what was stated beside them and is not understood.
        dialect: of an overlay or profile: which of the pack's dialects its texts are written in.
        room: where its file has room for further settings.
    """

    origin: str
    settings: Mapping[int, Stated]
    here: str = ""
    counts_as_stated: bool = True
    assumed: bool = False
    overlay: Literal["no", "holds", "may_hold"] = "no"
    unread: tuple[str, ...] = ()
    dialect: str = "yaml"
    room: Room | None = None

    @property
    def texts(self) -> tuple[object, ...]:
        """What they are stated as, and which finding reports what is not known; without where."""
        stated = [
            (index, each.text, each.setting.unknown, each.code or each.setting.reported)
            for index, each in self.settings.items()
        ]
        return (*stated, self.unread) if self.unread else tuple(stated)
