"""The formats ``json`` and ``jsonl``: a whole `Report`, as documented in ``docs/json-report.md``; and their reader.

Within version 1 keys may be added, none is removed or changes its meaning. Readers ignore keys they do not know.
"""

from __future__ import annotations

import json
import re
from collections.abc import Callable
from typing import TYPE_CHECKING, Any, Final, TypeAlias

from cqos_core.formatters.places import Places
from cqos_core.model.coverage import Coverage
from cqos_core.model.finding import Edit, Fact, Finding, Remedy, Severity, Side, Verdict
from cqos_core.model.finding_json import finding_json
from cqos_core.model.problems import CqosError
from cqos_core.model.report import REPORT_VERSION, Assumption, Group, Report
from cqos_core.model.settings import Place
from cqos_core.model.system import PUBLISHER, SUBSCRIBER, Part

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Mapping

    from cqos_core.model.style import Style

_SURROGATE = re.compile("[\ud800-\udfff]")

Json = dict[str, Any]


def render_json(report: Report, style: Style) -> str:
    """Return the report as one JSON document, indented."""
    places = Places(report.findings, style.sources)
    return dump(report.to_dict(style.tool_version, places.exact), indent=2) + "\n"


def render_jsonl(report: Report, style: Style) -> str:
    """Return the report as lines, each a JSON object with its ``kind``: one summary, then groups, then findings."""
    return "".join(f"{dump(line)}\n" for line in _lines(report, style))


def _lines(report: Report, style: Style) -> Iterator[Json]:
    yield {
        "kind": "summary",
        **report.summary(style.tool_version),
        "not_checked": list(report.not_checked),
    }
    for group in report.groups:
        yield {"kind": "group", **group.to_dict()}
    places = Places(report.findings, style.sources)
    for finding in report.findings:
        yield {"kind": "finding", **finding_json(finding, places.exact)}


def dump(document: Json | list[Json], indent: int | None = None) -> str:
    """Return strict JSON that UTF-8 can carry; keys stay in the order they have."""
    text = json.dumps(document, ensure_ascii=False, allow_nan=False, indent=indent)
    # A name from a damaged input may hold half of a character, which UTF-8 cannot write but JSON can escape.
    return _SURROGATE.sub(lambda match: f"\\u{ord(match[0]):04x}", text)


def versioned(document: Json) -> str:
    """Return what a command found as JSON text of version 1, in ASCII."""
    return json.dumps({"version": 1, **document}, indent=2) + "\n"


# Reading


def report_from_json(text: str | bytes) -> Report:
    """Return the report that `render_json` wrote; places have the columns that were found when it was written.

    Raises:
        CqosError: if ``text`` is no JSON report, is one of a version this C-QoS does not know, or is damaged; the
            message says where.
    """
    try:
        document = json.loads(text)
    except (ValueError, RecursionError) as error:
        raise CqosError(f"this is no JSON report: {error}") from None
    if not isinstance(document, dict) or "version" not in document:
        raise CqosError("this is no JSON report: it is no object with a `version`")
    if (version := _number(document["version"], "report.version")) != REPORT_VERSION:
        raise CqosError(f"the JSON report has version {version}, this C-QoS reads version {REPORT_VERSION}")
    counts = _values(_COUNTS, document.get("counts"), "report.counts")
    return Report(**_values(_KEYS[Report], document, "report"), **counts)


_Take: TypeAlias = Callable[[Any, str], Any]
"""Reads a value of the document at a path into the type of the library."""


def _unfit(path: str, expected: str, found: object) -> CqosError:
    shown = "nothing" if found is None else json.dumps(found)[:60]
    return CqosError(f"the JSON report is damaged: `{path}` should be {expected}, found {shown}")


def _values(keys: Mapping[str, _Take], found: Any, path: str) -> dict[str, Any]:
    """Return the values of an object by key; keys that older reports lack may be missing."""
    if not isinstance(found, dict):
        raise _unfit(path, "an object", found)
    return {
        name: take(found.get(name), f"{path}.{name}")
        for name, take in keys.items()
        if name not in _LATER or found.get(name) is not None
    }


def _is_a(kind: type, expected: str) -> _Take:
    def take(found: Any, path: str) -> Any:
        # A boolean is an int to Python, but no number to JSON.
        if not isinstance(found, kind) or isinstance(found, bool):
            raise _unfit(path, expected, found)
        return found

    return take


_text = _is_a(str, "text")
_number = _is_a(int, "a whole number")


def _optional(take: _Take) -> _Take:
    return lambda found, path: None if found is None else take(found, path)


def _texts(found: Any, path: str) -> tuple[str, ...]:
    items = _is_a(list, "a list of texts")(found, path)
    if not all(isinstance(item, str) for item in items):
        raise _unfit(path, "a list of texts", items)
    return tuple(items)


def _one_of(allowed: Iterable[str]) -> _Take:
    choices = {str(choice): choice for choice in allowed}

    def take(found: Any, path: str) -> Any:
        if _text(found, path) not in choices:
            raise _unfit(path, f"one of {', '.join(choices)}", found)
        return choices[found]

    return take


def _one(kind: type) -> _Take:
    return lambda found, path: kind(**_values(_KEYS[kind], found, path))


def _many(kind: type) -> _Take:
    def take(found: Any, path: str) -> Any:
        items = _is_a(list, "a list of objects")(found, path)
        return tuple(_one(kind)(item, f"{path}[{index}]") for index, item in enumerate(items))

    return take


def _verdicts(found: Any, path: str) -> dict[str, Verdict]:
    worlds = _is_a(dict, "an object")(found, path)
    return {name: _verdict(verdict, f"{path}.{name}") for name, verdict in worlds.items()}


def _numbers(found: Any, path: str) -> dict[str, int]:
    return {name: _number(each, f"{path}.{name}") for name, each in _is_a(dict, "an object")(found, path).items()}


def _flag(found: Any, path: str) -> bool:  # noqa: ARG001 - older reports lack it
    return found is True


_verdict = _one_of(Verdict)
_COUNTS: Final = {"endpoints": _number, "topics": _number, "unmatched": _number, "hypothetical": _number}
_LATER: Final = frozenset({"unmatched", "hypothetical", "assumed", "coverage", "more_codes", "edits", "costs"})
"""Keys that older reports lack."""
_KEYS: Final[dict[type, dict[str, _Take]]] = {
    Report: {
        "verdict": _verdict,
        "groups": _many(Group),
        "findings": _many(Finding),
        "not_checked": _texts,
        "system": _text,
        "sources": _texts,
        "partial": _flag,
        "assumed": _many(Assumption),
        "coverage": _one(Coverage),
    },
    Coverage: {"endpoints": _number, "unclear": _texts, "unread": _many(Part), "totals": _numbers},
    Part: {"kind": _text, "name": _text, "cause": _text, "place": _optional(_one(Place)), "endpoints": _number},
    Assumption: {"option": _text, "values": _texts},
    Group: {
        "topic": _text,
        "publishers": _texts,
        "subscribers": _texts,
        "verdict": _verdict,
        "protocol": _text,
        "internal": _number,
        "codes": _texts,
    },
    Finding: {
        "code": _text,
        "name": _text,
        "severity": _one_of(Severity),
        "message": _text,
        "source": _text,
        "topic": _optional(_text),
        "verdict": _optional(_verdict),
        "sides": _many(Side),
        "remedies": _many(Remedy),
        "notes": _texts,
        "because": _text,
        "clause": _text,
        "help": _optional(_text),
        "pairs": _number,
        "worlds": _verdicts,
        "more_topics": _texts,
        "more_codes": _texts,
        "accepted": _optional(_text),
    },
    Side: {
        "role": _text,
        "members": _texts,
        "label": _text,
        "facts": _many(Fact),
        "place": _optional(_one(Place)),
        "templates": _texts,
    },
    Fact: {"policy": _text, "value": _text, "origin": _text, "place": _optional(_one(Place))},
    Remedy: {
        "role": _one_of((PUBLISHER, SUBSCRIBER)),
        "members": _texts,
        "policy": _text,
        "value": _text,
        "kind": _text,
        "text": _text,
        "mends": _number,
        "breaks": _number,
        "weakens": _flag,
        "edits": _many(Edit),
        "costs": _texts,
    },
    Edit: {"place": _one(Place), "attribute": _text, "old": _optional(_text), "new": _text},
    Place: {
        "source": _text,
        "line": _optional(_number),
        "column": _optional(_number),
        "element": _optional(_text),
        "path": _optional(_text),
    },
}
