"""The output of programs: whatever the bytes are, what packs read in its lines is found."""

import io
import re

import pytest
from hypothesis import given
from hypothesis import strategies as st

from cqos_core.analysis.runtime_logs import explain_alone, explain_mismatches
from cqos_core.packs.log_mismatches import LogMismatch, read_mismatches
from tests.growth.linear import assert_linear
from tests.made_up_protocol import CONTEXT, reader, world, writer


def post(line):
    """Read ``WRITER@BOX complains of care``, as a postman would print it."""
    for found in re.finditer(r"(\w+)@(\w*) complains of (\w+)", line):
        yield LogMismatch("post", "publisher", found[2] or None, found[1], found[3].upper(), (found[3],))


def read(data):
    return read_mismatches("log", io.BytesIO(data), [post])


def test_lines_are_counted_and_the_first_is_kept():
    found, lines = read(
        b"x\na@t complains of care\nb@t complains of care\r\na@t complains of care a@u complains of care"
    )
    assert lines == 4
    assert [(each.misfit.participant, each.misfit.topic, each.count, each.place.line) for each in found] == [
        ("a", "t", 2, 2),
        ("b", "t", 1, 3),
        ("a", "u", 1, 4),
    ]


def test_colours_do_not_hide_anything():
    (found,), _ = read(b"\x1b[33ma\x1b[0m@\x1b[1;31mt\x1b[0m complains\x1b]0;title\x07 of care\x1b[K")
    assert found.misfit == LogMismatch("post", "publisher", "t", "a", "CARE", ("care",))


@pytest.mark.parametrize("encoding", ["utf-8", "utf-8-sig", "utf-16", "latin-1"])
def test_encodings_that_shells_write(encoding):
    found, lines = read("é\r\na@t complains of care\r\n".encode(encoding))
    assert (len(found), lines) == (1, 2)


def test_progress_bars_are_lines():
    found, lines = read(b"10%\r20%\ra@t complains of care\r")
    assert (len(found), lines, found[0].place.line) == (1, 3, 3)


def test_of_a_huge_line_the_beginning_is_read_and_the_next_line_is_found():
    def huge(size: int) -> bytes:
        return b"a@t complains of care" + b"x" * size + b"b@t complains of care\nc@t complains of care\n"

    assert_linear(lambda size: read(huge(size)), 4_000_000)
    found, lines = read(huge(30_000_000))
    assert [each.misfit.participant for each in found] == ["a", "c"]
    assert (lines, found[1].place.line) == (2, 2)


@given(st.binary(max_size=300))
def test_any_bytes_are_read_over(data):
    found, _ = read(data + b"\na@t complains of care\n" if not data.startswith((b"\xff\xfe", b"\xfe\xff")) else data)
    assert data.startswith((b"\xff\xfe", b"\xfe\xff")) or len(found) == 1


# What a system knows


SYSTEM = world(
    writer("t", "a/t", care="plain", delay="9s"),
    writer("t", "b/t", care="insured", sealed=True, delay="1s"),
    reader("t", "r/t", care="signed", delay="1s"),
    writer("u", "a/u", care="insured", sealed=True),
    reader("u", "r/u"),
    reader("lonely", "r/lonely"),
)


def explained(line, system=SYSTEM):
    found, _ = read(line.encode())
    (one,) = explain_mismatches(found, system, CONTEXT)
    return one


def test_all_findings_of_the_pair_are_listed():
    one = explained("a@t complains of care")
    assert [(pair.publisher, pair.subscriber, pair.verdict) for pair in one.pairs] == [("a/t", "r/t", "incompatible")]
    assert [finding.code for finding in one.findings] == ["POST101", "POST102"]
    assert ([rule.code for rule in one.rules], one.remark) == (["POST101"], "")


@pytest.mark.parametrize(
    ("line", "pairs", "remark"),
    [
        ("a@elsewhere complains of care", 0, "the system has no such topic"),
        ("a@lonely complains of care", 0, "the system has no publisher there"),
        ("c@t complains of care", 1, "the system has no publisher of `c` there; this is about its others"),
        ("a@u complains of care", 0, "by the system they fit, so what runs differs from it"),
        ("a@t complains of sealed", 1, "by the system other policies do not fit than the one that is named"),
        ("a@t complains of weather", 1, ""),
        ("a@ complains of delay", 1, ""),
        ("a@ complains of sealed", 0, "by the system they fit, so what runs differs from it"),
        ("c@ complains of care", 0, "the system has no publisher of `c` there"),
    ],
)
def test_what_does_not_agree_with_the_system_is_remarked(line, pairs, remark):
    one = explained(line)
    assert len(one.pairs) == pairs
    assert one.remark.startswith(remark)
    assert bool(one.remark) is bool(remark)


def test_a_reader_is_missing():
    one = explained("a@v complains of care", world(writer("v", "a/v")))
    assert one.remark == "the system has no subscriber there"


def test_without_a_system_the_rules_are_listed():
    found, _ = read(b"a@t complains of care\na@t complains of weather\n")
    assert [[rule.code for rule in each.rules] for each in explain_alone(found, CONTEXT)] == [["POST101"], []]
