"""Settings of the DDS pack as numbers and words that programs read: in Python, and line by line."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Final
from urllib.parse import quote, unquote

LISTS: Final = ("partition", "data_representation")
TEXTS: Final = ("type", "user_data", "group_data", "topic", "extensibility", "role", "configuration")
UNLIMITED: Final = -1
"""A count without limit, as all implementations write it."""


def parsed(settings: Mapping[str, str]) -> dict[str, Any]:
    """Read endpoint-level settings as the pack reads them; durations are nanoseconds."""
    from cqos_core.packs import INFINITE
    from cqos_dds.pack import PACK

    read = {}
    for name, text in settings.items():
        policy = PACK.policy(name)
        value: Any = policy.domain.parse(text)
        if value == INFINITE and policy.domain.kind == "count":
            value = UNLIMITED
        read[policy.name] = policy.domain.format(value) if policy.domain.kind == "choice" else value
    return read


def encoded(value: Any) -> str:
    """Write a value so that it has neither spaces nor line ends; lists are separated by commas."""
    if isinstance(value, (tuple, list)):
        return ",".join(quote(each, safe="") or "%" for each in value)
    return quote(value, safe="") if isinstance(value, str) else str(int(value))


def decoded(name: str, text: str) -> Any:
    """Read what `encoded` wrote."""
    if name in LISTS:
        return tuple(unquote(part) if part != "%" else "" for part in text.split(",")) if text else ()
    text = unquote(text)
    return int(text) if name not in TEXTS and text.lstrip("-").isdigit() else text
