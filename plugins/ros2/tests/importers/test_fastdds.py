"""Fast DDS profiles: they decide what a node leaves to the middleware, with Fast DDS, and nothing else."""

import pytest

from cqos_core import InputError, Setting, check
from cqos_core.files.source_reader import read_source
from cqos_core.files.system_merge import merge
from cqos_core.model.source import ReadContext, Source
from cqos_ros2.importers.fastdds_profiles import read_fastdds_profiles
from cqos_ros2.importers.fastdds_xml import read
from tests.explained_values import facts

DEADLINE = "<deadline><period><sec>2</sec><nanosec>0</nanosec></period></deadline>"
BEST_EFFORT = "<reliability><kind>BEST_EFFORT</kind></reliability>"


def profiles(*elements):
    return f"<dds><profiles>{''.join(elements)}</profiles></dds>"


def writer(name, qos, more=""):
    return f'<data_writer profile_name="{name}" {more}><qos>{qos}</qos></data_writer>'


def checked(xml, publishes="/scan: default", subscribes="/scan: {deadline: 1s}", **options):
    design = (
        f"cqos: 1\nprotocol: ros2\nparticipants:\n  driver: {{publishes: {{{publishes}}}}}\n"
        f"  planner: {{subscribes: {{{subscribes}}}}}\n"
    )
    sources = (Source("d.yaml", design.encode()), Source("p.xml", xml.encode()))
    return check(merge([read_source(source, beside={"ros2"}) for source in sources]), options={"ros2": options})


def codes(report):
    return sorted(finding.code for finding in report.findings if finding.severity != "note")


def problems(xml):
    with pytest.raises(InputError) as refused:
        read(Source("p.xml", xml if isinstance(xml, bytes) else xml.encode()), ReadContext())
    return [str(problem) for problem in refused.value.problems]


class TestEffect:
    def test_a_deadline_that_no_node_states_comes_from_the_profile(self):
        report = checked(profiles(writer("/scan", DEADLINE)), rmw="fastdds")
        (finding,) = [finding for finding in report.findings if finding.code == "ROS103"]
        assert "offers deadline 2s" in finding.message
        (offered,) = [
            fact for side in finding.sides for fact in side.facts if fact.origin == "Fast DDS profile `/scan`"
        ]
        assert (offered.place.source, offered.place.line, offered.place.column) == ("p.xml", 1, 66)

    def test_without_a_middleware_both_are_possible(self):
        xml = profiles(writer("/scan", DEADLINE))
        assert checked(xml, subscribes="/scan: {deadline: 3s}").verdict == "unknown"
        report = checked(xml, subscribes="/scan: {deadline: 3s}")
        (finding,) = [finding for finding in report.findings if finding.code == "ROS103"]
        assert {world: str(verdict) for world, verdict in finding.worlds.items()} == {
            "ros2.rmw=cyclonedds": "incompatible",
            "ros2.rmw=fastdds": "compatible",
            "ros2.rmw=connext": "incompatible",
        }

    def test_with_another_middleware_it_is_without_effect(self):
        report = checked(profiles(writer("/scan", DEADLINE)), subscribes="/scan: default", rmw="cyclonedds")
        assert codes(report) == ["CQ214"]
        assert report.verdict == "compatible"

    def test_what_a_node_sets_itself_wins(self):
        report = checked(profiles(writer("/scan", BEST_EFFORT)), subscribes="/scan: default", rmw="fastdds")
        assert report.verdict == "compatible"
        (finding,) = [finding for finding in report.findings if finding.code == "CQ215"]
        assert finding.message == (
            "Fast DDS profile `/scan` sets `reliability` to best_effort, but all endpoints that it covers have their own"
        )

    @pytest.mark.parametrize(("own", "of_profile", "held"), [("10", "100", "100"), ("10", "5", "10"), ("0", "5", "5")])
    def test_a_profile_raises_the_depth_of_a_node_and_never_lowers_it(self, own, of_profile, held):
        depth = f"<topic><historyQos><depth>{of_profile}</depth></historyQos></topic>"
        xml = profiles(f'<data_writer profile_name="/scan">{depth}</data_writer>')
        design = f"cqos: 1\nprotocol: ros2\nparticipants:\n  driver: {{publishes: {{/scan: {{depth: {own}}}}}}}\n"
        sources = (Source("d.yaml", design.encode()), Source("p.xml", xml.encode()))
        system = merge([read_source(source, beside={"ros2"}) for source in sources])
        system.options.setdefault("ros2", {})["rmw"] = Setting("fastdds")
        assert facts(system)["depth"].value == held

    def test_a_depth_above_the_limit_of_one_instance_is_a_note(self):
        queue = "<historyQos><depth>50</depth></historyQos><resourceLimitsQos><max_samples_per_instance>{}"
        for most, expected in (("10", 1), ("50", 0), ("0", 0), ("-1", 0)):
            limits = f"{queue.format(most)}</max_samples_per_instance></resourceLimitsQos>"
            xml = profiles(f'<data_writer profile_name="/scan"><topic>{limits}</topic></data_writer>')
            report = checked(xml, subscribes="/scan: default", rmw="fastdds")
            assert [each.code for each in report.findings].count("ROS964") == expected
            assert report.verdict == "compatible"

    @pytest.mark.parametrize("stated", ["reliability: system_default", "profile: system_default"])
    def test_what_a_node_leaves_open_is_filled(self, stated):
        xml = profiles(writer("/scan", BEST_EFFORT))
        report = checked(xml, f"/scan: {{{stated}}}", "/scan: default", rmw="fastdds")
        assert "ROS101" in codes(report)
        assert checked(xml, f"/scan: {{{stated}}}", "/scan: default").verdict == "unknown"

    def test_a_setting_that_agrees_needs_no_word(self):
        xml = profiles(writer("/scan", BEST_EFFORT.replace("BEST_EFFORT", "RELIABLE")))
        assert codes(checked(xml, subscribes="/scan: default", rmw="fastdds")) == []

    def test_one_endpoint_that_leaves_it_open_is_enough(self):
        xml = profiles(writer("/scan", BEST_EFFORT))
        publishes = "/scan: [default, {reliability: system_default}]"
        assert codes(checked(xml, publishes, "/scan: sensor_data", rmw="fastdds")) == []

    def test_the_default_profile_holds_where_none_has_the_topic_s_name(self):
        default = writer("any name", DEADLINE, 'is_default_profile="true"')
        assert codes(checked(profiles(default), rmw="fastdds")) == ["ROS103"]
        # A profile replaces the default as a whole: what it does not set is Fast DDS's own default.
        named = writer("/scan", "<lifespan><duration><sec>5</sec></duration></lifespan>")
        report = checked(profiles(default, named), subscribes="/scan: {deadline: 3s}", rmw="fastdds")
        (finding,) = [finding for finding in report.findings if finding.code == "ROS103"]
        assert "offers deadline infinite" in finding.message

    def test_the_order_in_the_file_does_not_matter(self):
        default = writer("d", DEADLINE, 'is_default_profile="1"')
        named = writer("/scan", DEADLINE.replace("2", "1"))
        for xml in (profiles(default, named), profiles(named, default)):
            assert codes(checked(xml, rmw="fastdds")) == []

    def test_services_have_profiles_of_their_own(self):
        design = (
            "cqos: 1\nprotocol: ros2\noptions: {ros2: {rmw: fastdds}}\nparticipants:\n"
            "  server: {serves: {/add: {type: a/srv/B}}}\n  client: {calls: {/add: {type: a/srv/B}}}\n"
        )
        xml = profiles(
            f'<data_reader profile_name="service"><qos>{DEADLINE}</qos></data_reader>',
            f'<data_writer profile_name="rr/addReply"><qos>{DEADLINE}</qos></data_writer>',
        )
        sources = (Source("d.yaml", design.encode()), Source("p.xml", xml.encode()))
        report = check(merge([read_source(source, beside={"ros2"}) for source in sources]))
        found = [finding for finding in report.findings if finding.code == "ROS103"]
        assert [finding.topic for finding in found] == ["/add (request)"]
        assert "CQ214" not in codes(report)


class TestReading:
    @pytest.mark.parametrize(
        ("xml", "expected"),
        [
            ("", ["p.xml:1:1: the file is empty"]),
            ("<dds><profiles>", ["p.xml:1:16: the file ends too early: <profiles> from line 1 is never closed"]),
            ("<qos/>", ["p.xml:1:1: this is no file of Fast DDS profiles: its first element is `qos`"]),
            (
                profiles("<data_writer><qos/></data_writer>"),
                ["p.xml:1:16: a data_writer profile needs a `profile_name`"],
            ),
            (
                profiles(writer("/a", "<reliability><kind>SURE</kind></reliability>")),
                [
                    "p.xml:1:66: `reliability` cannot be `SURE`, so Fast DDS refuses the file (expected BEST_EFFORT or RELIABLE)"
                ],
            ),
            (
                profiles(writer("/a", "<deadline><period><sec>-1</sec><nanosec>x</nanosec></period></deadline>")),
                [
                    "p.xml:1:71: `deadline.sec` cannot be `-1`, so Fast DDS refuses the file",
                    "p.xml:1:84: `deadline.nanosec` cannot be `x`, so Fast DDS refuses the file",
                ],
            ),
            (
                profiles(writer("/a", "<deadline>soon</deadline><lifespan><duration/></lifespan>")),
                ["p.xml:1:53: `deadline` cannot be `soon`, so Fast DDS refuses the file"],
            ),
            (
                '<profiles><data_reader profile_name="/a"><topic><historyQos><depth/></historyQos></topic></data_reader></profiles>',
                ["p.xml:1:61: `history.depth` cannot be empty, so Fast DDS refuses the file (expected a whole number)"],
            ),
            (
                '<!DOCTYPE dds [<!ENTITY a "b">]><dds><profiles/></dds>',
                ["p.xml:1:1: the DOCTYPE declares entities or a grammar of its own, which is refused"],
            ),
            (
                "<dds><profiles>&a;</profiles></dds>",
                ["p.xml:1:19: this is not well-formed XML: Entity 'a' not defined"],
            ),
            ("<dds>" * 300, ["p.xml:1:1285: elements are nested deeper than 256, which is refused"]),
        ],
    )
    def test_mistakes_are_reported_with_their_place(self, xml, expected):
        found = problems(xml)
        assert len(found) == len(expected)
        assert [one for one, start in zip(found, expected, strict=True) if not one.startswith(start)] == []

    def test_the_reader_knows_nothing_of_ros_2(self):
        qos = "<ownershipStrength><value>7</value></ownershipStrength><liveliness><lease_duration>DURATION_INFINITY</lease_duration></liveliness>"
        found, _ = read_fastdds_profiles(Source("p.xml", profiles(writer("w", qos)).encode()))
        (profile,) = found
        assert {name: setting.text for name, setting in profile.settings.items()} == {
            "ownership_strength": "7",
            "liveliness.lease_duration": "infinite",
        }

    def test_a_file_without_profiles_states_nothing(self):
        system = read(Source("p.xml", b"<dds><profiles/><log/></dds>"), ReadContext())
        assert (system.endpoints, system.overlays, system.notes) == ([], [], [])


def test_a_variable_leaves_its_policy_unknown():
    qos = "<reliability><kind>${KIND}</kind></reliability><durability><kind>VOLATILE</kind></durability>"
    text = (
        '<dds xmlns="http://www.eprosima.com"><profiles><data_writer profile_name="/scan"><qos>'
        f"{qos}</qos></data_writer></profiles></dds>"
    )
    (overlay,) = read(Source("p.xml", text.encode()), ReadContext()).overlays
    assert overlay.settings["reliability"].unknown == "variable `KIND` is not set"
    assert overlay.settings["durability"].text == "volatile"


def partition(*names):
    return f"<partition><names>{''.join(f'<name>{name}</name>' for name in names)}</names></partition>"


def ends(offered, requested, name="/scan"):
    """Return profiles of both sides: those of one topic, or the default ones where ``name`` is empty."""
    more = "" if name else 'is_default_profile="true"'
    parts = zip(("data_writer", "data_reader"), (offered, requested), strict=True)
    return profiles(
        *(f'<{tag} profile_name="{name or tag}" {more}><qos>{qos}</qos></{tag}>' for tag, qos in parts),
    )


class TestWhatKeepsEndpointsApart:
    """A setting that decides a match is judged, or makes the pair unknown."""

    @pytest.mark.parametrize(
        ("xml", "verdict"),
        [
            (ends(partition("left"), partition("right"), name=""), "unknown"),
            (ends(partition("left"), "", name=""), "unknown"),
            (ends(partition("left"), partition("right", "left"), name=""), "compatible"),
            (ends(partition("left"), partition("left"), name=""), "compatible"),
            (ends(partition("l*"), partition("left"), name=""), "unknown"),
            (ends(partition("left"), partition("right")), "unknown"),
            (ends("<ownership><kind>EXCLUSIVE</kind></ownership>", ""), "unknown"),
            (ends(*["<ownership><kind>EXCLUSIVE</kind></ownership>"] * 2), "compatible"),
            (ends("<disablePositiveAcks><enabled>true</enabled></disablePositiveAcks>", ""), "unknown"),
            (ends("<relyability><kind>BEST_EFFORT</kind></relyability>", ""), "unknown"),
            (ends("<publishMode><kind>ASYNCHRONOUS</kind></publishMode>", ""), "compatible"),
        ],
    )
    def test_it_decides_the_pair_with_fast_dds_only(self, xml, verdict):
        assert checked(xml, subscribes="/scan: default", rmw="fastdds").verdict == verdict
        assert checked(xml, subscribes="/scan: default", rmw="cyclonedds").verdict == "compatible"

    @pytest.mark.parametrize(
        ("fields", "verdict"),
        [
            ("<maximum>1</maximum>", "unknown"),
            ("<maximum>0</maximum>", "compatible"),
            ("<initial>1</initial><increment>1</increment>", "compatible"),
            ("", "compatible"),
        ],
    )
    @pytest.mark.parametrize(("tag", "other"), [("data_writer", "Subscribers"), ("data_reader", "Publishers")])
    def test_a_maximum_of_matched_ends_may_refuse_one(self, tag, other, fields, verdict):
        inner = f"<matched{other}Allocation>{fields}</matched{other}Allocation>"
        xml = profiles(f'<{tag} profile_name="x" is_default_profile="true">{inner}</{tag}>')
        assert checked(xml, subscribes="/scan: default", rmw="fastdds").verdict == verdict

    def test_what_is_not_judged_makes_the_coverage_less_with_fast_dds_only(self):
        xml = ends(partition("left"), partition("right"))
        fast, other = (checked(xml, subscribes="/scan: default", rmw=rmw) for rmw in ("fastdds", "cyclonedds"))
        assert "ROS963" in {finding.code for finding in other.findings}
        assert (fast.coverage.percent, other.coverage.percent) == (0, 100)
        assert other.verdict_words == "compatible"

    def test_different_partitions_are_named(self):
        report = checked(
            ends(partition("left"), partition("right"), name=""), subscribes="/scan: default", rmw="fastdds"
        )
        (finding,) = [finding for finding in report.findings if finding.code == "ROS411"]
        assert "publisher has partition [left]; subscriber has partition [right]" in finding.message

    def test_a_profile_of_a_topic_keeps_the_partition_of_the_default_profile(self):
        xml = ends(partition("left"), partition("right"), name="").replace(
            "<profiles>", f"<profiles>{writer('/scan', DEADLINE)}"
        )
        assert "ROS411" in codes(checked(xml, subscribes="/scan: default", rmw="fastdds"))


LEASE = (
    '<participant profile_name="p" {}><rtps><builtin><discovery_config><leaseDuration><sec>300</sec></leaseDuration>'
    "</discovery_config></builtin></rtps></participant>"
)


class TestLeaseOfParticipants:
    NEEDS = "/scan: {needs: {liveness: 30s}}"

    def verdict(self, xml, publishes="/scan: {}", **options):
        return str(checked(xml, publishes, self.NEEDS, **options).verdict)

    def test_the_default_profile_decides_with_fast_dds(self):
        xml = profiles(LEASE.format('is_default_profile="true"'))
        assert self.verdict(xml, rmw="fastdds") == "incompatible"
        assert self.verdict(xml, rmw="cyclonedds") == "compatible"
        assert self.verdict(xml) == "unknown"

    def test_rmw_fastrtps_takes_no_other_profile(self):
        assert self.verdict(profiles(LEASE.format("")), rmw="fastdds") == "compatible"

    @pytest.mark.parametrize(("lease", "expected"), [("30 s", "compatible"), ("31 s", "incompatible")])
    def test_the_configuration_of_cyclone_dds_decides_with_cyclone_dds(self, lease, expected):
        xml = f"<CycloneDDS><Domain><Discovery><LeaseDuration>{lease}</LeaseDuration></Discovery></Domain></CycloneDDS>"
        assert self.verdict(xml, rmw="cyclonedds") == expected
        assert self.verdict(xml, rmw="fastdds") == "compatible"

    @pytest.mark.parametrize(
        ("inner", "unread"),
        [
            ("<General><Interfaces/></General><Discovery><Peers/></Discovery>", []),
            ("<Partitioning><IgnoredPartitions/></Partitioning>", []),
            (
                "<Partitioning><IgnoredPartitions><IgnoredPartition/></IgnoredPartitions></Partitioning>",
                ["Partitioning/IgnoredPartitions"],
            ),
            ("<Discovery><Tag>a</Tag></Discovery>", ["Discovery/Tag"]),
        ],
    )
    def test_what_may_keep_endpoints_apart_is_not_read(self, inner, unread):
        xml = f"<CycloneDDS><Domain>{inner}</Domain></CycloneDDS>"
        found = check(xml.encode(), importer="cyclonedds").coverage.unread
        assert [(each.name, each.endpoints) for each in found] == [(name, 0) for name in unread]

    def test_a_lease_of_one_domain_is_not_known_for_all(self):
        xml = '<CycloneDDS><Domain Id="3"><Discovery><LeaseDuration>300 s</LeaseDuration></Discovery></Domain></CycloneDDS>'
        assert self.verdict(xml, rmw="cyclonedds") == "unknown"

    def test_the_files_of_two_middlewares_hold_each_with_its_own(self):
        fast = profiles(LEASE.format('is_default_profile="true"').replace("300", "5"))
        cyclone = "<CycloneDDS><Domain><Discovery><LeaseDuration>5 s</LeaseDuration></Discovery></Domain></CycloneDDS>"
        design = "cqos: 1\nprotocol: ros2\nparticipants: {a: {publishes: {/scan: {}}}, b: {subscribes: {/scan: {needs: {liveness: 6s}}}}}"
        sources = [Source("d.yaml", design.encode()), Source("f.xml", fast.encode()), Source("c.xml", cyclone.encode())]
        for order in (sources, [sources[0], sources[2], sources[1]]):
            whole = merge([read_source(source, beside={"ros2"}) for source in order])
            report = check(whole, options={"ros2": {"rmw": "cyclonedds"}})
            assert str(report.verdict) == "compatible"
            (finding,) = [each for each in check(whole).findings if each.code == "ROS521"]
            assert {world: str(found) for world, found in finding.worlds.items()}.get(
                "ros2.rmw=cyclonedds", "compatible"
            ) == "compatible"
