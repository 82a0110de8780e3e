"""Kinds of value as DDS writes them: enumerations with their IDL names, `Duration_t`, lengths, data representations."""

from __future__ import annotations

import re
from typing import Final

from cqos_core.model.problems import InvalidValueError
from cqos_core.packs import Choice, Count, Duration, Names, flow, normalise

_S: Final = 1_000_000_000
_LONG: Final = 2**31 - 1
_INFINITE: Final = re.compile(r"(?:dds_)?duration_(?:infinite|infinity)(?:_n?sec)?", re.IGNORECASE)


def choice(idl: str, *values: str, ordered: bool = True, **synonyms: str) -> Choice:
    """List the values of a policy, weakest first, read also as ``RELIABLE_RELIABILITY_QOS``, ``DDS_…`` and in camel case.

    Args:
        idl: what stands behind the value in the IDL, between underscores: ``RELIABILITY`` in ``RELIABLE_RELIABILITY_QOS``.
        values: canonical names.
        ordered: whether a later value is a stronger one.
        synonyms: other spellings.
    """
    camel = {value.replace("_", ""): value for value in values if "_" in value}
    return Choice(
        *values, ordered=ordered, affixes=("dds_", f"_{idl.lower()}_qos", "_qos"), synonyms={**camel, **synonyms}
    )


class IdlDuration(Duration):
    """A duration, infinite also in the words and numbers that IDL, XML and the wire have for it."""

    def parse(self, text: str) -> int:
        """Read ``2s``, ``{sec: 2, nanosec: 0}``, ``DURATION_INFINITE`` and ``{sec: 2147483647, nanosec: 2147483647}``."""
        fields = flow(text) if text.lstrip().startswith("{") else None
        seconds = fields.get("sec", "") if isinstance(fields, dict) else text.strip()
        return super().parse("infinite" if _INFINITE.fullmatch(str(seconds)) else text)


def duration() -> Duration:
    """Return the domain of a `Duration_t`."""
    in_idl, on_the_wire = _LONG * _S + _LONG, _LONG * _S + 2**32 - 1
    return IdlDuration(infinities=(in_idl, on_the_wire))


def length(unit: str = "samples") -> Count:
    """Return the domain of a length: unlimited is also ``-1`` and ``LENGTH_UNLIMITED``."""
    return Count(unlimited=("unlimited", "-1", "length_unlimited", "dds_length_unlimited"), unit=unit)


def number() -> Count:
    """Return the domain of an IDL ``long``."""
    return Count(-_LONG - 1, _LONG)


class Representations(Names):
    """A list of data representations, in order of preference; names in any spelling, or their numbers."""

    known: Final = ("xcdr1", "xml", "xcdr2")

    def candidates(self) -> tuple[tuple[str, ...], ...]:
        """Give the lists that are in use, from which fixes choose: no fix advises XML."""
        return ("xcdr1",), ("xcdr1", "xcdr2"), ("xcdr2",), ("xcdr2", "xcdr1")

    def parse(self, text: str) -> tuple[str, ...]:
        """Read ``[XCDR2_DATA_REPRESENTATION]``, ``[2]`` or ``xcdr2``; what is named twice counts once."""
        return tuple(dict.fromkeys(map(self._one, super().parse(text))))

    def _one(self, written: str) -> str:
        name = normalise(written).removeprefix("dds_").removesuffix("_data_representation")
        if name in {"0", "1", "2"}:
            return self.known[int(name)]
        name = {"xcdr": "xcdr1", "cdr": "xcdr1"}.get(name, name)
        if name not in self.known:
            message = f"`{written}` is no data representation"
            raise InvalidValueError(message, self.expected())
        return name

    def word(self, text: str) -> str:
        """Read an empty list, however it is written, as the word ``default``."""
        inner = text.strip().removeprefix("[").removesuffix("]").strip()
        return normalise(text) if inner else "default"

    def expected(self) -> str:
        """Give the names."""
        return f"a list of {', '.join(self.known)}"


class Compressions(Names):
    """Ids of compression algorithms, as a list or as the bit mask of RTI Connext."""

    known: Final = ("zlib", "bzip2", "lz4")

    def candidates(self) -> tuple[tuple[str, ...], ...]:
        """Give the lists from which fixes choose."""
        return (), *((name,) for name in self.known), self.known

    def parse(self, text: str) -> tuple[str, ...]:
        """Read ``[lz4]``, ``ZLIB|LZ4``, ``DDS_COMPRESSION_ID_LZ4_BIT``, ``MASK_ALL`` and ``0x4``; in the order of the bits."""
        parts = [part for name in super().parse(text) for part in re.split(r"[|,]", name)]
        found = {each for part in parts for each in self._named(part)}
        return tuple(name for name in self.known if name in found)

    def mask(self, value: tuple[str, ...]) -> str:
        """Write the mask as the XML of RTI Connext does."""
        return "|".join(name.upper() for name in value) or "MASK_NONE"

    def _named(self, written: str) -> tuple[str, ...]:
        name = normalise(written).removeprefix("dds_").removeprefix("compression_id_").removesuffix("_bit")
        if name in self.known:
            return (name,)
        if name in {"mask_all", "all"}:
            return self.known
        if name in {"mask_none", "none", ""}:
            return ()
        bits = int(name, 0) if re.fullmatch(r"0x[0-9a-f]{1,8}|[0-9]{1,10}", name) else None
        if bits is None:
            message = f"`{written}` is no compression algorithm"
            raise InvalidValueError(message, self.expected())
        return tuple(each for index, each in enumerate(self.known) if bits >> index & 1)

    def word(self, text: str) -> str:
        """Read ``default`` and ``MASK_DEFAULT`` as the word, anything else as its own text."""
        name = normalise(text).removeprefix("dds_").removeprefix("compression_id_")
        return "default" if name == "mask_default" else name

    def expected(self) -> str:
        """Give the names."""
        return f"a list of {', '.join(self.known)}"
