"""The table of policies against that of the standard (DDS 1.4, section 2.2.3; DDS-XTypes 1.3, section 7.6.3)."""

import pytest

from cqos_core import INFINITE, CqosError, PairReport, check_pair
from cqos_dds.kinds import Representations, choice, duration
from cqos_dds.pack import PACK
from tests.explained_values import side

P, T, G, W, R = "participant", "topic", "publisher subscriber", "writer", "reader"
TABLE = {
    # policy, in its own words: fields, entities, default of writer and reader, changeable
    "user_data": ([""], f"{P} {W} {R}", {"": ("", "")}, True),
    "topic_data": ([""], T, {"": ("", "")}, True),
    "group_data": ([""], G, {"": ("", "")}, True),
    "durability": ([""], f"{T} {W} {R}", {"": ("volatile", "volatile")}, False),
    "durability_service": (
        [
            "service_cleanup_delay",
            "history_kind",
            "history_depth",
            "max_samples",
            "max_instances",
            "max_samples_per_instance",
        ],
        f"{T} {W}",
        {
            "service_cleanup_delay": ("0s", None),
            "history_kind": ("keep_last", None),
            "history_depth": ("1", None),
            "max_samples": ("unlimited", None),
            "max_instances": ("unlimited", None),
            "max_samples_per_instance": ("unlimited", None),
        },
        False,
    ),
    "presentation": (
        ["access_scope", "coherent_access", "ordered_access"],
        G,
        {
            "access_scope": ("instance", "instance"),
            "coherent_access": ("false", "false"),
            "ordered_access": ("false", "false"),
        },
        False,
    ),
    "deadline": ([""], f"{T} {W} {R}", {"": ("infinite", "infinite")}, True),
    "latency_budget": ([""], f"{T} {W} {R}", {"": ("0s", "0s")}, True),
    "ownership": ([""], f"{T} {W} {R}", {"": ("shared", "shared")}, False),
    "ownership_strength": ([""], W, {"": ("0", None)}, True),
    "liveliness": (
        ["", "lease_duration"],
        f"{T} {W} {R}",
        {"": ("automatic", "automatic"), "lease_duration": ("infinite", "infinite")},
        False,
    ),
    "time_based_filter": ([""], R, {"": (None, "0s")}, True),
    "partition": ([""], G, {"": ("[]", "[]")}, True),
    "reliability": (
        ["", "max_blocking_time"],
        f"{T} {W} {R}",
        {"": ("reliable", "best_effort"), "max_blocking_time": ("100ms", "100ms")},
        False,
    ),
    "transport_priority": ([""], f"{T} {W}", {"": ("0", None)}, True),
    "lifespan": ([""], f"{T} {W}", {"": ("infinite", None)}, True),
    "destination_order": (
        [""],
        f"{T} {W} {R}",
        {"": ("by_reception_timestamp", "by_reception_timestamp")},
        False,
    ),
    "history": (["", "depth"], f"{T} {W} {R}", {"": ("keep_last", "keep_last"), "depth": ("1", "1")}, False),
    "resource_limits": (
        ["max_samples", "max_instances", "max_samples_per_instance"],
        f"{T} {W} {R}",
        dict.fromkeys(("max_samples", "max_instances", "max_samples_per_instance"), ("unlimited", "unlimited")),
        False,
    ),
    "entity_factory": ([""], f"factory {P} {G}", {"": ("true", "true")}, True),
    "writer_data_lifecycle": ([""], W, {"": ("true", None)}, True),
    "reader_data_lifecycle": (
        ["autopurge_nowriter_samples_delay", "autopurge_disposed_samples_delay"],
        R,
        {
            "autopurge_nowriter_samples_delay": (None, "infinite"),
            "autopurge_disposed_samples_delay": (None, "infinite"),
        },
        True,
    ),
    "data_representation": ([""], f"{T} {W} {R}", {"": ("[xcdr1]", "[xcdr1]")}, False),
    "type_consistency": (
        [
            "",
            "ignore_sequence_bounds",
            "ignore_string_bounds",
            "ignore_member_names",
            "prevent_type_widening",
            "force_type_validation",
        ],
        R,
        {
            "": (None, "allow_type_coercion"),
            "ignore_sequence_bounds": (None, "true"),
            "ignore_string_bounds": (None, "true"),
            "ignore_member_names": (None, "false"),
            "prevent_type_widening": (None, "false"),
            "force_type_validation": (None, "false"),
        },
        False,
    ),
}
EXTENSIONS = {"disable_positive_acks", "topic_kind", "compression_ids", "extensions"}
BESIDE = {
    "type",
    "type_information",
    "liveliness.announcement_period",
    "taken_every",
    "strongest_writer",
    "type_extensibility",
} | EXTENSIONS
"""What an endpoint has beside the policies of the standard."""
FIELDS = {
    f"{policy}.{field}".rstrip("."): (policy, field) for policy, (fields, *_) in TABLE.items() for field in fields
}


def explained(options: dict[str, str] | None = None, **requested: str) -> PairReport:
    """A pair that states nothing but what it requests."""
    report = check_pair("dds", {}, requested, options or {})
    assert not [each for each in report.findings if each.code.startswith("CQ")]
    return report


def default(report: PairReport, role: str, policy: str) -> str:
    return side(report, role)[policy].value


def test_all_24_policies_of_the_standard_are_there_and_no_others():
    assert len(TABLE) == 24
    listed = {policy.name for policy in PACK.policies if policy.level == "endpoint"} - BESIDE
    assert listed | {"topic_data"} == set(FIELDS)


@pytest.mark.parametrize("name", sorted(FIELDS))
def test_a_policy_is_as_in_the_standard(name: str):
    policy_name, field = FIELDS[name]
    _, entities, defaults, changeable = TABLE[policy_name]
    policy = PACK.policy(name, "topic" if name == "topic_data" else "endpoint")
    assert policy.entities == tuple(entities.split())
    assert policy.changeable is changeable
    assert policy.doc
    assert policy.clause
    if policy.level == "topic":
        return
    sides = {"publisher": defaults[field][0], "subscriber": defaults[field][1]}
    assert policy.roles == tuple(role for role, expected in sides.items() if expected is not None)
    found = explained()
    assert sides == {role: default(found, role, name) if role in policy.roles else None for role in sides}


def test_every_choice_reads_the_names_of_the_idl():
    spellings = {
        "reliability": "RELIABLE_RELIABILITY_QOS BEST_EFFORT_RELIABILITY_QOS",
        "durability": "VOLATILE_DURABILITY_QOS TRANSIENT_LOCAL_DURABILITY_QOS TRANSIENT_DURABILITY_QOS PERSISTENT_DURABILITY_QOS",
        "liveliness": "AUTOMATIC_LIVELINESS_QOS MANUAL_BY_PARTICIPANT_LIVELINESS_QOS MANUAL_BY_TOPIC_LIVELINESS_QOS",
        "ownership": "SHARED_OWNERSHIP_QOS EXCLUSIVE_OWNERSHIP_QOS",
        "destination_order": "BY_RECEPTION_TIMESTAMP_DESTINATIONORDER_QOS BY_SOURCE_TIMESTAMP_DESTINATIONORDER_QOS",
        "presentation.access_scope": "INSTANCE_PRESENTATION_QOS TOPIC_PRESENTATION_QOS GROUP_PRESENTATION_QOS",
        "history": "KEEP_LAST_HISTORY_QOS KEEP_ALL_HISTORY_QOS",
        "durability_service.history_kind": "KEEP_LAST_HISTORY_QOS KEEP_ALL_HISTORY_QOS",
        "type_consistency": "DISALLOW_TYPE_COERCION ALLOW_TYPE_COERCION",
    }
    for name, listed in spellings.items():
        domain = PACK.policy(name).domain
        plain = {domain.parse(each) for each in listed.split()}
        assert plain == set(domain.candidates()), name
        assert {domain.parse(f"DDS_{each}") for each in listed.split()} == plain


@pytest.mark.parametrize(
    "written",
    [
        "infinite",
        "DURATION_INFINITY",
        "DURATION_INFINITE",
        "DDS_DURATION_INFINITE",
        "DURATION_INFINITE_SEC",
        "{sec: DURATION_INFINITE_SEC, nanosec: DURATION_INFINITE_NSEC}",
        "{sec: DDS_DURATION_INFINITE_SEC, nanosec: 0}",
        "{sec: 2147483647, nanosec: 2147483647}",
        "{sec: 2147483647, nanosec: 4294967295}",
    ],
)
def test_infinite_in_all_spellings(written: str):
    assert duration().parse(written) == INFINITE


@pytest.mark.parametrize(
    "written", ["2", "-1s", "{sec: 1, nanosec: DURATION_INFINITE_NSEC}", "DURATION_ZERO", "1s, 2s"]
)
def test_no_duration(written: str):
    with pytest.raises(CqosError):
        duration().parse(written)


@pytest.mark.parametrize(
    ("written", "read"),
    [
        ("[]", ()),
        ("[xcdr2, xcdr1]", ("xcdr2", "xcdr1")),
        ("[XCDR_DATA_REPRESENTATION, XCDR2_DATA_REPRESENTATION]", ("xcdr1", "xcdr2")),
        ("DDS_XML_DATA_REPRESENTATION", ("xml",)),
        ("[0, 1, 2, 0]", ("xcdr1", "xml", "xcdr2")),
    ],
)
def test_data_representations(written: str, read: tuple[str, ...]):
    assert Representations().parse(written) == read


def test_what_is_no_data_representation():
    with pytest.raises(CqosError):
        Representations().parse("[xcdr3]")


@pytest.mark.parametrize("written", ["[]", "[ ]", "", "default"])
def test_an_empty_list_of_data_representations_is_the_default(written: str):
    assert default(explained(data_representation=written), "subscriber", "data_representation") == "[xcdr1]"


@pytest.mark.parametrize(
    ("implementation", "role", "policy", "value"),
    [
        ("fastdds", "publisher", "durability", "transient_local"),
        ("fastdds_3_1", "subscriber", "durability", "volatile"),
        ("fastdds_2_9", "publisher", "resource_limits.max_samples", "5000"),
        ("fastdds_3_1", "subscriber", "resource_limits.max_instances", "10"),
        ("fastdds_3_1", "subscriber", "resource_limits.max_samples_per_instance", "400"),
        ("fastdds_3_6", "subscriber", "resource_limits.max_samples", "unlimited"),
        ("cyclonedds", "subscriber", "data_representation", "[xcdr1, xcdr2]"),
        ("opendds", "publisher", "data_representation", "[xcdr2]"),
        ("opendds", "subscriber", "data_representation", "[xcdr1, xcdr2]"),
        ("connext", "publisher", "data_representation", "[xcdr1]"),
    ],
)
def test_defaults_of_implementations(implementation: str, role: str, policy: str, value: str):
    assert default(explained({"implementation": implementation}), role, policy) == value


@pytest.mark.parametrize(
    ("written", "read"),
    [
        ("Cyclone DDS", "cyclonedds"),
        ("rmw_cyclonedds_cpp", "cyclonedds"),
        ("RTI Connext", "connext"),
        ("fastdds_3", "fastdds_3_6"),
        ("dust_dds", "dust"),
    ],
)
def test_an_implementation_is_read_by_any_of_its_names(written: str, read: str):
    domain = PACK.policy("implementation", "option").domain
    assert domain.format(domain.parse(written)) == read


def test_an_unknown_implementation_is_checked_by_the_standard():
    found = check_pair("dds", {}, {"durability": "transient_local"}, {"implementation": "our own dds"})
    standard = check_pair("dds", {}, {"durability": "transient_local"}, {"implementation": "standard"})
    assert [each.code for each in found.findings if each.code not in {other.code for other in standard.findings}] == [
        "CQ208"
    ]
    assert (found.policies, found.verdict) == (standard.policies, standard.verdict)


def test_a_choice_without_camel_case_has_no_synonyms():
    assert choice("X", "one", "two").synonyms == {}
