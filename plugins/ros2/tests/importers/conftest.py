"""What an importer made of a file, as text that people can check line by line."""

import pytest

from cqos_core import System


def _at(place):
    if place is None:
        return "by default"
    return f"@{place.line}:{place.column}" if place.column is not None else f"@{place.line} {place.path}"


def _settings(settings):
    return [f"  {name} = {setting.text} {_at(setting.place)}" for name, setting in settings.items()]


def _participant(participant):
    return [f"participant {participant.id} {_at(participant.place)}", *_settings(participant.settings)]


def _endpoint(endpoint):
    kind = endpoint.role if endpoint.kind == "message" else endpoint.kind
    more = [f"({endpoint.label})" if endpoint.label else "", "external" if endpoint.external else ""]
    words = [kind, endpoint.topic, endpoint.type or "?", *filter(None, more), _at(endpoint.place)]
    presets = [f"  preset {ref.name} {_at(ref.place)}" for ref in endpoint.profiles]
    return [f"{endpoint.id}: {' '.join(words)}", *presets, *_settings(endpoint.settings)]


def _overlay(overlay):
    words = [overlay.name, "for", overlay.participant, *filter(None, [overlay.role]), overlay.topic]
    words += [f"entity {overlay.entity}"] if overlay.entity else []
    words += [f"when {'='.join(overlay.when)}"] if overlay.when else []
    return [f"overlay {' '.join(words)} {_at(overlay.place)}", *_settings(overlay.settings)]


def _bridge(bridge):
    lines = [f"bridge {bridge.id} {_at(bridge.place)}"]
    for route in bridge.routes:
        lines.append(f"  route {_at(route.place)}")
        for word, end in (("from", route.source), ("to", route.target)):
            kind = ("" if end.kind == "message" else f" {end.kind}") + (f" {end.type}" if end.type else "")
            values = "".join(f" {name}={setting.text}" for name, setting in end.settings.items())
            lines.append(f"    {word} {end.participant} {end.topic}{kind}{values}")
        lines += [f"    only {each}" for each in route.only] + [f"    but {each}" for each in route.but]
    return lines


def describe(system: System) -> str:
    """Return everything a system of an importer states, with lines and columns."""
    lines = []
    for participant in system.participants.values():
        lines += _participant(participant)
    for endpoint in system.endpoints:
        lines += _endpoint(endpoint)
    for bridge in system.bridges.values():
        lines += _bridge(bridge)
    for overlay in system.overlays:
        lines += _overlay(overlay)
    for note in system.notes:
        lines.append(f"{note.severity} {note.code} {_at(note.place)} {note.message}")
        lines += [f"  help: {note.help}"] if note.help else []
    return "\n".join(lines) + "\n"


@pytest.fixture(name="describe")
def _describe():
    return describe
