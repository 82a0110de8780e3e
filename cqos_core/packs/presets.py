"""Parts of a rule pack that state values: presets, dialects, conventions and common mistakes."""

from __future__ import annotations

from dataclasses import field
from typing import TYPE_CHECKING, Literal

from cqos_core.language.policy import ENDPOINT
from cqos_core.model.dataclass import dataclass

if TYPE_CHECKING:
    from collections.abc import Mapping


@dataclass(frozen=True, slots=True)
class Preset:
    """A named bundle of values that comes with the pack.

    Attributes:
        settings: policy name to text; policies not named keep their defaults.
        level: whose policies these are: ``endpoint`` or ``broker``.
        needs: option and the least value of it that has this preset, for instance ``("distro", "iron")``; None: always.
        aliases: other spellings; compared normalised.
        fixed: its users cannot change these values, such as limits of a cloud service, so no fix does.
        hosts: patterns of addresses at which a broker has these values for certain, where it names no profile.
    """

    settings: Mapping[str, str]
    doc: str = ""
    needs: tuple[str, str] | None = None
    aliases: tuple[str, ...] = ()
    level: Literal["endpoint", "broker"] = ENDPOINT
    fixed: bool = False
    hosts: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True)
class CommonMistake:
    """A setting as people write it who think of another protocol, and the setting to write here.

    Attributes:
        written: a regular expression for a setting, ``name: value``, or for the name of a profile, whole and without regard to case.
        write: what to write in its place, in which a backslash and a number stand for a group.
    """

    written: str
    write: str


@dataclass(frozen=True, slots=True)
class Dialect:
    """The notation of the pack's settings in one kind of file.

    Attributes:
        names: attribute name (normalised) to policy name, beside the policies' own aliases.
        codes: policy name to its integer codes: ``{"history": {"0": "keep_last"}}``.
        bare_unit: unit of a duration without one (``s``, ``ns``); None refuses it.
        zero_is_unset: a numeric zero of a count or duration means "not stated".
        ignore: attribute names (normalised) that are no settings of this pack.
        writes: policy name to the attribute that a person writes, where that is not its name; empty: it has no place there.
        words: those special words of policies that have a place in such files; None: all that people write.
    """

    names: Mapping[str, str] = field(default_factory=dict)
    codes: Mapping[str, Mapping[str, str]] = field(default_factory=dict)
    bare_unit: str | None = None
    zero_is_unset: bool = False
    ignore: frozenset[str] = frozenset()
    writes: Mapping[str, str] = field(default_factory=dict)
    words: tuple[str, ...] | None = None


@dataclass(frozen=True, slots=True)
class Convention:
    """Facts about some topics that hold by convention unless stated otherwise.

    Attributes:
        pattern: shell pattern over the resolved topic name.
        settings: topic-level settings: ``{"latched": "true"}``.
        external: the other side is usually part of no design (a log collector, say), so a missing partner is no finding.
    """

    pattern: str
    settings: Mapping[str, str] = field(default_factory=dict)
    external: bool = False
    doc: str = ""
