"""Each element of a format is modelled, or sorted by what it can decide: lists of elements, as the owners of the formats publish them."""

from pathlib import Path

import pytest
from lxml import etree

from cqos_dds.importers.policy_forms import (
    FAST_ALSO,
    FAST_QOS,
    FAST_READ_ONLY,
    FAST_TOPIC,
    OMG,
)
from cqos_dds.importers.unmodelled import (
    CYCLONE,
    DDS_XML,
    DDS_XML_PARTICIPANT,
    FAST,
    FAST_PARTICIPANT,
    FAST_SECTIONS,
    OPENDDS,
)

SCHEMA_NAMES = ("connext", "fastdds", "cyclonedds", "opendds", "opendds_ini")
SCHEMAS = Path(__file__).parent / "schemas"
FAST_FORMS = {
    "qos": FAST_QOS | {other: FAST_QOS[name] for other, name in FAST_ALSO.items()} | FAST_READ_ONLY,
    "topic": FAST_TOPIC,
}


def paths(schema):
    lines = (SCHEMAS / f"{schema}.txt").read_text(encoding="utf-8").splitlines()
    return [line for line in lines if not line.startswith("#")]


def is_policy(path, forms):
    """Whether a path is of a field of a policy, or of what stands in one."""
    policy, _, rest = path.partition("/")
    return policy in forms and any(f"{rest}/".startswith(f"{field}/") for field in forms[policy])


def sorting(schema, path):
    """The table that an element of a schema stands in, with its path there, and whether a policy models it."""
    first, _, rest = path.partition("/")
    if schema == "opendds_ini":
        return OPENDDS, path, False
    if schema == "cyclonedds":
        return CYCLONE, path, False
    if schema == "fastdds":
        if first == "participant":
            return FAST_PARTICIPANT, rest, False
        if first in {"data_writer", "data_reader"}:
            above, _, below = rest.partition("/")
            return FAST, rest, above in FAST_FORMS and is_policy(below, FAST_FORMS[above])
        return FAST_SECTIONS, path, False
    if first in {"participant_qos", "participant_factory_qos"}:
        return DDS_XML_PARTICIPANT, rest, False
    return DDS_XML, rest, is_policy(rest, OMG)


def prefixes(path):
    steps = path.split("/")
    return ["/".join(steps[: number + 1]) for number in range(len(steps))]


def judged(table, path):
    """What the table says of an element, or of one that it stands in."""
    return next((found for each in prefixes(path) if (found := table.find(each)) is not None), None)


EVERY = [(schema, path) for schema in SCHEMA_NAMES for path in paths(schema)]


@pytest.mark.parametrize("schema", SCHEMA_NAMES)
def test_each_element_of_the_schema_is_modelled_or_sorted(schema):
    missing = []
    for path in paths(schema):
        table, below, modelled = sorting(schema, path)
        if not modelled and judged(table, below) is None:
            missing.append(path)
    assert missing == []


@pytest.mark.parametrize(
    "table", [DDS_XML, DDS_XML_PARTICIPANT, FAST, FAST_PARTICIPANT, FAST_SECTIONS, CYCLONE], ids=lambda each: ""
)
def test_an_element_that_no_table_names_may_prevent_a_match(table):
    element = etree.fromstring("<nobody_has_this><inner>1</inner></nobody_has_this>")
    assert [(path, effect) for path, _, effect in table.undecided(element, "nobody_has_this")] == [
        ("nobody_has_this", "match")
    ]


def test_no_element_that_may_decide_stands_in_one_that_cannot_matter():
    for table in (DDS_XML, DDS_XML_PARTICIPANT, FAST, FAST_PARTICIPANT, FAST_SECTIONS, CYCLONE):
        for pattern in table.may_decide:
            above = prefixes(pattern.partition("=")[0])[:-1]
            assert not {*above} & {*table.cannot_matter}, pattern
