"""The spelling of values in a dialect."""

from __future__ import annotations

from typing import TYPE_CHECKING

from cqos_core.language.domains import Duration
from cqos_core.language.values import INFINITE
from cqos_core.model.problems import InvalidValueError
from cqos_core.resolving.reader import spelled

if TYPE_CHECKING:
    from cqos_core.language.domains import Domain
    from cqos_core.language.policy import Policy
    from cqos_core.language.values import Plain
    from cqos_core.packs.presets import Dialect


def dialect_text(policy: Policy, value: Plain, dialect: Dialect | None, old: str | None) -> str | None:
    """Return the text of a value in a dialect, in the style of the ``old`` text; None if the dialect cannot write it.

    The text is read back with the same dialect, so a value that the dialect cannot write is never returned.
    """
    plain = policy.spelling(value)
    if plain is None:
        return None
    codes = dialect.codes.get(policy.name, {}) if dialect is not None else {}
    coded = [code for code, word in codes.items() if word == plain]
    bare = _in_unit(policy.domain, value, dialect.bare_unit if dialect is not None else None)
    alike = [] if old is None else _in_the_manner_of(old, policy, plain)
    if old is None or old.strip() in codes:
        tried = [*coded, *bare, plain] if old is not None else [plain, *coded]
    elif old.strip().replace(".", "", 1).isdigit():
        tried = [*bare, plain, *coded]
    else:
        tried = [*alike, plain, *bare, *coded]
    return next((text for text in tried if _reads_as(policy, text, dialect, value)), None)


def _in_unit(domain: Domain, value: Plain, unit: str | None) -> list[str]:
    """Return a duration as a bare number of a unit, where it is a number of it."""
    if unit is None or not isinstance(domain, Duration) or not isinstance(value, int) or value >= INFINITE:
        return []
    whole, rest = divmod(value, domain.parse(f"1{unit}"))
    size = len(str(domain.parse(f"1{unit}"))) - 1
    return [f"{whole}.{rest:0{size}d}".rstrip("0").rstrip(".") if rest else str(whole)]


def _in_the_manner_of(old: str, policy: Policy, plain: str) -> list[str]:
    """Return a name with the affixes and in the case of another one: ``RELIABLE_RELIABILITY_QOS``, ``Best Effort``."""
    name = policy.domain.word(old)
    for was, now in ((name, plain), (name.replace("_", " "), plain.replace("_", " "))):
        at = old.lower().find(was)
        if was and at >= 0:
            part = old[at : at + len(was)]
            cased = now.upper() if part.isupper() else now.title() if part.istitle() else now
            return [old[:at] + cased + old[at + len(was) :]]
    return []


def _reads_as(policy: Policy, text: str, dialect: Dialect | None, value: Plain) -> bool:
    read = spelled(policy, text, dialect)
    if read is None or policy.domain.word(read) in policy.words:
        return False
    try:
        return policy.domain.parse(read) == value and not (value == 0 and policy.zero is not None)
    except InvalidValueError:
        return False
