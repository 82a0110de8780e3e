"""The JSON report, version 1: everything a `Report` holds, documented in ``docs/json-report.md``, and back again.

Within version 1 keys may be added, none is removed or changes its meaning. Readers ignore keys they do not know.
"""

from __future__ import annotations

import json
import re
from typing import TYPE_CHECKING, Any, TypeVar

from cqos_core.formatters.places import Places
from cqos_core.model import report_form
from cqos_core.model.problems import CqosError
from cqos_core.model.report import Assumption, Edit, Fact, Finding, Group, Remedy, Report, Severity, Side, Verdict
from cqos_core.model.report_form import VERSION
from cqos_core.model.system import PUBLISHER, SUBSCRIBER, Place

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator

    from cqos_core.formatters.style import Style
    from cqos_core.model.system import Role

_SURROGATE = re.compile("[\ud800-\udfff]")
_ROLES: tuple[Role, ...] = (PUBLISHER, SUBSCRIBER)
_Kind = TypeVar("_Kind")
_Text = TypeVar("_Text", bound=str)

Json = dict[str, Any]


def render_json(report: Report, style: Style) -> str:
    """Return the report as one JSON document, indented."""
    places = Places(report.findings, style.sources)
    return dump(report_form.document(report, style.tool_version, places.exact), indent=2) + "\n"


def render_jsonl(report: Report, style: Style) -> str:
    """Return the report as lines, each a JSON object with its ``kind``: one summary, then groups, then findings."""
    return "".join(f"{dump(line)}\n" for line in _lines(report, style))


def _lines(report: Report, style: Style) -> Iterator[Json]:
    yield {
        "kind": "summary",
        **report_form.summary(report, style.tool_version),
        "not_checked": list(report.not_checked),
    }
    for group in report.groups:
        yield {"kind": "group", **report_form.group(group)}
    places = Places(report.findings, style.sources)
    for finding in report.findings:
        yield {"kind": "finding", **report_form.finding(finding, places.exact)}


def dump(document: Json, indent: int | None = None) -> str:
    """Return strict JSON that UTF-8 can carry; keys stay in the order they have."""
    text = json.dumps(document, ensure_ascii=False, allow_nan=False, indent=indent)
    # A name from a damaged input may hold half of a character, which UTF-8 cannot write but JSON can escape.
    return _SURROGATE.sub(lambda match: f"\\u{ord(match[0]):04x}", text)


# --- and back ---


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
    report = _Object(document, "report")
    if (version := report.number("version")) != VERSION:
        raise CqosError(f"the JSON report has version {version}, this C-QoS reads version {VERSION}")
    return _read_report(report)


class _Object:
    """A JSON object that is read key by key, each with the type it must have."""

    def __init__(self, values: object, path: str) -> None:
        """Take ``values``, which stand at ``path`` of the document."""
        self._path = path
        if not isinstance(values, dict):
            raise self._unfit(None, "an object", values)
        self._values: Json = values

    def _unfit(self, key: str | None, expected: str, found: object) -> CqosError:
        where = self._path if key is None else f"{self._path}.{key}"
        shown = "nothing" if found is None else json.dumps(found)[:60]
        return CqosError(f"the JSON report is damaged: `{where}` should be {expected}, found {shown}")

    def _get(self, key: str, kind: type[_Kind], expected: str) -> _Kind:
        found = self._values.get(key)
        # A boolean is an int to Python, but no number to JSON.
        if not isinstance(found, kind) or isinstance(found, bool):
            raise self._unfit(key, expected, found)
        return found

    def text(self, key: str) -> str:
        return self._get(key, str, "text")

    def text_or_none(self, key: str) -> str | None:
        return None if self._values.get(key) is None else self.text(key)

    def flag(self, key: str) -> bool:
        """Whether a key that older reports lack is true."""
        return self._values.get(key) is True

    def number(self, key: str) -> int:
        return self._get(key, int, "a whole number")

    def number_or_none(self, key: str) -> int | None:
        return None if self._values.get(key) is None else self.number(key)

    def texts(self, key: str) -> tuple[str, ...]:
        found = self._get(key, list, "a list of texts")
        if not all(isinstance(item, str) for item in found):
            raise self._unfit(key, "a list of texts", found)
        return tuple(found)

    def one_of(self, key: str, allowed: Iterable[_Text]) -> _Text:
        found = self.text(key)
        choices = {str(choice): choice for choice in allowed}
        if found not in choices:
            raise self._unfit(key, f"one of {', '.join(choices)}", found)
        return choices[found]

    def object(self, key: str) -> _Object:
        return _Object(self._values.get(key), f"{self._path}.{key}")

    def objects(self, key: str) -> list[_Object]:
        found = self._get(key, list, "a list of objects")
        return [_Object(item, f"{self._path}.{key}[{index}]") for index, item in enumerate(found)]

    def has(self, key: str) -> bool:
        """Whether a key that reports of earlier versions lack is there."""
        return key in self._values

    def verdict_or_none(self, key: str) -> Verdict | None:
        return None if self._values.get(key) is None else self.one_of(key, Verdict)

    def verdicts(self, key: str) -> dict[str, Verdict]:
        found = self._get(key, dict, "an object")
        verdicts = _Object(found, f"{self._path}.{key}")
        return {name: verdicts.one_of(name, Verdict) for name in found}

    def place(self) -> Place | None:
        return None if self._values.get("place") is None else _read_place(self.object("place"))


def _read_report(report: _Object) -> Report:
    counts = report.object("counts")
    return Report(
        verdict=report.one_of("verdict", Verdict),
        groups=tuple(_read_group(group) for group in report.objects("groups")),
        findings=tuple(_read_finding(finding) for finding in report.objects("findings")),
        not_checked=report.texts("not_checked"),
        system=report.text("system"),
        sources=report.texts("sources"),
        endpoints=counts.number("endpoints"),
        topics=counts.number("topics"),
        partial=report.flag("partial"),
        unmatched=counts.number_or_none("unmatched") or 0,
        hypothetical=counts.number_or_none("hypothetical") or 0,
        assumed=tuple(
            Assumption(each.text("option"), each.texts("values"))
            for each in (report.objects("assumed") if report.has("assumed") else ())
        ),
    )


def _read_group(group: _Object) -> Group:
    return Group(
        topic=group.text("topic"),
        publishers=group.texts("publishers"),
        subscribers=group.texts("subscribers"),
        verdict=group.one_of("verdict", Verdict),
        protocol=group.text("protocol"),
        internal=group.number("internal"),
        codes=group.texts("codes"),
    )


def _read_finding(finding: _Object) -> Finding:
    return Finding(
        code=finding.text("code"),
        name=finding.text("name"),
        severity=finding.one_of("severity", Severity),
        message=finding.text("message"),
        source=finding.text("source"),
        topic=finding.text_or_none("topic"),
        verdict=finding.verdict_or_none("verdict"),
        sides=tuple(_read_side(side) for side in finding.objects("sides")),
        remedies=tuple(_read_remedy(remedy) for remedy in finding.objects("remedies")),
        notes=finding.texts("notes"),
        because=finding.text("because"),
        clause=finding.text("clause"),
        help=finding.text_or_none("help"),
        pairs=finding.number("pairs"),
        worlds=finding.verdicts("worlds"),
        more_topics=finding.texts("more_topics"),
        more_codes=finding.texts("more_codes") if finding.has("more_codes") else (),
        accepted=finding.text_or_none("accepted"),
    )


def _read_side(side: _Object) -> Side:
    return Side(
        role=side.text("role"),
        members=side.texts("members"),
        label=side.text("label"),
        facts=tuple(_read_fact(fact) for fact in side.objects("facts")),
        place=side.place(),
        templates=side.texts("templates"),
    )


def _read_fact(fact: _Object) -> Fact:
    return Fact(fact.text("policy"), fact.text("value"), fact.text("origin"), fact.place())


def _read_remedy(remedy: _Object) -> Remedy:
    return Remedy(
        role=remedy.one_of("role", _ROLES),
        members=remedy.texts("members"),
        policy=remedy.text("policy"),
        value=remedy.text("value"),
        kind=remedy.text("kind"),
        text=remedy.text("text"),
        mends=remedy.number("mends"),
        breaks=remedy.number("breaks"),
        weakens=remedy.flag("weakens"),
        edits=tuple(map(_read_edit, remedy.objects("edits"))) if remedy.has("edits") else (),
    )


def _read_edit(edit: _Object) -> Edit:
    return Edit(_read_place(edit.object("place")), edit.text("attribute"), edit.text_or_none("old"), edit.text("new"))


def _read_place(place: _Object) -> Place:
    return Place(
        source=place.text("source"),
        line=place.number_or_none("line"),
        column=place.number_or_none("column"),
        element=place.text_or_none("element"),
        path=place.text_or_none("path"),
    )
