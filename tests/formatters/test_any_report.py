"""Laws of the formatters that hold for every report, whatever strings are in it."""

import json
import re
from copy import deepcopy
from dataclasses import fields, replace
from functools import cache
from pathlib import Path
from xml.etree import ElementTree as ET

import pytest
from hypothesis import given
from hypothesis import strategies as st
from jsonschema import Draft4Validator, Draft202012Validator

from cqos_core.formatters.causes import causes
from cqos_core.formatters.concise import render_concise
from cqos_core.formatters.fingerprint import fingerprint
from cqos_core.formatters.full import render_full
from cqos_core.formatters.github import render_github
from cqos_core.formatters.gitlab import render_gitlab
from cqos_core.formatters.json_report import render_json, render_jsonl, report_from_json
from cqos_core.formatters.junit import render_junit
from cqos_core.formatters.markdown import render_markdown
from cqos_core.formatters.multi_system import combined_report
from cqos_core.formatters.places import relative
from cqos_core.formatters.rdjson import render_rdjson
from cqos_core.formatters.sarif import render_sarif
from cqos_core.formatters.statistics import render_statistics
from cqos_core.formatters.terminal import clean
from cqos_core.formatters.text import render_text
from cqos_core.model.coverage import Coverage
from cqos_core.model.encoding import decode
from cqos_core.model.finding import Edit, Fact, Finding, Remedy, Severity, Side, Verdict
from cqos_core.model.report import Assumption, Group, Report
from cqos_core.model.settings import Place
from cqos_core.model.style import Style
from cqos_core.model.system import Part
from cqos_pictures.page import render_html

HERE = Path(__file__).parent
DOCS = HERE.parent.parent / "docs"

SOURCES = {
    "system.yaml": "a: {b: 'c\td', 天気: 雨}\n\t- x # 🚜\n\n\x1b[2J: \x07\n".encode(),
    "model.bpmn": b'<a id="x">\n<b id="y"\n qos:r="1"/></a>' + b" " * 300 + b"<c/>",
    "bad/\xff.yaml".encode().decode("utf-8", "replace"): b"\xff\xfe\x00",
}

# Lone low surrogates are what undecodable file names become. High ones could meet a low one and be a character.
characters = st.characters(exclude_categories=["Cs"]) | st.sampled_from(
    "\x1b\x9b\u202e\u2066\r\n\t\0\udc80,:%天🚜e\u0301"
)
texts = st.text(characters, max_size=6)
few_texts = st.lists(texts, max_size=4).map(tuple)
verdicts = st.sampled_from(Verdict)
numbers = st.integers(0, 10**9)
places = st.builds(
    Place,
    source=st.sampled_from([*SOURCES, "./gone.yaml", "/absolute/a b.yaml", "<bytes>"]) | texts,
    line=st.none() | st.integers(1, 5),
    column=st.none() | st.integers(1, 40),
    element=st.none() | st.sampled_from(["x", "y"]) | texts,
    path=st.none() | st.sampled_from(["@qos:r", "@id"]) | texts,
)
facts = st.builds(
    Fact,
    policy=texts,
    value=texts,
    origin=st.sampled_from(["explicit", "default", "profile p", "settled from best_available"]) | texts,
    place=st.none() | places,
)
sides = st.builds(
    Side,
    role=st.sampled_from(["subscriber", "publisher", "topic", "system"]),
    members=few_texts,
    label=st.sampled_from(["", "offered here"]),
    facts=st.lists(facts, max_size=4).map(tuple),
    place=st.none() | places,
    templates=few_texts,
)
edits = st.builds(Edit, place=places, attribute=texts, old=st.none() | texts, new=texts)
remedies = st.builds(
    Remedy,
    role=st.sampled_from(["publisher", "subscriber"]),
    members=few_texts,
    policy=texts,
    value=texts,
    kind=st.sampled_from(["configuration", "needs_code"]),
    text=texts,
    mends=numbers,
    breaks=numbers,
    weakens=st.booleans(),
    edits=st.lists(edits, max_size=2).map(tuple),
    costs=few_texts,
)
findings = st.builds(
    Finding,
    code=st.sampled_from(["ROS101", "MQT301", "CQ001"]) | texts,
    name=texts,
    severity=st.sampled_from(Severity),
    message=texts,
    source=texts,
    topic=st.none() | st.just("t") | texts,
    verdict=st.none() | verdicts,
    sides=st.lists(sides, max_size=2).map(tuple),
    remedies=st.lists(remedies, max_size=2).map(tuple),
    notes=few_texts,
    because=texts,
    clause=texts,
    help=st.none() | texts,
    pairs=numbers,
    worlds=st.dictionaries(
        st.sampled_from(["ros2.rmw=a", "ros2.rmw=b", "ros2.distro=c"]) | texts, verdicts, max_size=3
    ),
    more_topics=few_texts,
    accepted=st.none() | texts,
    more_codes=few_texts,
)
groups = st.builds(
    Group,
    topic=st.just("t") | texts,
    publishers=few_texts,
    subscribers=few_texts,
    verdict=verdicts,
    protocol=texts,
    internal=numbers,
    codes=few_texts,
)
parts = st.builds(Part, kind=texts, name=texts, cause=texts, place=st.none() | places, endpoints=numbers)
coverages = st.builds(
    Coverage,
    endpoints=st.integers(2, 100),
    unclear=few_texts,
    unread=st.lists(parts, max_size=2).map(tuple),
    totals=st.dictionaries(texts, numbers, max_size=2),
)
CONTENT = {
    "verdict": verdicts,
    "groups": st.lists(groups, max_size=2).map(tuple),
    "findings": st.lists(findings, max_size=2).map(tuple),
    "not_checked": few_texts,
    "system": texts,
    "sources": st.lists(st.sampled_from(list(SOURCES)) | texts, max_size=2).map(tuple),
    "endpoints": numbers,
    "topics": numbers,
    "partial": st.booleans(),
    "unmatched": numbers,
    "hypothetical": numbers,
    "assumed": st.lists(st.builds(Assumption, option=texts, values=few_texts), max_size=2).map(tuple),
    "coverage": coverages,
}
reports = st.builds(Report, **CONTENT, parts=st.just(()))
several = st.lists(reports, min_size=2, max_size=3).map(combined_report)
styles = st.builds(
    Style,
    show=st.sampled_from(Severity),
    color=st.just(False),
    width=st.integers(0, 200),
    sources=st.sampled_from([{}, SOURCES]),
    tool_version=st.sampled_from(["", "1.2.3"]),
)

RENDERERS = [
    render_text,
    render_full,
    render_concise,
    render_json,
    render_jsonl,
    render_sarif,
    render_junit,
    render_github,
    render_gitlab,
    render_rdjson,
    render_markdown,
    render_statistics,
    render_html,
]


def for_any(*strategies):
    """Run a test with values made up."""
    return given(*strategies)


@cache
def schema():
    """The documented schema, with every key that it does not document forbidden."""
    strict = json.loads((DOCS / "report-1.schema.json").read_text(encoding="utf-8"))
    for part in [strict, *strict["$defs"].values(), strict["properties"]["tool"]]:
        if "properties" in part:
            part["additionalProperties"] = False
    Draft202012Validator.check_schema(strict)
    return strict


@cache
def part_of_schema(name):
    part = deepcopy(schema())
    if name == "summary":
        for key in ("groups", "findings"):
            del part["properties"][key]
            part["required"].remove(key)
        return part
    return {"$defs": part["$defs"], **part["$defs"][name]}


@cache
def sarif_validator():
    return Draft4Validator(json.loads((HERE / "sarif-2.1.0.schema.json").read_text(encoding="utf-8")))


@pytest.mark.parametrize(
    ("strategy", "kind"),
    [
        (places, Place),
        (facts, Fact),
        (sides, Side),
        (edits, Edit),
        (remedies, Remedy),
        (findings, Finding),
        (groups, Group),
        (parts, Part),
        (coverages, Coverage),
        (reports, Report),
    ],
)
def test_strategies_know_every_field(strategy, kind):
    assert set(strategy.wrapped_strategy.kwargs) == {field.name for field in fields(kind)}


# --- all formats ---


@pytest.mark.parametrize("render", RENDERERS)
@for_any(reports, styles)
def test_output_depends_on_the_report_alone_and_can_be_written(render, report, style):
    text = render(report, style)
    text.encode("utf-8")
    assert text.endswith("\n")
    assert not text.endswith("\n\n")
    turned = (replace(f, worlds=dict(reversed(f.worlds.items()))) for f in report.findings)
    assert render(replace(report, findings=tuple(turned)), style) == text


# --- text ---


@pytest.mark.parametrize(("render", "separator"), [(render_full, "\n\n"), (render_concise, "\n")])
@for_any(reports, styles)
def test_text_says_each_finding_and_does_nothing_to_the_terminal(render, separator, report, style):
    text = render(report, style)
    accepted_too = style.show is Severity.NOTE
    shown = [
        finding
        for finding in report.findings
        if finding.severity.rank <= style.show.rank and (finding.accepted is None or accepted_too)
    ]
    if separator == "\n":
        shown = causes(shown, style)
    loose = separator == "\n" and report.partial and (report.unmatched > 0 or not report.endpoints)
    assumed = len(report.assumed) if separator == "\n" else 0
    assert text.removesuffix("\n").count(separator) == len(shown) + loose + assumed
    assert [c for c in text if not c.isprintable() and c not in "\n\u200c\u200d"] == []
    colored = render(report, replace(style, color=True))
    assert re.sub(r"\x1b\[[0-9;]*m", "", colored) == text


# --- JSON ---


@for_any(reports)
def test_json_can_be_read_back(report):
    assert report_from_json(render_json(report, Style())) == report


@for_any(reports, styles)
def test_json_is_as_documented(report, style):
    document = json.loads(render_json(report, style))
    Draft202012Validator(schema()).validate(document)
    assert list(document) == list(schema()["properties"])


@for_any(reports, styles)
def test_jsonl_has_the_same_in_lines(report, style):
    whole = json.loads(render_json(report, style))
    lines = [json.loads(line) for line in render_jsonl(report, style).split("\n")[:-1]]
    assert [line["kind"] for line in lines] == [
        "summary",
        *("group" for _ in report.groups),
        *("finding" for _ in report.findings),
    ]
    for line in lines:
        Draft202012Validator(part_of_schema(line.pop("kind"))).validate(line)
    found = {"groups": whole.pop("groups"), "findings": whole.pop("findings")}
    assert lines == [whole, *found["groups"], *found["findings"]]


# --- SARIF ---


@for_any(reports, styles)
def test_sarif_fits_the_published_schema(report, style):
    log = json.loads(render_sarif(report, style))
    sarif_validator().validate(log)
    [run] = log["runs"]
    rules = run["tool"]["driver"]["rules"]
    assert len({rule["id"] for rule in rules}) == len(rules)
    for result, finding in zip(run["results"], report.findings, strict=True):
        assert rules[result["ruleIndex"]]["id"] == result["ruleId"] == finding.code
        assert bool(result["suppressions"]) is (finding.accepted is not None)
    for uri in uris(log):
        assert re.fullmatch(r"(?:file:///(?:[A-Z]:)?)?(?:[A-Za-z0-9._~/-]|%[0-9A-F]{2})*", uri)


def uris(node):
    """Every file reference in a log."""
    if isinstance(node, dict):
        yield from ([node["uri"]] if isinstance(node.get("uri"), str) else [])
        node = list(node.values())
    if isinstance(node, list):
        for item in node:
            yield from uris(item)


@for_any(findings)
def test_fingerprints_ignore_lines_and_values(finding):
    def moved(place):
        return None if place is None else replace(place, line=99, column=None)

    def changed(side):
        new = (replace(fact, value=f"{fact.value}!", place=moved(fact.place)) for fact in side.facts)
        return replace(side, facts=tuple(new), place=moved(side.place))

    later = replace(finding, sides=tuple(map(changed, finding.sides)))
    assert fingerprint(later) == fingerprint(finding)


# --- JUnit ---


@for_any(reports, styles)
def test_junit_counts_right_and_is_green_only_for_what_fits(report, style):
    [suite] = ET.fromstring(render_junit(report, style))  # noqa: S314 - our own text
    cases = suite.findall("testcase")
    tags = [{part.tag for part in case} for case in cases]
    assert suite.attrib | {"name": ""} == {
        "name": "",
        "tests": str(len(cases)),
        "failures": str(sum("failure" in found for found in tags)),
        "errors": "0",
        "skipped": str(sum("skipped" in found for found in tags)),
    }
    assert any("failure" in found for found in tags) is report.fails(Severity.ERROR)
    green = {case.get("name") for case, found in zip(cases, tags, strict=True) if found <= {"system-out"}}
    unfit = {clean(group.topic) for group in report.groups if group.verdict is not Verdict.COMPATIBLE}
    # Two topics may look alike once they are cleaned.
    fit = {clean(group.topic) for group in report.groups if group.verdict is Verdict.COMPATIBLE}
    assert not green & (unfit - fit)


@for_any(several, styles)
def test_junit_keeps_systems_apart_that_were_checked_apart(report, style):
    document = ET.fromstring(render_junit(report, style))  # noqa: S314 - our own text
    alone = [ET.fromstring(render_junit(part, style)) for part in report.parts]  # noqa: S314
    assert len(document) == len(alone)
    for suite, [other] in zip(document, alone, strict=True):
        assert {**suite.attrib, "name": ""} == {**other.attrib, "name": ""}
        assert [case.get("name") for case in suite.iter("testcase")] == [c.get("name") for c in other.iter("testcase")]
    for name in ("tests", "failures", "skipped"):
        assert int(document.attrib[name]) == sum(int(each.attrib[name]) for each in alone)


# --- GitHub ---


COMMAND = re.compile(r"^::(error|warning|notice) ([^:]*)::(.*)$")


def unescaped(text):
    return text.replace("%0A", "\n").replace("%0D", "\r").replace("%25", "%")


def unescaped_property(text):
    return unescaped(text.replace("%2C", ",").replace("%3A", ":"))


@for_any(reports, styles)
def test_github_reads_one_command_for_each_finding(report, style):
    *commands, last, end = render_github(report, style).split("\n")
    shown = [f for f in report.findings if f.severity.rank <= style.show.rank and f.accepted is None]
    assert end == ""
    assert not last.startswith("::")
    assert len(commands) == len(shown)
    for command, finding in zip(commands, shown, strict=True):
        name, properties, data = COMMAND.findall(command)[0]
        assert name == {"note": "notice"}.get(finding.severity, finding.severity)
        known = dict(part.split("=", 1) for part in properties.split(","))
        assert list(known)[-1] == "title"
        if finding.code.isprintable() and finding.name.isprintable():
            assert unescaped_property(known["title"]) == f"{finding.code} {finding.name}"
        if finding.message.isprintable():
            assert unescaped(data).startswith(finding.message)


@given(text=st.text(st.characters(categories=["L", "P", "N"]) | st.sampled_from("%,:\r\n")))
def test_github_escapes_can_be_undone(text):
    place = Place(text, 1, 1)
    finding = Finding("C", text, Severity.ERROR, text, sides=(Side("topic", (), place=place),))
    [command, *_] = render_github(Report(Verdict.UNKNOWN, findings=(finding,)), Style()).split("\n")
    [(_, properties, data)] = COMMAND.findall(command)
    known = {key: unescaped_property(value) for key, _, value in (p.partition("=") for p in properties.split(","))}
    assert known == {"file": relative(text, Style()), "line": "1", "col": "1", "title": f"C {text}"}
    assert unescaped(data) == text


# --- gitlab, rdjson, markdown ---


def stands(report, style):
    """The findings that formats for reviews have."""
    return [f for f in report.findings if f.severity.rank <= style.show.rank and f.accepted is None]


@for_any(reports, styles)
def test_gitlab_has_one_issue_with_its_own_fingerprint_for_each_finding(report, style):
    issues = json.loads(render_gitlab(report, style))
    assert [issue["check_name"] for issue in issues] == [finding.code for finding in stands(report, style)]
    assert len({issue["fingerprint"] for issue in issues}) == len(issues)
    for issue in issues:
        assert set(issue) == {"description", "check_name", "fingerprint", "severity", "location"}
        assert issue["severity"] in {"critical", "minor", "info"}
        assert issue["location"]["lines"]["begin"] >= 1


@for_any(reports, styles)
def test_rdjson_has_one_diagnostic_for_each_finding(report, style):
    found = json.loads(render_rdjson(report, style))
    assert [each["code"]["value"] for each in found["diagnostics"]] == [f.code for f in stands(report, style)]
    for each in found["diagnostics"]:
        start = each["location"].get("range", {}).get("start", {})
        assert all(number >= 1 for number in start.values())


@for_any(st.text(characters, max_size=8), st.text(characters, max_size=8), texts, st.data())
def test_a_suggestion_of_rdjson_changes_the_bytes_that_the_fix_changes(before, old, new, data):
    text = before + old + data.draw(st.text(characters, max_size=8))
    source = text.encode("utf-8", "surrogateescape")
    text = decode(source)
    start = data.draw(st.integers(0, len(text)))
    end = data.draw(st.integers(start, len(text)))
    style = Style(sources={"a": source}, replaced=lambda _: {"a": [(start, end, new)]})
    edit = Edit(Place("a", 1), "x", old, new)
    remedy = Remedy("publisher", ("p",), "x", new, "configuration", "change it", edits=(edit,))
    finding = Finding(
        "C", "n", Severity.ERROR, "m", sides=(Side("topic", (), place=Place("a", 1)),), remedies=(remedy,)
    )
    [diagnostic] = json.loads(render_rdjson(Report(Verdict.UNKNOWN, findings=(finding,)), style))["diagnostics"]
    [suggestion] = diagnostic["suggestions"]
    data_of = text.encode("utf-8", "surrogatepass")
    lines = data_of.split(b"\n")
    at = [
        sum(len(line) + 1 for line in lines[: place["line"] - 1]) + place["column"] - 1
        for place in (suggestion["range"]["start"], suggestion["range"]["end"])
    ]
    assert data_of[: at[0]] == text[:start].encode("utf-8", "surrogatepass")
    assert data_of[at[1] :] == text[end:].encode("utf-8", "surrogatepass")


@for_any(reports | several, styles)
def test_markdown_shows_names_as_they_are(report, style):
    text = render_markdown(report, style)
    rows = [line for line in text.split("\n") if line.startswith(("| error", "| warning", "| note"))]
    assert len(rows) == sum(len(causes(stands(part, style), style)) for part in report.parts or (report,))
    for row in rows:
        plain = re.sub(r"</?code>|<br>|&#\d+;", "", row)
        assert plain.count("|") == 5
        assert not set(plain) & set("<>&`*_[]~@#!\\")


# --- HTML ---


@for_any(reports | several, styles)
def test_each_link_of_the_page_leads_to_one_place(report, style):
    text = render_html(report, style)
    anchors = re.findall(r'(?<=[\s"])id="([^"]*)"', text)
    assert len({*anchors}) == len(anchors)
    assert all(re.fullmatch(r"[A-Za-z0-9-]+", anchor) for anchor in anchors)
    assert {*re.findall(r'href="#([^"]*)"', text)} <= {*anchors}
