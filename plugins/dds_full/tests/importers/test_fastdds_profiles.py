"""XML profiles of Fast DDS as programs of DDS use them: QoS of writers and readers by name."""

import pytest

import cqos_core as cqos
from tests.explained_values import profile_values

OPTION = {"dds": {"implementation": "fastdds_3_6"}}


def profiles(*parts, namespace="http://www.eprosima.com"):
    return f'<dds xmlns="{namespace}"><profiles>{"".join(parts)}</profiles></dds>'


def writer(name, qos="", topic="", tag="data_writer", more=""):
    return f'<{tag} profile_name="{name}" {more}><topic>{topic}</topic><qos>{qos}</qos></{tag}>'


def reader(name, qos="", topic="", tag="data_reader"):
    return writer(name, qos, topic, tag)


def reads(text):
    return cqos.read(text.encode(), importer="fastdds_xml")


def values(text, profile="w", role="publishes"):
    """What an endpoint of a system file gets from a profile, by policy, where it is no default."""
    return profile_values(profile, text.encode(), role=role)


def problems(text):
    with pytest.raises(cqos.InputError) as refused:
        reads(text)
    return [str(problem) for problem in refused.value.problems]


def test_every_policy_that_profiles_have():
    qos = (
        "<reliability><kind>RELIABLE</kind><max_blocking_time><sec>1</sec></max_blocking_time></reliability>"
        "<durability><kind>TRANSIENT_LOCAL_DURABILITY_QOS</kind></durability>"
        "<deadline><period><sec>2</sec><nanosec>5</nanosec></period></deadline>"
        "<latencyBudget><duration><sec>DURATION_INFINITY</sec></duration></latencyBudget>"
        "<liveliness><kind>MANUAL_BY_TOPIC</kind><lease_duration>DURATION_INFINITY</lease_duration>"
        "<announcement_period><sec>1</sec></announcement_period></liveliness>"
        "<ownership><kind>EXCLUSIVE</kind></ownership><ownershipStrength><value>7</value></ownershipStrength>"
        "<lifespan><duration><sec>9</sec></duration></lifespan><destinationOrder><kind>BY_RECEPTION_TIMESTAMP</kind></destinationOrder>"
        "<partition><names><name>a</name><name>b*</name></names></partition><userData><value>de.ad.be.ef</value></userData>"
        "<durabilityService><history_depth>4</history_depth><max_samples>0</max_samples></durabilityService>"
    )
    topic = (
        "<historyQos><kind>KEEP_ALL</kind><depth>3</depth></historyQos><resourceLimitsQos><max_samples>0</max_samples>"
        "<max_instances>5</max_instances></resourceLimitsQos>"
    )
    assert values(profiles(writer("w", qos, topic))) == {
        "reliability": "reliable",
        "reliability.max_blocking_time": "1s",
        "durability": "transient_local",
        "deadline": "2000000005ns",
        "latency_budget": "infinite",
        "liveliness": "manual_by_topic",
        "liveliness.lease_duration": "infinite",
        "ownership": "exclusive",
        "destination_order": "by_reception_timestamp",
        "partition": '[a, "b*"]',
        "history": "keep_all",
        "history.depth": "3",
        "resource_limits.max_samples": "unlimited",
        "resource_limits.max_instances": "5",
        "durability_service.history_depth": "4",
        "durability_service.max_samples": "unlimited",
        "lifespan": "9s",
        "ownership_strength": "7",
        "user_data": "0xdeadbeef",
        "liveliness.announcement_period": "1s",
    }


def test_spellings_of_older_versions():
    text = (
        '<profiles><publisher profile_name="w"><qos><latency_budget><duration><sec>1</sec></duration></latency_budget>'
        "<destination_order><kind>BY_RECEPTION_TIMESTAMP_DESTINATIONORDER_QOS</kind></destination_order></qos></publisher>"
        '<subscriber profile_name="r"><qos><reliability><kind>RELIABLE_RELIABILITY_QOS</kind></reliability></qos></subscriber></profiles>'
    )
    assert values(text) == {"latency_budget": "1s", "destination_order": "by_reception_timestamp"}
    assert values(text, "r", "subscribes") == {"reliability": "reliable"}


def test_writer_and_reader_profiles_of_one_name_are_tried_together():
    report = cqos.check(
        profiles(
            writer("/scan", "<reliability><kind>BEST_EFFORT</kind></reliability>"),
            reader("/scan", "<reliability><kind>RELIABLE</kind></reliability>"),
            writer("alone"),
        ).encode(),
        options=OPTION,
    )
    assert [(finding.code, finding.endpoints) for finding in report.findings if finding.severity == "warning"] == [
        ("DDS101", ("/scan/subscriber", "/scan/publisher"))
    ]


def test_what_is_left_open_has_the_defaults_of_fast_dds():
    report = cqos.check(
        profiles(writer("w"), reader("w", "<durability><kind>TRANSIENT_LOCAL</kind></durability>")).encode()
    )
    assert "CQ404" in [finding.code for finding in report.findings], "a writer that says nothing is not tried"
    text = profiles(
        writer("w", "<ownershipStrength><value>1</value></ownershipStrength>"),
        reader("w", "<durability><kind>TRANSIENT_LOCAL</kind></durability>"),
    ).encode()
    assert "DDS102" not in [finding.code for finding in cqos.check(text).findings]
    standard = cqos.check(text, options={"dds": {"implementation": "standard"}})
    assert "DDS102" in [finding.code for finding in standard.findings]


def test_a_profile_that_names_its_topic_is_an_endpoint():
    named = "<kind>WITH_KEY</kind><name>square</name><dataType>ShapeType</dataType>"
    system = reads(profiles(writer("w", topic=named), reader("r", topic=named), writer("other")))
    assert [(end.id, end.topic, end.type, end.participant) for end in system.endpoints] == [
        ("w/publisher", "square", "ShapeType", "<bytes>"),
        ("r/subscriber", "square", "ShapeType", "<bytes>"),
    ]
    assert system.topics["square"].settings["keyed"].text == "true"
    assert not system.notes


def test_what_is_no_policy_is_listed_once():
    text = profiles(
        '<participant profile_name="p"/><transport_descriptors/>',
        writer("w", "<data_sharing/>", more='is_default_profile="true"'),
    )
    (note,) = reads(text).notes
    assert (note.code, note.message) == (
        "DDS901",
        "elements that are no policy of the standard: `participant`, `qos/data_sharing` and `transport_descriptors`",
    )


def test_problems_are_reported_at_their_places():
    text = profiles(writer("w", "\n<reliability><kind>RELIABEL</kind></reliability>"), "\n", writer("w"), writer(""))
    assert problems(text) == [
        "<bytes>:2:14: `qos/reliability/kind`: `RELIABEL` is not one of its values (expected best_effort < reliable)",
        "<bytes>:3:1: data_writer profile `w` is stated twice, first at <bytes>:1 (keep one of them)",
        "<bytes>:3:1: `data_writer` needs a `profile_name`",
    ]
    assert "no file of Fast DDS profiles" in problems("<bpmn/>")[0]


def test_a_system_file_takes_its_profiles_by_name(tmp_path):
    deadline = "<deadline><period><sec>{}</sec></period></deadline>"
    (tmp_path / "p.xml").write_text(profiles(writer("w", deadline.format(2)), reader("r", deadline.format(1))))
    (tmp_path / "s.yaml").write_text(
        "cqos: 1\nprotocol: dds\ninclude: p.xml\nparticipants:\n"
        "  a: {publishes: {t: w}}\n  b: {subscribes: {t: {profile: r}}}\n"
    )
    report = cqos.check(tmp_path / "s.yaml", options=OPTION)
    (finding,) = [each for each in report.findings if each.severity == "error"]
    assert finding.code == "DDS103"
    places = {(fact.origin, fact.place.source.rpartition("/")[2]) for side in finding.sides for fact in side.facts}
    assert places == {("profile w/data_writer", "p.xml"), ("profile r/data_reader", "p.xml")}


def test_a_variable_that_is_not_set_leaves_its_policy_unknown():
    text = profiles(writer("W", "<reliability><kind>${KIND}</kind></reliability>"))
    assert values(text, "W") == {"reliability": "unknown (variable `KIND` is not set)"}


def test_a_misspelt_policy_is_a_warning_and_unknown():
    text = profiles(writer("W", "<reliabilty><kind>RELIABLE</kind></reliabilty><latencybudgt/>"))
    assert [(note.code, note.severity) for note in reads(text).notes] == [("DDS902", "warning")] * 2
    assert set(values(text, "W").values()) == {"unknown"}


def test_transport_priority_is_read():
    text = profiles(writer("W", "<transport_priority><value>5</value></transport_priority>"))
    assert values(text, "W") == {"transport_priority": "5"}
    assert reads(text).notes == []


def test_positive_acks_are_read():
    text = profiles(
        reader(
            "r", "<disablePositiveAcks><enabled>true</enabled><duration><sec>1</sec></duration></disablePositiveAcks>"
        )
    )
    assert values(text, "r", "subscribes") == {"disable_positive_acks": "true"}


def test_the_kind_of_a_topic_is_that_of_each_end():
    named = "<kind>{}</kind><name>t</name><dataType>T</dataType>"
    system = profiles(writer("w", topic=named.format("WITH_KEY")), reader("r", topic=named.format("NO_KEY")))
    report = cqos.check(system.encode(), options=OPTION)
    assert [(each.code, str(each.severity)) for each in report.findings if each.severity != "note"] == [
        ("DDS406", "error")
    ]
    alike = profiles(writer("w", topic=named.format("NO_KEY")), reader("r", topic=named.format("NO_KEY")))
    assert not [each for each in cqos.check(alike.encode(), options=OPTION).findings if each.code == "DDS406"]


def test_a_kind_that_fast_dds_refuses_is_an_error():
    (said,) = problems(profiles(writer("w", topic="<kind>WITH_KEX</kind><name>t</name>")))
    assert "`topic/kind`: `WITH_KEX` is not one of its values" in said


@pytest.mark.parametrize(
    ("qos", "beside", "named"),
    [
        ("<no_schema_has_this/>", "", "`qos/no_schema_has_this`"),
        (
            "",
            "<propertiesPolicy><properties><property><name>x</name></property></properties></propertiesPolicy>",
            "/x`",
        ),
        ("<reliability><later>1</later></reliability>", "", "`qos/reliability/later`"),
        (
            "",
            "<matchedSubscribersAllocation><initial>1</initial><maximum>1</maximum></matchedSubscribersAllocation>",
            "`matchedSubscribersAllocation/maximum`",
        ),
    ],
)
def test_an_element_that_may_decide_leaves_the_pair_unknown(qos, beside, named):
    text = profiles(writer("w", qos).replace("</data_writer>", f"{beside}</data_writer>"))
    found = values(text)["extensions"]
    assert found.startswith("unknown")
    assert named in found


def test_an_element_that_changes_no_match_is_listed_only():
    beside = "<times/><historyMemoryPolicy>DYNAMIC</historyMemoryPolicy><unicastLocatorList/>"
    beside += "<matchedSubscribersAllocation><initial>1</initial><maximum>0</maximum></matchedSubscribersAllocation>"
    qos = "<publishMode><kind>ASYNCHRONOUS</kind></publishMode><data_sharing><kind>OFF</kind></data_sharing>"
    text = profiles(writer("w", qos).replace("</data_writer>", f"{beside}</data_writer>"))
    assert [note.code for note in reads(text).notes] == ["DDS901"]
    assert not values(text)


def test_what_participants_leave_open_counts_beside_what_may_lose_samples(tmp_path):
    filters = (
        "<discovery_config><ignoreParticipantFlags>FILTER_SAME_PROCESS</ignoreParticipantFlags></discovery_config>"
    )
    participant = f"<participant profile_name='p' is_default_profile='true'><rtps><builtin>{filters}</builtin></rtps></participant>"
    (tmp_path / "f.xml").write_text(f"<profiles>{participant}</profiles>", encoding="utf-8")
    ends = "{a: {publishes: {T: {extensions: %s}}}, b: {subscribes: {T: {extensions: %s}}}}"
    for stated, expected in (("may_lose", "unknown"), ("none", "compatible as far as read")):
        system = f"cqos: 1\nprotocol: dds\nparticipants: {ends % (stated, stated)}\noptions: {{dds: {{implementation: fastdds}}}}\n"
        (tmp_path / "s.yaml").write_text(system, encoding="utf-8")
        assert cqos.check(tmp_path / "s.yaml", tmp_path / "f.xml").verdict_words == expected
