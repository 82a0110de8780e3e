"""Whatever the input: a system or an `InputError` that says where, in bounded time, and never anything else.

What fuzzing or reading the code found is kept in `FOUND`.
"""

import json
from pathlib import Path

import pytest
import yaml
from hypothesis import given
from hypothesis import strategies as st

from cqos_core.files.schema import system_schema
from cqos_core.importers.format_detection import claims_yaml
from cqos_core.model.problems import InputError
from cqos_core.model.source import ReadContext, Source
from cqos_core.model.system import System
from cqos_core.plugins import load_plugins, named
from tests.importers.test_yaml_docs import keys_of

read = named(load_plugins().importers["yaml"].reader)
CASES = Path(__file__).parent / "cases" / "yaml"
SEEDS = [file.read_bytes() for file in sorted(CASES.rglob("*.*")) if file.suffix in {".yaml", ".json"}]
SNIPPETS = [
    *(
        b"\n",
        b"\r",
        b"\t",
        b" ",
        b"  ",
        b": ",
        b":",
        b"- ",
        b"? ",
        b"#",
        b" #",
        b"&a ",
        b"*a",
        b"<<: ",
        b"!!int ",
    ),
    *(
        b"{",
        b"}",
        b"[",
        b"]",
        b",",
        b"'",
        b'"',
        b"|\n",
        b">\n",
        b"---\n",
        b"...\n",
        b"%YAML 1.2\n",
        b"@",
        b"`",
        b"\\",
    ),
    *(
        b"${",
        b"${n}",
        b"$${",
        b"}",
        b"null",
        b"~",
        b"\x00",
        b"\xff",
        b"\xff\xfe",
        b"\xed\xa0\x80",
        b"\xc2\x85",
    ),
    *(
        b"cqos: 1\n",
        b"participants: ",
        b"publishes: ",
        b"instances: {n: 3}\n",
        b"include: x\n",
        b"\xe2\x80\xa8",
        b"\xef\xbb\xbf",
    ),
]
FOUND = [
    b"cqos: 1\nchecks: [{name: [a], because: b, sentence: s}, {name: [a], because: b, sentence: s}]",
    b"cqos: 1\ninclude: x\n--- [",
]


def check(data, name="f.yaml"):
    claims_yaml(name, data[:65536])
    try:
        check_system(read(Source(name, data), ReadContext()))
    except InputError as refused:
        check_problems(refused, name)


def check_system(found):
    assert isinstance(found, System)
    assert {endpoint.participant for endpoint in found.endpoints} <= set(found.participants)
    assert len({endpoint.id for endpoint in found.endpoints}) == len(found.endpoints)


def check_problems(refused, name):
    assert refused.problems
    places = [problem.place for problem in refused.problems]
    assert {place.source for place in places} == {name}
    assert all(place.line >= 1 and (place.column or 1) >= 1 for place in places)
    str(refused).encode()


@st.composite
def mutated(draw):
    data = draw(st.sampled_from(SEEDS))
    for _ in range(draw(st.integers(1, 4))):
        start = draw(st.integers(0, len(data)))
        end = min(len(data), start + draw(st.sampled_from([0, 0, 1, 2, 10, 100])))
        piece = draw(st.sampled_from(SNIPPETS) | st.binary(max_size=3) | st.just(data[start:end] * 2))
        data = data[:start] + piece + data[end:]
    return data


KEYS = st.sampled_from(sorted({*keys_of(system_schema()), "depth", "", "${n}", "a b", "x:y"}))
SCALARS = (
    st.none()
    | st.booleans()
    | st.integers(-3, 3)
    | st.sampled_from(["", "a", "${n}", "${x}", "$${", "x${n}y", "2027-01-01"])
)
VALUES = st.recursive(
    SCALARS | st.text(max_size=5),
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(KEYS | st.text(max_size=5), inner, max_size=4),
    max_leaves=20,
)
DOCUMENTS = st.dictionaries(KEYS, VALUES, max_size=6).map(lambda keys: {"cqos": 1, "instances": {"n": 2}, **keys})


@given(mutated(), st.sampled_from(["f.yaml", "f.json", "<bytes>"]))
def test_mutated_files(data, name):
    check(data, name)


@given(mutated())
def test_mutated_files_without_libyaml(data):
    with pytest.MonkeyPatch.context() as patch:
        patch.delattr(yaml, "CSafeLoader")
        check(data)


@given(DOCUMENTS, st.booleans())
def test_any_document(document, as_json):
    text = json.dumps(document) if as_json else yaml.safe_dump(document, allow_unicode=True)
    check(text.encode("utf-8", "surrogatepass"))


@given(st.binary(max_size=64) | st.text(max_size=64).map(lambda text: f"cqos: 1\n{text}".encode()))
def test_any_bytes(data):
    check(data)


@pytest.mark.parametrize("data", FOUND)
def test_found_before(data):
    check(data)
