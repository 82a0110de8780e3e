"""What system files include of other formats: profiles, participants and all else, whatever importer reads it."""

from dataclasses import replace

import pytest

from cqos_core.model.problems import InputError, Problem
from cqos_core.model.settings import Place
from cqos_core.model.source import ReadContext, Source
from cqos_core.model.system import Overlay
from cqos_core.plugins import load_plugins, named
from tests.made_up_protocol import participant, profile, settings, world, writer

read = named(load_plugins().importers["yaml"].reader)
DESIGN = """cqos: 1
protocol: post
options: {post: {year: y2000}}
include: library.x
participants:
  a: {subscribes: {box: careful, other: {profile: own}}}
profiles:
  own: {profile: careful, delay: 2s}
"""
LIBRARY = world(
    writer("box", "w"),
    profile("careful", care="signed"),
    options={"year": "y1990", "town": 3},
    overlays=[Overlay("law", settings(care="plain"))],
    sources={"library.x": b"..."},
)


def reads(design=DESIGN, library=LIBRARY, asked=None):
    def opened(name, relative_to):
        assert relative_to == "s.yaml"
        return Source(name, b"...")

    def foreign(source, protocols):
        if asked is not None:
            asked.append((source.name, protocols))
        return replace(library, participants=dict(library.participants)) if library is not None else None

    return read(Source("s.yaml", design.encode()), ReadContext(opened, foreign))


def problems(**more):
    with pytest.raises(InputError) as refused:
        reads(**more)
    return [str(problem) for problem in refused.value.problems]


def test_everything_that_it_states_becomes_part_of_the_system():
    asked: list[tuple[str, frozenset[str]]] = []
    system = reads(asked=asked)
    assert asked == [("library.x", frozenset({"post"}))]
    assert set(system.profiles) == {"own", "careful"}
    assert set(system.participants) == {"a", "w"}
    assert [end.id for end in system.endpoints] == ["a/subscriber/box", "a/subscriber/other", "w"]
    assert [overlay.name for overlay in system.overlays] == ["law"]
    assert list(system.sources) == ["s.yaml", "library.x"]


def test_options_of_the_system_file_come_first():
    options = reads().options["post"]
    assert {name: each.text for name, each in options.items()} == {"year": "y2000", "town": "3"}


def test_another_protocol_stays_with_its_participants():
    system = reads(library=replace(LIBRARY, protocol="mail"))
    assert {name: each.protocol for name, each in system.participants.items()} == {"a": None, "w": "mail"}


def test_what_has_a_name_is_stated_once():
    library = world(replace(profile("own"), place=Place("library.x", 7)), participant("a"))
    first, second = problems(library=library)
    assert "profile `own` is stated twice, first at s.yaml:8:3" in first + second
    assert "participant `a` is stated twice, first at s.yaml:6:3" in first + second


def test_unrecognised_and_unreadable_files_are_reported():
    (unrecognised,) = problems(library=None)
    assert unrecognised.startswith("s.yaml:4:10: `library.x` is no system file, and no installed importer reads it")

    def refuse(source, protocols):
        raise InputError([Problem("CQ001", "it is cut off", Place(source.name, 3, 1))])

    with pytest.raises(InputError) as refused:
        read(Source("s.yaml", DESIGN.encode()), ReadContext(lambda name, _: Source(name, b""), refuse))
    assert [str(problem) for problem in refused.value.problems] == ["library.x:3:1: it is cut off"]
