"""Endpoints that keep their settings as their file writes them, and make settings and places when one reads them."""

from __future__ import annotations

from dataclasses import fields
from typing import TYPE_CHECKING, Any, Protocol

from cqos_core.model.system import Endpoint

if TYPE_CHECKING:
    from cqos_core.model.system import Pattern, Said, Settings


class WrittenSettings(Protocol):
    """What a file states for one endpoint."""

    @property
    def pattern(self) -> tuple[Pattern, tuple[Any, ...]]:
        """What `Endpoint.pattern` returns."""

    @property
    def said(self) -> Said:
        """What `Endpoint.said` returns."""

    def settings(self, of: Any) -> Settings:
        """Return the settings of an endpoint."""


class SettingNames:
    """The names under which several endpoints state a text each, in this order; a `Pattern`.

    Attributes:
        each: the names.
        said, at: as those of `Pattern`.
    """

    __slots__ = ("at", "each", "said")

    def __init__(self, each: tuple[str, ...]) -> None:
        """Take the names."""
        self.each = each
        self.said: Said = tuple([(name, "", "", False) for name in each]), ()
        self.at = [*range(len(each))]


class StatedTexts:
    """Settings that are texts and nothing else.

    Attributes:
        names: under which they stand.
        texts: of the settings.
    """

    __slots__ = ()
    names: SettingNames
    texts: tuple[str, ...]

    @property
    def pattern(self) -> tuple[SettingNames, tuple[str, ...]]:
        """What `Endpoint.pattern` returns of one that states them."""
        return self.names, self.texts

    @property
    def said(self) -> Said:
        """What `Endpoint.said` returns of it."""
        return tuple([(name, text, "", False) for name, text in zip(self.names.each, self.texts, strict=True)]), ()


class LazyEndpoint(Endpoint):
    """An `Endpoint` whose settings are made of what is written when one reads them; else as any other."""

    __slots__ = ("_made", "_needs", "_overlay", "written")
    written: WrittenSettings
    _made: Settings | None
    _needs: Settings | None
    _overlay: Settings | None

    @property
    def settings(self) -> Settings:
        """Explicit settings."""
        if self._made is None:
            self._made = self.written.settings(self)
        return self._made

    @settings.setter
    def settings(self, stated: Settings | WrittenSettings) -> None:
        """Take settings, or what they are made of when one reads them."""
        if isinstance(stated, dict):
            self._made = stated
        else:
            self.written, self._made = stated, None

    @property
    def needs(self) -> Settings:
        """What the application requires; most require nothing, and have no map for it."""
        if self._needs is None:
            self._needs = {}
        return self._needs

    @needs.setter
    def needs(self, stated: Settings) -> None:
        self._needs = stated or None

    @property
    def overlay(self) -> Settings:
        """Settings laid over everything else, as `needs`."""
        if self._overlay is None:
            self._overlay = {}
        return self._overlay

    @overlay.setter
    def overlay(self, stated: Settings) -> None:
        self._overlay = stated or None

    def pattern(self) -> tuple[Pattern, tuple[Any, ...]] | None:
        """See `Endpoint.pattern`; none once the settings are made and may be changed."""
        return self.written.pattern if self._made is None and not self._overlay else None

    def said(self) -> Said:
        """See `Endpoint.said`; that of what is written, until the settings are made and may be changed."""
        return self.written.said if self._made is None and not self._overlay else super().said()

    def __eq__(self, other: object) -> bool:
        """Compare as endpoints, however they were made."""
        if not isinstance(other, Endpoint):
            return NotImplemented
        return _values(self) == _values(other)

    __hash__ = None  # type: ignore[assignment]

    def __repr__(self) -> str:
        return repr(Endpoint(**_values(self)))

    def __reduce__(self) -> tuple[Any, ...]:
        return _endpoint, (_values(self),)


def is_bare(endpoint: Endpoint) -> bool:
    """Whether an endpoint has settings only: no profile, overlay, need or order of start; asked without making any of them."""
    if isinstance(endpoint, LazyEndpoint):
        beside = endpoint._needs or endpoint._overlay  # noqa: SLF001
    else:
        beside = endpoint.needs or endpoint.overlay
    return not (beside or endpoint.profiles or endpoint.starts_after)


def _values(endpoint: Endpoint) -> dict[str, Any]:
    return {each.name: getattr(endpoint, each.name) for each in fields(Endpoint)}


def _endpoint(values: dict[str, Any]) -> Endpoint:
    return Endpoint(**values)
