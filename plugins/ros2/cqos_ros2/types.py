"""Names of interface types, which files, languages and the wire spell differently."""

from __future__ import annotations

import re

from cqos_core.packs import Names, Text

_PARTS = 3


def full_type_name(written: str, kind: str = "msg") -> str:
    """Return ``pkg/msg/Type`` for ``pkg/Type``, ``pkg.msg.Type``, ``pkg::msg::Type`` and ``pkg::msg::dds_::Type_``.

    Args:
        written: the name in any of these spellings; whatever has another shape is returned as it is.
        kind: what to put between package and type where nothing stands there: ``msg``, ``srv`` or ``action``.
    """
    name = written.strip()
    parts = [part for part in re.split(r"/|::|\.", name) if part]
    if "dds_" in parts:
        parts = [part for part in parts if part != "dds_"]
        parts[-1] = parts[-1].removesuffix("_")
    if len(parts) == _PARTS - 1:
        parts.insert(1, kind)
    return "/".join(parts) if len(parts) == _PARTS else name


class TypeName(Text):
    """A type name; its spellings are read as one."""

    def parse(self, text: str) -> str:
        """Read any spelling into ``pkg/msg/Type``."""
        return full_type_name(text)


class PartitionNames(Names):
    """Names of partitions, each as it stands: how a wildcard is compared differs between middlewares."""

    example = "a list of names without wildcards such as [a, b]"

    def parse(self, text: str) -> tuple[str, ...]:
        """Read names; one with a wildcard is refused."""
        names = super().parse(text)
        if any(has_wildcard(name) for name in names):
            raise self.refused(f"`{text}` has a wildcard, which is not judged here")
        return names


def has_wildcard(name: str) -> bool:
    """Whether the name of a partition is an expression for several (DDS 1.4, 2.2.3.13)."""
    return not set(name).isdisjoint("*?[")
