"""Accepted findings in comments of system files: ``# cqos: ignore[ROS101] reason`` behind a setting, an endpoint or a topic."""

from __future__ import annotations

import re
from collections import defaultdict
from collections.abc import Iterable, Iterator
from itertools import chain
from typing import Final

import yaml

from cqos_core.importers.format_detection import may_have_exceptions
from cqos_core.importers.source_reading import shown
from cqos_core.model.encoding import Lines, decode
from cqos_core.model.regular_expressions import regular_expression
from cqos_core.model.settings import Place, Settings
from cqos_core.model.spelling import nearest
from cqos_core.model.system import Acceptance, Endpoint, ImportNote, Profile, System

_WORD: Final = "ignore"
_COMMENT: Final = regular_expression(r"(?:^|(?<=[ \t]))#[ \t]*cqos:[ \t]*(?P<text>(?P<word>[a-zA-Z]+).*)", re.MULTILINE)
_FORM: Final = regular_expression(r"ignore\[(?P<rules>[^\]]*)\][ \t]*(?P<reason>.*)")
_EXAMPLE: Final = "write `# cqos: ignore[CODE] reason` behind the setting, endpoint or topic that it is about"
_WILD: Final = regular_expression(r"([*?\[])")

_Covered = dict[tuple[str, int], dict[tuple[str, str], None]]
"""By file and line, the objects stated there: ``endpoint`` and a pattern of ids, or ``topic`` and a pattern of names."""


def take_inline_exceptions(system: System) -> None:
    """Add the acceptances in comments of the YAML sources of ``system``; a note reports each comment that is none."""
    marked = [(name, data) for name, data in system.sources.items() if may_have_exceptions(data)]
    covered = _covered(system) if marked else {}
    for name, data in marked:
        lines = Lines(decode(data))
        for at, line, text in _comments(lines):
            place = Place(name, *at)
            form = _FORM.fullmatch(text)
            rules = [rule.strip() for rule in form["rules"].split(",") if rule.strip()] if form else []
            about = covered.get((name, line), ())
            if wrong := _wrong(text, rules, form["reason"] if form else "", found=bool(about)):
                system.notes.append(ImportNote("CQ607", "warning", wrong, place, _EXAMPLE))
            elif form is not None:
                system.accept += (
                    Acceptance(rule, form["reason"], **{kind: pattern}, place=place)
                    for rule in rules
                    for kind, pattern in about
                )


def _wrong(text: str, rules: list[str], reason: str, *, found: bool) -> str:
    """Say why a comment is no exception; empty where it is one."""
    if not rules:
        return f"the exception {shown(text)} names no rule in brackets, so it accepts nothing"
    if not reason:
        return f"the exception from {', '.join(rules)} gives no reason, so it accepts nothing"
    return "" if found else f"no setting, endpoint or topic stands beside the exception from {', '.join(rules)}"


def _comments(lines: Lines) -> Iterator[tuple[tuple[int, int], int, str]]:
    """Yield the place of each comment for C-QoS, the line that it is about, and its text.

    A comment with a line of its own is about the next line that has more than a comment.
    """
    # Other words may be of other tools: `# cqos: 1` is a line that was commented out.
    found = [each for each in _COMMENT.finditer(lines.text) if _WORD in {each["word"], nearest(each["word"], [_WORD])}]
    within = _texts(lines.text) if found else []
    for each in found:
        if any(start <= each.start() < end for start, end in within):
            continue
        number, column = lines.position(each.start())
        about = number
        if not lines.line(number)[: column - 1].strip():
            about = _next(lines, number)
        yield (number, column), about, each["text"].strip()


def _next(lines: Lines, number: int) -> int:
    last = lines.position(len(lines.text))[0]
    following = range(number + 1, last + 1)
    return next((each for each in following if lines.line(each).strip() and lines.line(each).lstrip()[0] != "#"), 0)


def _texts(text: str) -> list[tuple[int, int]]:
    """Return where texts with a `#` stand, which begin no comment; the file was read before."""
    loader = getattr(yaml, "CSafeLoader", yaml.SafeLoader)
    try:
        scalars = [each for each in yaml.scan(text, Loader=loader) if isinstance(each, yaml.ScalarToken)]
    except yaml.YAMLError:  # JSON that YAML refuses; JSON has no comments
        return [(0, len(text))]
    return [(each.start_mark.index, each.end_mark.index) for each in scalars if "#" in each.value]


def _covered(system: System) -> _Covered:
    found: _Covered = defaultdict(dict)

    def cover(kind: str, name: str, places: Iterable[Place | None]) -> None:
        for place in dict.fromkeys(places):
            if place is not None and place.line is not None:
                found[place.source, place.line][kind, _WILD.sub(r"[\1]", name)] = None

    for endpoint in system.endpoints:
        own = system.participants[endpoint.participant]
        profiles = _profiles(endpoint, system.profiles)
        cover("endpoint", endpoint.id, (*_places(endpoint), own.place, *_settings(own.settings)))
        cover("endpoint", endpoint.id, chain.from_iterable((p.place, *_settings(p.settings)) for p in profiles))
    for participant in system.participants.values():
        cover("endpoint", participant.id, (participant.place, *_settings(participant.settings)))
    for broker in system.brokers.values():
        cover("endpoint", broker.id, (broker.place, *_settings(broker.settings)))
    for bridge in system.bridges.values():
        cover("endpoint", bridge.id, (bridge.place, *(route.place for route in bridge.routes)))
    for topic in system.topics.values():
        cover("topic", topic.name, (topic.place, *_settings(topic.settings)))
    return found


def _places(endpoint: Endpoint) -> Iterator[Place | None]:
    yield endpoint.place
    for settings in (endpoint.settings, endpoint.overlay, endpoint.needs):
        yield from _settings(settings)
    for profile in endpoint.profiles:
        yield profile.place


def _settings(settings: Settings) -> Iterator[Place | None]:
    return (setting.place for setting in settings.values())


def _profiles(endpoint: Endpoint, known: dict[str, Profile]) -> list[Profile]:
    """Return the profiles of the system that an endpoint takes values from, each once."""
    found: dict[str, Profile] = {}
    waiting = [each.name for each in endpoint.profiles]
    while waiting:
        name = waiting.pop()
        if name in known and name not in found:
            found[name] = known[name]
            waiting += (each.name for each in known[name].base)
    return [*found.values()]
