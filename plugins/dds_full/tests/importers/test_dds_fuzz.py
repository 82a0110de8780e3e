"""Whatever stands in an XML file, it is read or refused with places; nothing else ever happens."""

from hypothesis import given
from hypothesis import strategies as st

import cqos_core as cqos
from cqos_core import InputError
from cqos_dds.importers.policy_forms import FAST_QOS, FAST_TOPIC, OMG

TAGS = sorted(
    {
        "qos_library",
        "qos_profile",
        "datawriter_qos",
        "datareader_qos",
        "publisher_qos",
        "topic_qos",
        "base_name",
        "element",
    }
    | {
        "domain_library",
        "domain",
        "topic",
        "register_type",
        "domain_participant_library",
        "domain_participant",
        "types",
    }
    | {
        "publisher",
        "data_writer",
        "subscriber",
        "data_reader",
        "application_library",
        "application",
        "struct",
        "member",
    }
    | {"profiles", "qos", "topic", "sec", "nanosec", "name", "domain_participant_ref", *OMG, *FAST_QOS, *FAST_TOPIC}
    | {field for form in (*OMG.values(), *FAST_QOS.values()) for field in form}
)
ATTRIBUTES = (
    "name",
    "base_name",
    "topic_filter",
    "topic_ref",
    "domain_ref",
    "domain_id",
    "profile_name",
    "is_default_qos",
    "key",
)
WORDS = (
    "",
    "A",
    "L::A",
    "A::B::C",
    "1",
    "-1",
    "true",
    "RELIABLE_RELIABILITY_QOS",
    "DURATION_INFINITY",
    "LENGTH_UNLIMITED",
    "*",
    "[",
    "é",
)

words = st.sampled_from(WORDS)
trees = st.recursive(
    words,
    lambda inner: st.tuples(
        st.sampled_from(TAGS),
        st.dictionaries(st.sampled_from(ATTRIBUTES), words, max_size=3),
        st.lists(inner, max_size=4),
    ),
    max_leaves=25,
)


def xml(tree):
    if isinstance(tree, str):
        return tree
    tag, attributes, inner = tree
    stated = "".join(f' {name}="{text}"' for name, text in attributes.items())
    return f"<{tag}{stated}>{''.join(map(xml, inner))}</{tag}>"


def outcome(text, importer):
    """What is found in a file, or what is wrong with it."""
    try:
        return cqos.check(text.encode(), importer=importer).findings, ()
    except InputError as refused:
        return (), refused.problems


@given(st.lists(trees, max_size=5), st.sampled_from(["dds_xml", "fastdds_xml"]))
def test_any_elements_in_any_order(parts, importer):
    text = f"<dds>{''.join(map(xml, parts))}</dds>"
    found, problems = outcome(text, importer)
    assert all(problem.place is not None and problem.place.line for problem in problems)
    assert all(finding.code for finding in found)


@given(st.data())
def test_a_real_file_with_something_else_in_it(data):
    text = (
        '<dds><qos_library name="L"><qos_profile name="A" base_name="B"><datawriter_qos topic_filter="x*"><deadline><period><sec>1'
        "</sec></period></deadline></datawriter_qos></qos_profile></qos_library></dds>"
    )
    at = data.draw(st.integers(0, len(text)))
    upto = data.draw(st.integers(at, min(len(text), at + 12)))
    changed = text[:at] + data.draw(st.sampled_from(["", "<", ">", '"', "&", "::", "é", "\0", "<a/>"])) + text[upto:]
    found, problems = outcome(changed, "dds_xml")
    assert found or problems
