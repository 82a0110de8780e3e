"""Settings as text, with their places in files."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from cqos_core.model.dataclass import dataclass

if TYPE_CHECKING:
    from typing_extensions import Self


class Immutable:
    """Immutable; `deepcopy` returns the object itself."""

    __slots__ = ()

    def __deepcopy__(self, memo: object) -> Self:
        return self


@dataclass(frozen=True, slots=True)
class Place(Immutable):
    """Where something was stated.

    Attributes:
        source: file path as given by the caller, or a name such as ``<bytes>``.
        line, column: one-based; None where the format has none. `cqos_core.model.excerpt` finds a column that is None.
        element: id of the model element (BPMN element id, modeler id), or None.
        path: dotted path of the property inside the document or element (``participants.drone.publishes``,
            ``qos:reliability``), or None.
    """

    source: str
    line: int | None = None
    column: int | None = None
    element: str | None = None
    path: str | None = None

    def __str__(self) -> str:
        """``file:line:column (element)``; the path only where there is nothing better."""
        text = self.source
        if self.line is not None:
            text += f":{self.line}"
            if self.column is not None:
                text += f":{self.column}"
        if self.element is not None:
            text += f" ({self.element})"
        elif self.line is None and self.path is not None:
            text += f" ({self.path})"
        return text


@dataclass(frozen=True, slots=True)
class Cases:
    """A value that is one of a few, depending on an assumption that one reading shares among all settings that name it.

    ``Cases("what the zeros mean", (("they were chosen", "0"), ("they were never edited", "")))``: an empty text is the default.
    """

    assumption: str
    values: tuple[tuple[str, str], ...]


@dataclass(frozen=True, slots=True)
class Setting(Immutable):
    """One stated value, as text in YAML flow spelling (``reliable``, ``2s``, ``[a, b]``, ``{sec: 2, nsec: 0}``).

    Attributes:
        unknown: why the importer could not read the value (``variable `X` is not set``), or the `Cases` that it may be.
            The policy is then unknown, and the cause is reported once; `text` is what the file says.
        derived: a rule pack worked it out; only so does a policy that cannot be stated get a value.
        reported: code of the note by which the importer reports the cause itself.
    """

    text: str
    place: Place | None = None
    unknown: str | Cases = ""
    derived: bool = False
    reported: str = ""


Settings = dict[str, Setting]
"""Settings by the name they were written with; aliases are resolved later, by the pack."""
SettingTexts = tuple[tuple[tuple[str, str, "str | Cases", bool], ...], tuple[tuple[str, str, "str | Cases"], ...]]
"""Names, texts and causes of settings, without their places."""


EVERY_OTHER: Final = "*"
"""The name of an unknown setting that stands for every policy which neither the settings beside it nor nearer ones state."""
