"""Damaged and hostile files give a system or a located error, never anything else, and quickly."""

from __future__ import annotations

import re
from pathlib import Path
from typing import TYPE_CHECKING

from hypothesis import given
from hypothesis import strategies as st

from cqos_core.bpmn import read
from cqos_core.model.codes import CODES
from cqos_core.model.excerpt import exact, span
from cqos_core.model.problems import InputError
from cqos_core.model.source import ReadContext, Source

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from cqos_core.model.settings import Place
    from cqos_core.model.system import System

HERE = Path(__file__).parent
FILES = sorted([*(HERE / "cases" / "bpmn").iterdir(), *(HERE.parents[1] / "examples").glob("*.bpmn")])
HOSTILE = [
    b"<!DOCTYPE x [<!ENTITY a 'b'><!ENTITY c '&a;&a;&a;'>]>",
    b"<!DOCTYPE x SYSTEM 'file:///etc/passwd'>",
    b"&a;",
    b"&#0;",
    b"&#x1b;[31m",
    b"<![CDATA[",
    b"]]>",
    b"<!--",
    b"-->",
    b"<?xml version='1.0' encoding='utf-7'?>",
    b"\xff\xfe",
    b"\xef\xbb\xbf",
    b"\x00",
    b"\r",
    b"\xe2\x80\xae",
    b"<bpmn:process id='Process_1'>",
    b"</bpmn:process>",
    b"<bpmn:subProcess>" * 300,
    b"<qos:accept/><qos:need/><qos:option/><qos:policy/>",
    b" id='Event_1'",
    b" qos:external='x'",
    b" xmlns:qos='http://other'",
    b" xmlns='http://www.omg.org/spec/BPMN/20100524/MODEL'",
]
# Parts worth exchanging: attributes with their values, and whole tags.
PARTS = re.compile(rb"""\s[\w:]+="[^"]*"|<[^<>]*>|"[^"]*\"""")

Mutation = tuple[str, float, bytes]


def _at(data: bytes, where: float) -> int:
    return int(where * len(data))


def _flip(data: bytes, where: float, with_: bytes) -> bytes:
    at = _at(data, where)
    return data[:at] + with_[:1] + data[at + 1 :]


def _delete(data: bytes, where: float, with_: bytes) -> bytes:
    at = _at(data, where)
    return data[:at] + data[at + 1 + len(with_) :]


def _insert(data: bytes, where: float, with_: bytes) -> bytes:
    at = _at(data, where)
    return data[:at] + with_ + data[at:]


def _truncate(data: bytes, where: float, _: bytes) -> bytes:
    return data[: _at(data, where)]


def _part(data: bytes, where: float) -> re.Match[bytes] | None:
    return PARTS.search(data, _at(data, where))


def _drop_part(data: bytes, where: float, _: bytes) -> bytes:
    part = _part(data, where)
    return data if part is None else data[: part.start()] + data[part.end() :]


def _repeat_part(data: bytes, where: float, _: bytes) -> bytes:
    part = _part(data, where)
    return data if part is None else data[: part.end()] + part[0] + data[part.end() :]


def _insert_behind_part(data: bytes, where: float, with_: bytes) -> bytes:
    part = _part(data, where)
    return data if part is None else data[: part.end()] + with_ + data[part.end() :]


MUTATIONS: dict[str, Callable[[bytes, float, bytes], bytes]] = {
    "flip": _flip,
    "delete": _delete,
    "insert": _insert,
    "truncate": _truncate,
    "drop part": _drop_part,
    "repeat part": _repeat_part,
    "insert behind part": _insert_behind_part,
}
mutations = st.lists(
    st.tuples(
        st.sampled_from(sorted(MUTATIONS)),
        st.floats(0, 1, exclude_max=True),
        st.sampled_from(HOSTILE) | st.binary(min_size=1, max_size=20),
    ),
    min_size=1,
    max_size=5,
)


def _places(system: System) -> Iterator[Place]:
    stated = [
        *(note.place for note in system.notes),
        *(participant.place for participant in system.participants.values()),
        *(acceptance.place for acceptance in system.accept),
        *(endpoint.place for endpoint in system.endpoints),
        *(setting.place for endpoint in system.endpoints for setting in endpoint.settings.values()),
        *(setting.place for endpoint in system.endpoints for setting in endpoint.needs.values()),
    ]
    return (place for place in stated if place is not None)


def _check_error(error: InputError, sources: dict[str, bytes]) -> None:
    assert error.problems
    for problem in error.problems:
        assert problem.code in CODES
        assert problem.place is not None
        assert problem.place.line is not None
        assert span(problem.place, sources) is not None


def _check_system(system: System) -> None:
    ids = [endpoint.id for endpoint in system.endpoints]
    assert len(ids) == len(set(ids))
    for endpoint in system.endpoints:
        assert endpoint.participant in system.participants
        assert endpoint.topic != ""
    assert {note.code for note in system.notes} <= CODES.keys()
    assert all(note.place is not None and note.place.line is not None for note in system.notes)
    for place in exact(_places(system), system.sources).values():
        excerpt = span(place, system.sources)
        assert excerpt is not None
        assert 1 <= excerpt.column <= len(excerpt.text) + 1


def _read(source: Source, messages: str) -> System | InputError:
    try:
        return read(source, ReadContext(options={"bpmn": {"message_flows": messages}}))
    except InputError as error:
        return error


@given(st.sampled_from(FILES), mutations, st.sampled_from(["true", "false"]))
def test_a_damaged_file_is_a_system_or_a_located_error(path: Path, changes: list[Mutation], messages: str):
    data = path.read_bytes()
    for kind, where, with_ in changes:
        data = MUTATIONS[kind](data, where, with_)
    result = _read(Source(path.name, data), messages)
    if isinstance(result, InputError):
        _check_error(result, {path.name: data})
    else:
        _check_system(result)


@given(st.binary(max_size=300))
def test_noise_is_a_located_error(data: bytes):
    result = _read(Source("noise", data), "false")
    assert isinstance(result, InputError)
    _check_error(result, {"noise": data})
