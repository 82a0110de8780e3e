"""DDS-XML of the OMG, RTI Connext, OpenDDS and Cyclone DDS: profiles, inheritance, spellings, whole systems."""

import pytest
from click.testing import CliRunner

import cqos_core as cqos
from cqos_core.cli.app import cli
from tests.explained_values import facts, profile_values


def dds(*parts, attributes=""):
    return f"<dds {attributes}>{''.join(parts)}</dds>"


def library(name, *parts):
    return f'<qos_library name="{name}">{"".join(parts)}</qos_library>'


def profile(name, *parts, more=""):
    return f'<qos_profile name="{name}" {more}>{"".join(parts)}</qos_profile>'


def writer(*parts, more=""):
    return f"<datawriter_qos {more}>{''.join(parts)}</datawriter_qos>"


def reader(*parts, more=""):
    return f"<datareader_qos {more}>{''.join(parts)}</datareader_qos>"


def reliability(kind):
    return f"<reliability><kind>{kind}_RELIABILITY_QOS</kind></reliability>"


def depth(number):
    return f"<history><depth>{number}</depth></history>"


def deadline(text):
    return f"<deadline><period>{text}</period></deadline>"


BEST_EFFORT, RELIABLE = reliability("BEST_EFFORT"), reliability("RELIABLE")


def reads(*texts):
    return cqos.read(*(text.encode() for text in texts))


def used(system, profile, role="publishes", topic="t"):
    """The values that an endpoint of a system file gets from a profile, by policy, where they are not the defaults."""
    return profile_values(profile, system, role=role, topic=topic)


def problems(text):
    with pytest.raises(cqos.InputError) as refused:
        cqos.read(text.encode(), importer="dds_xml")
    return [f"{problem.code} {problem}" for problem in refused.value.problems]


def said(report, *codes):
    return [(each.code, each.message) for each in report.findings if not codes or each.code in codes]


class TestInheritance:
    def test_a_child_overrides_only_what_it_states_field_by_field(self):
        base = "<history><kind>KEEP_ALL_HISTORY_QOS</kind><depth>9</depth></history>"
        system = reads(
            dds(
                library("L", profile("A", writer(base, RELIABLE)), profile("B", writer(depth(3)), more='base_name="A"'))
            )
        )
        assert used(system, "L::B") == {"reliability": "reliable", "history": "keep_all", "history.depth": "3"}
        assert used(system, "L::A")["history.depth"] == "9"

    def test_a_base_may_come_later_stand_in_another_library_or_in_another_file(self):
        child = dds(library("L", profile("B", reader(depth(3)), more='base_name="M::A"')))
        parent = dds(library("M", profile("A", reader(RELIABLE), writer(BEST_EFFORT))))
        for system in reads(child, parent), reads(parent, child), reads(dds(child[6:-6], parent[6:-6])):
            assert used(system, "L::B", "subscribes") == {"reliability": "reliable", "history.depth": "3"}
            assert used(system, "L::B") == {"reliability": "best_effort"}

    def test_of_several_bases_the_later_one_wins_and_the_child_over_all(self):
        listing = "<base_name><element>A</element><element>L::B</element></base_name>"
        profiles = (
            profile("A", writer(RELIABLE, depth(1))),
            profile("B", writer(depth(2), deadline("<sec>1</sec>"))),
            profile("C", listing, writer(deadline("<sec>2</sec>"))),
            profile("D", listing.replace("A<", "B<").replace("L::B", "A"), more='base_name="C"'),
        )
        system = reads(dds(library("L", *profiles)))
        assert used(system, "L::C") == {"reliability": "reliable", "history.depth": "2", "deadline": "2s"}
        assert used(system, "L::D") == {"reliability": "reliable", "history.depth": "1", "deadline": "1s"}

    def test_a_single_qos_inherits_its_own_part_of_its_own_bases(self):
        group = "<publisher_qos><partition><name><element>x</element></name></partition></publisher_qos>"
        other = profile("Other", writer(RELIABLE), reader(depth(7)), group)
        system = reads(
            dds(
                library(
                    "L",
                    other,
                    profile("P", writer(depth(2), more='base_name="L::Other"'), reader(deadline("<sec>1</sec>"))),
                    profile("Q", writer("<base_name><element>Other</element></base_name>")),
                )
            )
        )
        assert used(system, "L::P") == {"reliability": "reliable", "history.depth": "2"}
        assert used(system, "L::P", "subscribes") == {"deadline": "1s"}
        assert used(system, "L::Q") == {"reliability": "reliable"}
        assert used(system, "L::Other") == {"reliability": "reliable", "partition": "[x]"}

    def test_qos_with_a_name_of_its_own_can_be_used_and_based_on(self):
        single = writer(RELIABLE, more='name="W"')
        within = profile(
            "P", writer(depth(4), more='name="mine"'), writer(depth(5), more='name="yours" base_name="L::W"')
        )
        system = reads(dds(library("L", single, within)))
        assert used(system, "L::W") == {"reliability": "reliable"}
        assert used(system, "L::P") == {"history.depth": "4"}
        assert used(system, "L::P::yours") == {"reliability": "reliable", "history.depth": "5"}

    def test_filters_choose_by_topic_in_order_and_then_what_has_none(self):
        parts = (
            writer(depth(1)),
            writer(depth(2), more='topic_filter="A*"'),
            writer(depth(3), more='topic_filter="AB*"'),
            writer(depth(4), more='topic_filter="B"'),
        )
        child = profile("Child", writer(RELIABLE, more='topic_filter="A*"'), more='base_name="P"')
        system = reads(dds(library("L", profile("P", *parts), child)))
        chosen = {topic: used(system, "L::P", topic=topic)["history.depth"] for topic in ("A", "ABC", "B", "BC", "x")}
        assert chosen == {"A": "2", "ABC": "2", "B": "4", "BC": "1", "x": "1"}
        assert used(system, "L::Child", topic="A1") == {"reliability": "reliable", "history.depth": "2"}
        assert used(system, "L::Child", topic="B") == {"history.depth": "4"}

    def test_a_circle_is_printed_as_a_path_with_its_place(self):
        text = dds(
            library(
                "L", profile("A", more='base_name="B"'), "\n", profile("B", writer(RELIABLE), more='base_name="M::C"')
            )
        ).replace("</dds>", library("M", profile("C", more='base_name="L::A"')) + "</dds>")
        report = cqos.check(text.encode())
        (finding,) = [each for each in report.findings if each.code == "CQ212"]
        assert finding.message == "profiles are based on each other in a circle: L::A → L::B → M::C → L::A"
        assert (finding.place.line, finding.place.column) == (1, 29)

    def test_a_circle_that_sets_nothing_is_one_too(self):
        text = dds(library("L", profile("A", more='base_name="B"'), "\n", profile("B", more='base_name="A"')))
        report = cqos.check(text.encode())
        (finding,) = [each for each in report.findings if each.code == "CQ212"]
        assert finding.message == "profiles are based on each other in a circle: L::A → L::B → L::A"
        assert (finding.place.line, finding.place.column) == (1, 29)

    def test_a_circle_over_files(self):
        one = dds(library("L", profile("A", writer(RELIABLE), more='base_name="M::B"')))
        other = dds(library("M", profile("B", more='base_name="L::A"')))
        report = cqos.check(one.encode(), other.encode())
        assert said(report, "CQ212") == [
            ("CQ212", "profiles are based on each other in a circle: L::A → M::B → L::A"),
        ]

    def test_an_unknown_base_is_named_with_its_place_and_what_may_be_meant(self):
        text = dds(
            "\n",
            library(
                "Common",
                profile("Reliable", writer(RELIABLE)),
                "\n",
                profile("B", writer(), more='base_name="Relaible"'),
            ),
        )
        report = cqos.check(text.encode())
        (finding,) = [each for each in report.findings if each.code == "CQ204"]
        assert finding.message == "profile `Common::Relaible` is neither defined nor a preset of DDS"
        assert finding.help.startswith("did you mean `Common::Reliable`?")
        assert (finding.place.line, finding.place.column) == (3, 1)

    def test_what_is_built_into_an_implementation_is_known_by_what_its_name_says(self):
        strict = profile("A", more='base_name="BuiltinQosLibExp::Generic.StrictReliable"')
        listing = "<base_name><element>BuiltinQosSnippetLib::QosPolicy.Durability.TransientLocal</element></base_name>"
        unknown = profile("C", more='base_name="BuiltinQosLib::Pattern.Event"')
        system = reads(dds(library("L", strict, profile("B", listing, more='base_name="A"'), unknown)))
        expected = {"reliability": "reliable", "history": "keep_all", "durability": "transient_local"}
        for role in "publishes", "subscribes":
            assert used(system, "L::B", role) == expected
        assert set(used(system, "L::C").values()) == {"unknown"}
        assert {"reliability", "durability", "presentation.access_scope"} <= used(system, "L::C").keys()
        (note,) = system.notes
        assert (note.code, note.severity) == ("DDS904", "warning")
        assert "`BuiltinQosLib::Pattern.Event` is built into RTI Connext" in note.message

    def test_what_is_built_in_for_participants_transports_and_tools_says_nothing_of_writers_and_readers(self):
        bases = ("BuiltinQosSnippetLib::Feature.Monitoring2.Enable", "BuiltinQosLib::Generic.Participant.LargeData")
        listing = "".join(f"<element>{base}</element>" for base in bases)
        system = reads(dds(library("L", profile("A", f"<base_name>{listing}</base_name>", writer(depth(2))))))
        assert (used(system, "L::A", "publishes"), system.notes) == ({"history.depth": "2"}, [])

    @pytest.mark.parametrize(
        "base",
        [
            "BuiltinQosLib::Pattern.Status",
            "BuiltinQosLib::Pattern.RPC",
            "BuiltinQosLib::Pattern.ReliableStreaming",
            "BuiltinQosLib::Generic.Monitoring2",
            "BuiltinQosLib::Generic.Security",
            "BuiltinQosSnippetLib::Optimization.ReliabilityProtocol.KeepLast",
            "BuiltinQosLib::Generic.KeepLastReliable.LargeData.DynamicMemAlloc",
            "Elsewhere::Base",
            "$(LIBRARY)::Base",
        ],
    )
    def test_under_a_base_that_is_not_known_nothing_has_a_default(self, base):
        stated = writer(deadline("<sec>2</sec>")), reader(deadline("<sec>1</sec>"))
        own = profile("A", *stated, more=f'base_name="{base}"')
        text = dds(library("L", own))
        report = cqos.check(text.encode())
        assert [each.code for each in report.findings if each.code.startswith("DDS1")] == ["DDS103"]
        values = used(reads(text), "L::A")
        assert values.pop("deadline") == "2s"
        assert {"reliability", "durability", "partition", "history"} <= values.keys()
        assert all(value.startswith("unknown") for value in values.values())

    def test_a_part_of_its_own_leaves_other_parts_known(self):
        group = "<publisher_qos><partition><name><element>x</element></name></partition></publisher_qos>"
        own = writer(depth(2), more='base_name="BuiltinQosLib::Pattern.Status"')
        values = used(reads(dds(library("L", profile("A", group, own)))), "L::A")
        assert (values["partition"], values["history.depth"]) == ("[x]", "2")
        assert values["reliability"].startswith("unknown")

    def test_a_profile_outside_of_libraries(self):
        system = reads(dds(profile("Test", writer(depth(2))), attributes='xmlns="http://www.omg.org/dds"'))
        assert used(system, "Test") == {"history.depth": "2"}


class TestVariables:
    LIBRARY = dds(
        library(
            "L",
            profile(
                "P",
                writer("<reliability><kind>$(KIND)</kind></reliability>", deadline("<sec>${SECONDS}</sec>"), depth(2)),
                reader(RELIABLE),
            ),
        )
    )

    def test_a_variable_that_is_not_set_leaves_its_policy_unknown(self):
        values = used(reads(self.LIBRARY), "L::P")
        assert values["reliability"] == "unknown (variable `KIND` is not set)"
        assert values["deadline"] == "unknown (variable `SECONDS` is not set)"
        assert values["history.depth"] == "2"
        report = cqos.check(self.LIBRARY.encode())
        assert sorted(message for _, message in said(report, "CQ217")) == [
            "publisher `L::P/publisher`: `deadline` is not known: variable `SECONDS` is not set",
            "publisher `L::P/publisher`: `reliability` is not known: variable `KIND` is not set",
        ]

    def test_a_variable_that_is_set_is_read_as_its_value(self, tmp_path):
        file = tmp_path / "p.xml"
        file.write_text(self.LIBRARY)
        defined = ("--define", "KIND=BEST_EFFORT_RELIABILITY_QOS", "--define", "SECONDS=3")
        run = CliRunner().invoke(cli, ["check", str(file), *defined, "--format", "concise"])
        assert "DDS101" in run.stdout
        assert "CQ217" not in run.stdout
        wrong = CliRunner().invoke(cli, ["check", str(file), "--define", "KIND=SOMETIMES"])
        assert wrong.exit_code == 2
        assert "SOMETIMES" in wrong.output

    def test_domains_and_topics(self):
        system = SYSTEM.replace('domain_id="7"', 'domain_id="$(DOMAIN)"').replace("al*", "$(PART)")
        report = cqos.check(system.encode())
        assert report.verdict == "unknown"
        assert "CQ217" in {finding.code for finding in report.findings}


class TestTypingErrors:
    def test_what_a_misspelt_policy_may_set_is_unknown(self):
        values = used(reads(dds(library("L", profile("P", writer("<reliabilty><kind>x</kind></reliabilty>"))))), "L::P")
        assert {name for name, value in values.items() if value.startswith("unknown")} == {
            "reliability",
            "reliability.max_blocking_time",
        }

    def test_what_a_misspelt_entity_may_set_is_unknown(self):
        system = reads(dds(library("L", profile("P", "<datawriter_qs/>", reader(RELIABLE)))))
        assert [note.code for note in system.notes] == ["DDS902"]
        assert used(system, "L::P")["reliability"].startswith("unknown")
        assert used(system, "L::P", "subscribes") == {"reliability": "reliable"}

    @pytest.mark.parametrize(
        "extension",
        [
            reader("<reader_data_lifecycle><autopurge_disposed_instances_delay/></reader_data_lifecycle>"),
            writer("<writer_data_lifecycle><autopurge_disposed_instances_delay/></writer_data_lifecycle>"),
            "<domain_participant_qos><resource_limits><max_samples/></resource_limits></domain_participant_qos>",
        ],
    )
    def test_what_rti_has_beside_the_standard_is_passed_over(self, extension):
        assert {note.code for note in reads(dds(library("L", profile("P", extension)))).notes} <= {"DDS901"}


def extensions(system, profile, role="publishes"):
    return used(system, profile, role).get("extensions")


class TestWhatIsNotModelled:
    def test_compression_is_read(self):
        inner = "<representation><compression_settings><compression_ids>{}</compression_ids></compression_settings></representation>"
        system = reads(dds(library("L", profile("P", writer(inner.format("LZ4")), reader(inner.format("ZLIB|BZIP2"))))))
        assert used(system, "L::P") == {"compression_ids": "[lz4]"}
        assert used(system, "L::P", "subscribes") == {"compression_ids": "[zlib, bzip2]"}
        assert (
            "`GZIP` is no compression algorithm"
            in problems(dds(library("L", profile("P", writer(inner.format("GZIP"))))))[0]
        )

    @pytest.mark.parametrize(
        ("element", "named"),
        [
            ("<multi_channel><channels/></multi_channel>", "multi_channel"),
            ("<batch><enable>true</enable><max_samples>5</max_samples></batch>", "batch/enable"),
            ("<no_schema_has_this/>", "no_schema_has_this"),
            (
                "<protocol><disable_positive_acks>true</disable_positive_acks></protocol>",
                "protocol/disable_positive_acks",
            ),
            (
                "<reliability><acknowledgment_kind>APPLICATION_AUTO</acknowledgment_kind></reliability>",
                "reliability/acknowledgment_kind",
            ),
            ("<durability><writer_depth>5</writer_depth></durability>", "durability/writer_depth"),
            ("<property><value><element><name>a.b</name><value>1</value></element></value></property>", "property"),
        ],
    )
    def test_an_element_that_may_decide_leaves_the_pair_unknown(self, element, named):
        system = reads(dds(library("L", profile("P", writer(element)))))
        found = extensions(system, "L::P")
        assert found.startswith("unknown")
        assert named in found
        assert extensions(system, "L::P", "subscribes") is None

    @pytest.mark.parametrize(
        "element",
        [
            "<publish_mode><kind>ASYNCHRONOUS_PUBLISH_MODE_QOS</kind><flow_controller_name>DEFAULT_FLOW_CONTROLLER_NAME</flow_controller_name></publish_mode>",
            "<protocol><rtps_reliable_writer><heartbeat_period><sec>1</sec></heartbeat_period></rtps_reliable_writer></protocol>",
            "<protocol><disable_positive_acks>false</disable_positive_acks><push_on_write>true</push_on_write></protocol>",
            "<publication_name><name>w</name><role_name>r</role_name></publication_name>",
            "<resource_limits><initial_samples>5</initial_samples></resource_limits>",
            "<writer_resource_limits><max_remote_reader_filters>9</max_remote_reader_filters></writer_resource_limits>",
            "<batch><enable>false</enable></batch>",
            "<reliability><acknowledgment_kind>DDS_PROTOCOL_ACKNOWLEDGMENT_MODE</acknowledgment_kind></reliability>",
            "<unicast><value/></unicast>",
            "<service><kind>NO_SERVICE_QOS</kind></service>",
        ],
    )
    def test_an_element_that_changes_no_match_is_listed_only(self, element):
        system = reads(dds(library("L", profile("P", writer(element)))))
        assert extensions(system, "L::P") is None
        assert [note.code for note in system.notes] == ["DDS901"]

    def test_all_elements_of_a_profile_are_named(self):
        found = extensions(reads(dds(library("L", profile("P", writer("<a_1/><b_2/>"))))), "L::P")
        assert "`a_1` and `b_2`" in found

    def test_a_system_file_may_state_that_they_decide_nothing(self):
        text = dds(library("L", profile("P", writer("<multi_channel/>"), reader(BEST_EFFORT))))
        design = (
            "cqos: 1\nprotocol: dds\nparticipants:\n  a: {{publishes: {{t: {{profile: 'L::P'{}}}}}}}\n"
            "  b: {{subscribes: {{t: 'L::P'}}}}\n"
        )
        for more, verdict in (("", "unknown"), (", extensions: none", "compatible")):
            assert cqos.check(design.format(more).encode(), text.encode()).verdict == verdict

    def test_qos_of_topics_decides_no_pair(self):
        parts = "<topic_qos><no_schema_has_this/></topic_qos>"
        assert extensions(reads(dds(library("L", profile("P", writer(RELIABLE), parts)))), "L::P") is None

    @pytest.mark.parametrize(
        ("qos", "unknown", "parts"),
        [
            ("<no_schema_has_this/>", True, ["no_schema_has_this"]),
            ("<property><value><element><name>a.b</name></element></value></property>", True, ["property/value/a.b"]),
            (
                "<discovery><initial_peers><element>a</element></initial_peers></discovery>",
                False,
                ["discovery/initial_peers"],
            ),
            (
                "<discovery_config><builtin_discovery_plugins>SDP</builtin_discovery_plugins></discovery_config>",
                False,
                [],
            ),
            ("<event><thread><priority>1</priority></thread></event>", False, []),
            ("<discovery_config/><property/>", False, []),
            ("<transport_builtin><mask>UDPv4 | SHMEM</mask></transport_builtin>", False, []),
            (
                "<transport_builtin><mask>UDPv4_WAN</mask></transport_builtin>",
                False,
                ["transport_builtin/mask"],
            ),
            ("<resource_limits><max_gather_destinations>16</max_gather_destinations></resource_limits>", False, []),
            (
                (
                    "<property><value><element><name>dds.transport.UDPv4.builtin.recv_socket_buffer_size</name>"
                    "<value>1</value></element><element><name>rti.monitor.library</name></element></value></property>"
                ),
                False,
                [],
            ),
        ],
    )
    def test_qos_of_participants_that_may_keep_them_apart_is_named(self, qos, unknown, parts):
        inner = f"<participant_qos>{qos}</participant_qos>"
        system = reads(dds(library("L", profile("P", writer(RELIABLE), inner))))
        assert (extensions(system, "L::P") is not None) is unknown
        assert [part.name for note in system.notes for part in note.parts] == parts

    @pytest.mark.parametrize(
        "element",
        [
            "<publish_mode><flow_controller_name>slow</flow_controller_name></publish_mode>",
            "<protocol><rtps_reliable_writer><max_heartbeat_retries>10</max_heartbeat_retries></rtps_reliable_writer></protocol>",
            "<history><refilter>ALL_REFILTER</refilter></history>",
        ],
    )
    def test_an_element_that_may_lose_samples_leaves_guarantees_open(self, element):
        assert extensions(reads(dds(library("L", profile("P", writer(element))))), "L::P") == "may_lose"


class TestValues:
    @pytest.mark.parametrize(
        ("text", "expected"),
        [
            ("<sec>2</sec><nanosec>500000000</nanosec>", "2500ms"),
            ("<sec>2</sec>", "2s"),
            ("<nanosec>7</nanosec>", "7ns"),
            ("<sec> 1 </sec>\n<nanosec>0</nanosec>", "1s"),
            ("<sec>DURATION_INFINITE_SEC</sec><nanosec>DURATION_INFINITE_NSEC</nanosec>", "infinite"),
            ("<sec>DDS_DURATION_INFINITE_SEC</sec><nanosec>0</nanosec>", "infinite"),
            ("<sec>DURATION_INFINITY</sec>", "infinite"),
            ("<nanosec>DURATION_INFINITE_NSEC</nanosec>", "infinite"),
            ("DURATION_INFINITY", "infinite"),
            ("DURATION_INFINITE", "infinite"),
            ("<sec>2147483647</sec><nanosec>2147483647</nanosec>", "infinite"),
            ("<sec>2147483647</sec><nanosec>4294967295</nanosec>", "infinite"),
            ("<sec>DURATION_ZERO_SEC</sec><nanosec>DURATION_ZERO_NSEC</nanosec>", "0s"),
            ("<sec>DURATION_ZERO_SEC</sec><nanosec>10000000</nanosec>", "10ms"),
        ],
    )
    def test_durations(self, text, expected):
        assert used(reads(dds(library("L", profile("P", writer(deadline(text)))))), "L::P") == {"deadline": expected}

    def test_a_duration_without_fields_below_its_policy(self):
        system = reads(dds(library("L", profile("P", writer("<lifespan><sec>3</sec></lifespan>")))))
        assert used(system, "L::P") == {"lifespan": "3s"}

    def test_what_an_implementation_is_to_choose_is_left_open(self):
        system = reads(dds(library("L", profile("P", writer(deadline("<sec>DURATION_AUTO_SEC</sec>"))))))
        assert used(system, "L::P") == {}
        assert system.notes[0].code == "DDS901"

    @pytest.mark.parametrize(
        ("text", "expected"),
        [
            ("1,0x2F, 255", "0x012fff"),
            ("65", "0x41"),
            ("0x0a", "0x0a"),
            ("AQIDBA==", "0x01020304"),
            ("de.ad.be.ef", "0xdeadbeef"),
            ("1234", "0xd76df8"),
            ("", ""),
            (" AQ\nID ", "0x010203"),
        ],
    )
    def test_bytes_in_all_notations(self, text, expected):
        system = reads(dds(library("L", profile("P", writer(f"<user_data><value>{text}</value></user_data>")))))
        assert used(system, "L::P").get("user_data", "") == expected

    def test_every_policy_of_the_standard(self):
        limits = "<max_samples>LENGTH_UNLIMITED</max_samples><max_instances>-1</max_instances><max_samples_per_instance>7</max_samples_per_instance>"
        both = (
            "<durability><kind>PERSISTENT_DURABILITY_QOS</kind></durability><ownership><kind>DDS_EXCLUSIVE_OWNERSHIP_QOS</kind></ownership>"
            "<latency_budget><duration><sec>1</sec></duration></latency_budget>"
            "<liveliness><kind>MANUAL_BY_TOPIC_LIVELINESS_QOS</kind><lease_duration><sec>4</sec></lease_duration></liveliness>"
            "<destination_order><kind>BY_SOURCE_TIMESTAMP_DESTINATIONORDER_QOS</kind></destination_order>"
            "<representation><value><element>XCDR2_DATA_REPRESENTATION</element><element>XCDR_DATA_REPRESENTATION</element></value></representation>"
            f"<resource_limits>{limits}</resource_limits><user_data><value>1,2</value></user_data>"
        )
        own = (
            "<ownership_strength><value>-5</value></ownership_strength><transport_priority><value>3</value></transport_priority>"
            "<lifespan><duration><sec>9</sec></duration></lifespan>"
            "<writer_data_lifecycle><autodispose_unregistered_instances>0</autodispose_unregistered_instances></writer_data_lifecycle>"
            "<durability_service><service_cleanup_delay><sec>1</sec></service_cleanup_delay><history_kind>KEEP_ALL_HISTORY_QOS</history_kind>"
            "<history_depth>2</history_depth><max_samples>3</max_samples></durability_service>"
            "<reliability><kind>RELIABLE_RELIABILITY_QOS</kind><max_blocking_time><sec>2</sec></max_blocking_time></reliability>"
        )
        theirs = (
            "<time_based_filter><minimum_separation><nanosec>5</nanosec></minimum_separation></time_based_filter>"
            "<type_consistency><kind>DISALLOW_TYPE_COERCION</kind><prevent_type_widening>true</prevent_type_widening></type_consistency>"
            "<reader_data_lifecycle><autopurge_nowriter_samples_delay><sec>1</sec></autopurge_nowriter_samples_delay></reader_data_lifecycle>"
        )
        group = (
            "<presentation><access_scope>GROUP_PRESENTATION_QOS</access_scope><coherent_access>true</coherent_access></presentation>"
            "<partition><name><element>a</element><element>b*</element></name></partition><group_data><value>AQI=</value></group_data>"
            "<entity_factory><autoenable_created_entities>false</autoenable_created_entities></entity_factory>"
        )
        text = dds(
            library(
                "L",
                profile("P", writer(both, own), reader(both, theirs), f"<publisher_qos>{group}</publisher_qos>"),
            )
        )
        system = reads(text)
        assert system.notes == []
        common = {
            "durability": "persistent",
            "ownership": "exclusive",
            "latency_budget": "1s",
            "liveliness": "manual_by_topic",
            "liveliness.lease_duration": "4s",
            "destination_order": "by_source_timestamp",
            "data_representation": "[xcdr2, xcdr1]",
            "resource_limits.max_samples": "unlimited",
            "resource_limits.max_instances": "unlimited",
            "resource_limits.max_samples_per_instance": "7",
            "user_data": "0x0102",
        }
        assert used(system, "L::P") == common | {
            "ownership_strength": "-5",
            "transport_priority": "3",
            "lifespan": "9s",
            "writer_data_lifecycle": "false",
            "durability_service.service_cleanup_delay": "1s",
            "durability_service.history_kind": "keep_all",
            "durability_service.history_depth": "2",
            "durability_service.max_samples": "3",
            "reliability": "reliable",
            "reliability.max_blocking_time": "2s",
            "presentation.access_scope": "group",
            "presentation.coherent_access": "true",
            "partition": '[a, "b*"]',
            "group_data": "0x0102",
            "entity_factory": "false",
        }
        assert used(system, "L::P", "subscribes") == common | {
            "time_based_filter": "5ns",
            "type_consistency": "disallow_type_coercion",
            "type_consistency.prevent_type_widening": "true",
            "reader_data_lifecycle.autopurge_nowriter_samples_delay": "1s",
        }

    @pytest.mark.parametrize(
        ("qos", "expected"),
        [
            (
                "<reliability><kind>RELIABEL</kind></reliability>",
                "`datawriter_qos/reliability/kind`: `RELIABEL` is not one of its values",
            ),
            ("<history><depth>many</depth></history>", "`datawriter_qos/history/depth`: `many` is not a whole number"),
            ("<deadline><period><sec>-1</sec></period></deadline>", "`datawriter_qos/deadline/period`: `sec` is `-1`"),
            ("<deadline><period><sec>1</sec><usec>1</usec></period></deadline>", "`usec` is no part of a duration"),
            ("<deadline><period>soon</period></deadline>", "`datawriter_qos/deadline/period`: `soon` is no duration"),
            ("<deadline><period/></deadline>", "`datawriter_qos/deadline/period`: nothing is stated"),
            ("<user_data><value>%%%</value></user_data>", "`%%%` are no bytes"),
            ("<representation><value><element>ZIP</element></value></representation>", "no data representation"),
            (
                "<writer_data_lifecycle><autodispose_unregistered_instances>maybe</autodispose_unregistered_instances></writer_data_lifecycle>",
                "maybe",
            ),
        ],
    )
    def test_values_that_are_none_are_refused_at_their_place(self, qos, expected):
        (problem,) = problems(dds("\n", library("L", "\n", profile("P", "\n", writer("\n  ", qos)))))
        assert problem.startswith("CQ011 <bytes>:5:")
        assert expected in problem
        assert "(expected " in problem

    def test_all_problems_are_reported_at_once(self):
        text = dds(
            library("L", profile("", writer(reliability("X"), depth("y"))), profile("A"), profile("A")), library("")
        )
        assert [problem[:5] for problem in problems(text)] == ["CQ010", "CQ012", "CQ010", "CQ011", "CQ011"]

    def test_other_xml_is_refused(self):
        assert problems("<bpmn/>") == [
            "CQ001 <bytes>:1:1: this is no DDS-XML: its first element is `bpmn` (expected `dds`, or one of its libraries)"
        ]


class TestNotes:
    def test_extensions_are_listed_once_for_each_file(self):
        extra = "<publish_mode><kind>X</kind></publish_mode><reliability><acknowledgment_kind>X</acknowledgment_kind></reliability>"
        text = dds(
            library(
                "L",
                profile(
                    "P", writer(extra), reader("<unicast/>"), "<participant_qos><wire_protocol/></participant_qos>"
                ),
            ),
            "<recording_service/>",
        )
        (note,) = reads(text).notes
        assert (note.code, note.severity) == ("DDS901", "note")
        assert note.message == (
            "elements that are no policy of the standard: `datareader_qos/unicast`, `datawriter_qos/publish_mode`, "
            "`datawriter_qos/reliability/acknowledgment_kind`, `participant_qos/wire_protocol` and `recording_service`"
        )

    def test_a_misspelt_policy_is_a_warning(self):
        (note,) = reads(dds(library("L", profile("P", writer("<relability><kind>X</kind></relability>"))))).notes
        assert (note.code, note.message) == ("DDS902", "`relability` is no policy; did you mean `reliability`?")

    @pytest.mark.parametrize(
        "qos",
        [
            writer("<partition/>"),
            reader("<lifespan/>"),
            writer("<time_based_filter/>"),
            "<publisher_qos><history/></publisher_qos>",
        ],
    )
    def test_a_policy_of_another_entity_is_a_warning(self, qos):
        (note,) = reads(dds(library("L", profile("P", qos)))).notes
        assert note.code == "DDS903"
        assert "is set on" in note.message

    def test_qos_of_topics_and_participants_is_read_for_what_is_wrong_with_it(self):
        assert (
            "RELIABEL"
            in problems(
                dds(
                    library(
                        "L", profile("P", "<topic_qos><reliability><kind>RELIABEL</kind></reliability></topic_qos>")
                    )
                )
            )[0]
        )


SYSTEM = """<dds xmlns="http://www.omg.org/spec/DDS-XML">
  <qos_library name="Q">
    <qos_profile name="State">
      <datawriter_qos><durability><kind>TRANSIENT_LOCAL_DURABILITY_QOS</kind></durability></datawriter_qos>
      <datareader_qos><durability><kind>TRANSIENT_LOCAL_DURABILITY_QOS</kind></durability></datareader_qos>
    </qos_profile>
    <qos_profile name="Alarm">
      <publisher_qos><partition><name><element>alarms</element></name></partition></publisher_qos>
      <subscriber_qos><partition><name><element>alarms</element></name></partition></subscriber_qos>
    </qos_profile>
  </qos_library>
  <types>
    <module name="M"><struct name="Key"><member name="id" type="int32" key="true"/></struct>
      <struct name="State" baseType="Key"><member name="v" type="int32"/></struct></module>
    <struct name="Plain"><member name="v" type="int32"/></struct>
  </types>
  <domain_library name="D">
    <domain name="Plant" domain_id="7">
      <register_type name="StateType" type_ref="M::State"/>
      <register_type name="Plain" type_ref="Plain"/>
      <topic name="state" register_type_ref="StateType"/>
      <topic name="alarm" register_type_ref="Plain"/>
    </domain>
  </domain_library>
  <domain_participant_library name="P">
    <domain_participant name="Machine" domain_ref="D::Plant">
      <publisher name="Pub">
        <data_writer name="State" topic_ref="state"><datawriter_qos base_name="Q::State"/></data_writer>
      </publisher>
      <publisher name="Alarms">
        <publisher_qos base_name="Q::Alarm"/>
        <data_writer name="Alarm" topic_ref="alarm"/>
      </publisher>
    </domain_participant>
    <domain_participant name="Desk" domain_ref="Plant">
      <data_reader name="State" topic_ref="state">
        <datareader_qos base_name="Q::State"><reliability><kind>RELIABLE_RELIABILITY_QOS</kind></reliability></datareader_qos>
      </data_reader>
      <subscriber name="Alarms">
        <subscriber_qos><partition><name><element>al*</element></name></partition></subscriber_qos>
        <data_reader name="Alarm" topic_ref="D::Plant::alarm"/>
      </subscriber>
    </domain_participant>
  </domain_participant_library>
</dds>
"""


class TestSystems:
    def test_participants_topics_types_and_domains(self):
        system = reads(SYSTEM)
        assert system.notes == []
        assert [(end.id, end.role, end.topic, end.type, end.place.line) for end in system.endpoints] == [
            ("P::Machine/Pub/State", "publisher", "state", "StateType", 28),
            ("P::Machine/Alarms/Alarm", "publisher", "alarm", "Plain", 32),
            ("P::Desk/State", "subscriber", "state", "StateType", 36),
            ("P::Desk/Alarms/Alarm", "subscriber", "alarm", "Plain", 41),
        ]
        assert {each.id: each.settings["domain"].text for each in system.participants.values()} == {
            "P::Machine": "7",
            "P::Desk": "7",
        }
        assert {name: topic.settings["keyed"].text for name, topic in system.topics.items()} == {
            "state": "true",
            "alarm": "false",
        }

    def test_they_are_checked_like_any_system(self):
        report = cqos.check(SYSTEM.encode())
        assert report.verdict == "compatible"
        assert len(list(report.pairs)) == 2
        split = cqos.check(SYSTEM.replace("al*", "other").encode())
        assert "DDS403" in [finding.code for finding in split.findings]

    def test_qos_of_a_publisher_and_of_its_writers_come_from_different_profiles(self):
        text = SYSTEM.replace(
            '<data_writer name="Alarm" topic_ref="alarm"/>',
            '<data_writer name="Alarm" topic_ref="alarm"><datawriter_qos base_name="Q::State"/></data_writer>',
        )
        system = reads(text)
        alarm, state = (facts(system, of=f"P::Machine/{each}") for each in ("Alarms/Alarm", "Pub/State"))
        assert (alarm["partition"].value, alarm["durability"].value) == ("[alarms]", "transient_local")
        assert state["partition"].value == "[]"

    def test_applications_take_participants_from_libraries_and_change_them(self):
        application = """<application_library name="A"><application name="One">
            <domain_participant name="M" base_name="P::Machine"><publisher name="Pub"><data_writer name="State">
            <datawriter_qos><history><depth>5</depth></history></datawriter_qos></data_writer></publisher></domain_participant>
            <domain_participant name="Other" base_name="P::Desk" domain_id="9"/></application></application_library></dds>"""
        system = reads(SYSTEM.replace("</dds>", application))
        assert list(system.participants) == ["A::One::M", "A::One::Other"]
        assert system.participants["A::One::Other"].settings["domain"].text == "9"
        state = facts(system, of="A::One::M/Pub/State")
        assert (state["durability"].value, state["history.depth"].value) == ("transient_local", "5")

    def test_the_default_profile_counts_where_an_entity_has_none(self):
        text = SYSTEM.replace(
            '<qos_profile name="Alarm">',
            '<qos_profile name="Alarm" is_default_qos="true"><datawriter_qos>' + BEST_EFFORT + "</datawriter_qos>",
        )
        system = reads(text)
        values = {
            each: facts(system, of=f"P::Machine/{each}")["reliability"].value for each in ("Alarms/Alarm", "Pub/State")
        }
        assert values == {"Alarms/Alarm": "best_effort", "Pub/State": "reliable"}

    @pytest.mark.parametrize(
        ("old", "new", "expected"),
        [
            (
                'topic_ref="state"',
                'topic_ref="stat"',
                "the topic of `P::Machine/Pub/State`, `stat`, is not defined in this file; did you mean `state`?",
            ),
            (
                '"D::Plant"',
                '"D::Plnt"',
                "the domain of `P::Machine`, `D::Plnt`, is not defined in this file; did you mean `D::Plant`?",
            ),
            (
                'name="Desk"',
                'name="Desk" base_name="Mashine"',
                "the base of `P::Desk`, `P::Mashine`, is not defined in this file; did you mean `P::Machine`?",
            ),
        ],
    )
    def test_a_dangling_reference_is_an_error_with_a_suggestion(self, old, new, expected):
        system = reads(SYSTEM.replace(old, new, 1))
        (note,) = [note for note in system.notes if note.code == "DDS905"]
        assert (note.severity, note.message) == ("error", expected)
        assert note.place.line > 20

    def test_a_library_in_another_file_is_unknown_and_reported_once(self):
        before, _, rest = SYSTEM.partition("<domain_library")
        participants = before + rest.partition("</domain_library>")[2]
        report = cqos.check(participants.encode())
        assert [finding.severity for finding in report.findings if finding.code == "DDS907"] == ["warning"]
        assert not [finding for finding in report.findings if finding.severity == "error"]
        assert report.verdict == "unknown"

    def test_participants_that_are_based_on_each_other(self):
        participants = "domain_participant name="
        text = SYSTEM.replace(f'{participants}"Machine"', f'{participants}"Machine" base_name="Desk"')
        text = text.replace(f'{participants}"Desk"', f'{participants}"Desk" base_name="Machine"')
        application = '<application_library name="A"><application name="B"><domain_participant name="C" base_name="P::Desk"/></application></application_library></dds>'
        system = reads(text.replace("</dds>", application))
        (note,) = system.notes
        assert (note.code, note.message) == ("DDS906", "`P::Desk` is based on itself: P::Desk → P::Machine → P::Desk")

    def test_an_endpoint_without_a_topic_is_refused(self):
        assert "needs a `topic_ref`" in problems(SYSTEM.replace(' topic_ref="alarm"', ""))[0]

    def test_a_library_alone_is_tried_out(self):
        text = dds("\n", library("L", "\n", profile("P", "\n", writer(BEST_EFFORT), "\n", reader(RELIABLE))))
        report = cqos.check(text.encode())
        (finding,) = [each for each in report.findings if each.code == "DDS101"]
        assert (report.verdict, sum(each.pairs for each in report.groups), report.hypothetical) == ("unknown", 0, 1)
        assert finding.severity == "warning"
        assert {fact.place.line for side in finding.sides for fact in side.facts} == {4, 5}

    def test_an_inconsistent_profile_is_reported_with_the_origin_of_its_values(self):
        limits = "<resource_limits><max_samples_per_instance>2</max_samples_per_instance></resource_limits>"
        text = dds(
            library(
                "L",
                "\n",
                profile("A", "\n", writer(limits)),
                "\n",
                profile("B", "\n", writer(depth(5)), more='base_name="A"'),
            )
        )
        report = cqos.check(text.encode())
        (finding,) = [each for each in report.findings if each.code == "DDS302"]
        assert finding.endpoints == ("L::B/publisher",)
        facts = {fact.policy: (fact.origin, fact.place.line) for side in finding.sides for fact in side.facts}
        assert facts["history.depth"] == ("profile L::B/datawriter_qos", 5)
        assert facts["resource_limits.max_samples_per_instance"] == ("profile L::A/datawriter_qos", 3)


# Systems that span files

TYPES = '<dds><types><struct name="Pose"><member name="id" key="true"/></struct></types></dds>'
DOMAINS = """<dds><domain_library name="Dl"><domain name="Main" domain_id="7">
  <register_type name="PoseType" type_ref="Pose"/><topic name="pose" register_type_ref="PoseType"/>
</domain></domain_library></dds>"""
BASES = """<dds><domain_participant_library name="Bases"><domain_participant name="Any" domain_ref="Dl::Main">
  <publisher name="P"><data_writer name="W" topic_ref="pose"/></publisher>
</domain_participant></domain_participant_library></dds>"""
PARTICIPANTS = """<dds><domain_participant_library name="Pl">
  <domain_participant name="A" base_name="Bases::Any"/>
  <domain_participant name="B" domain_ref="Dl::Main">
    <subscriber name="S"><data_reader name="R" topic_ref="pose"/></subscriber>
  </domain_participant>
</domain_participant_library></dds>"""


def together(folder, **files):
    for name, text in files.items():
        folder.joinpath(f"{name}.xml").parent.mkdir(exist_ok=True)
        folder.joinpath(f"{name}.xml").write_text(text)
    return cqos.read(*(folder / f"{name}.xml" for name in sorted(files)))


def test_domains_bases_and_types_come_from_the_files_beside(tmp_path):
    system = together(tmp_path, types=TYPES, domains=DOMAINS, bases=BASES, participants=PARTICIPANTS)
    assert sorted(system.participants) == ["Pl::A", "Pl::B"]
    domains = {name: each.settings["domain"] for name, each in system.participants.items()}
    assert {name: each.text for name, each in domains.items()} == {"Pl::A": "7", "Pl::B": "7"}
    assert {each.place.source.rpartition("/")[2] for each in domains.values()} == {"domains.xml"}
    assert {each.topic: each.type for each in system.endpoints} == {"pose": "PoseType"}
    assert system.topics["pose"].settings["keyed"].text == "true"
    report = cqos.check(system)
    assert (report.verdict, sum(each.pairs for each in report.groups), said(report, "DDS907")) == ("compatible", 1, [])
    assert cqos.check(tmp_path).verdict == "compatible"


def test_a_file_of_several_that_is_missing_leaves_unknown_what_it_defines(tmp_path):
    report = cqos.check(together(tmp_path, bases=BASES, participants=PARTICIPANTS))
    assert report.verdict == "unknown"
    assert [message for _, message in said(report, "DDS907")] == [
        "the domain of `Pl::A`, `Dl::Main`, is not known: the library `Dl` is in none of the files"
    ]


def test_of_two_files_that_define_a_domain_the_one_in_the_same_folder_holds(tmp_path):
    other = DOMAINS.replace('"7"', '"8"')
    files = {"one/domains": DOMAINS, "two/domains": other, "one/bases": BASES, "one/participants": PARTICIPANTS}
    system = together(tmp_path, **files)
    assert {each.settings["domain"].text for each in system.participants.values()} == {"7"}
    open_ = cqos.check(
        together(tmp_path, **{"one/domains": DOMAINS, "two/domains": other, "three/participants": BASES})
    )
    assert open_.verdict == "unknown"
    assert "2 files define it" in said(open_, "DDS907")[0][1]
