"""Zenoh bridges with the nodes around them: which topics cross, with which QoS, and what C-QoS reports otherwise."""

from pathlib import Path

import pytest

from cqos_core import check, explain
from cqos_core.files.source_reader import read_source
from cqos_core.files.system_merge import merge
from cqos_core.model.re2_patterns import PatternError, name_matcher
from cqos_core.model.source import Source
from cqos_ros2.importers.zenoh_bridge import whole_names

CASES = Path(__file__).parent / "cases"
EXAMPLES = Path(__file__).parents[4] / "examples"
ROBOT = "domain: 1"
DESK = "domain: 2"


def together(nodes, robot=ROBOT, desk=DESK):
    """A robot and a desk, each with its bridge, unless that is None."""
    sources = [Source("nodes.yaml", f"cqos: 1\nprotocol: ros2\nparticipants:\n{nodes}".encode())]
    for name, about in (("robot", robot), ("desk", desk)):
        if about is not None:
            sources.append(Source(f"{name}.json5", f"{{plugins: {{ros2dds: {{{about}}}}}}}".encode()))
    return merge([read_source(source) for source in sources])


def loud(report):
    return [
        (each.severity.value, each.code, each.topic)
        for each in report.findings
        if each.severity != "note" and each.code != "CQ404"
    ]


def nodes(offered, requested, topic="/scan", there=None):
    return (
        f"  lidar: {{domain: 1, publishes: {{{topic}: {{{offered}}}}}}}\n"
        f"  ui: {{domain: 2, subscribes: {{{there or topic}: {{{requested}}}}}}}\n"
    )


class TestTopics:
    def test_a_topic_crosses_two_bridges_hop_by_hop(self):
        system = together(nodes("depth: 5", "depth: 5"))
        assert check(system).verdict == "compatible"
        way = explain(system, publisher="lidar/publisher/scan", subscriber="ui/subscriber/scan")
        assert [(hop.topic, hop.bridge, hop.verdict) for hop in way.hops] == [
            ("/scan", "zenoh_bridge_ros2dds (robot)", "compatible"),
            ("scan", "zenoh_bridge_ros2dds (desk)", "compatible"),
            ("/scan", None, "compatible"),
        ]

    def test_a_namespace_stands_before_names_on_the_other_side(self):
        robot = f'{ROBOT}, namespace: "/bot1"'
        assert loud(check(together(nodes("", "", there="/bot1/scan"), robot))) == []
        assert loud(check(together(nodes("", "", there="/scan"), robot))) == [("warning", "ROS401", "/scan")]

    def test_bridges_of_one_namespace_know_nothing_of_it(self):
        both = ', namespace: "/bot1"'
        assert loud(check(together(nodes("", ""), ROBOT + both, DESK + both))) == []

    def test_bridges_of_different_namespaces_have_nothing_in_common(self):
        report = check(together(nodes("", ""), f'{ROBOT}, namespace: "/a"', f'{DESK}, namespace: "/b"'))
        assert loud(report) == [("warning", "ROS401", "/scan")]

    @pytest.mark.parametrize(
        ("robot", "desk", "crosses"),
        [
            ("", "", True),
            (", deny: {publishers: ['/scan']}", "", False),
            (", deny: {publishers: ['/sc', '/scan_raw']}", "", True),
            (", deny: {publishers: '.*an'}", "", False),
            (", deny: {subscribers: ['/scan']}", "", True),
            ("", ", deny: {subscribers: ['/scan']}", False),
            ("", ", deny: {publishers: ['/scan']}", True),
            (", allow: {publishers: ['/s.*']}", "", True),
            (", allow: {subscribers: ['/scan']}", "", False),
            (", allow: {publishers: []}", "", False),
            (", allow: {publishers: ['']}", "", False),
            ("", ", allow: {subscribers: ['/map', '/scan']}", True),
            # without brackets a bar parts `^` from `$`
            (", allow: {publishers: ['/s|/map']}", "", True),
            (", allow: {publishers: ['(/s|/map)']}", "", False),
            (", allow: {publishers: ['x|can']}", "", True),
            (", allow: {publishers: ['^/scan$']}", ", allow: {subscribers: ['^/scan$']}", True),
        ],
    )
    def test_lists_say_what_crosses(self, robot, desk, crosses):
        report = check(together(nodes("", ""), ROBOT + robot, DESK + desk))
        assert loud(report) == ([] if crosses else [("warning", "ROS401", "/scan")])

    def test_lists_of_the_far_side_hold_for_names_without_its_namespace(self):
        both = ', namespace: "/bot1"'
        denied = f"{both}, deny: {{subscribers: ['/scan']}}"
        assert loud(check(together(nodes("", ""), ROBOT + both, DESK + denied))) == [("warning", "ROS401", "/scan")]

    def test_bridges_and_nodes_on_zenoh_never_meet(self):
        report = check(together("  lidar: {domain: 1, publishes: {/a: {}}}\n  n: {rmw: zenoh, subscribes: {/a: {}}}\n"))
        assert ("warning", "ROS402", "/a") in loud(report) or ("warning", "ROS401", "/a") in loud(report)
        assert all("n/subscriber/a" not in group.subscribers for group in report.groups)

    def test_a_program_of_dds_is_bridged_like_a_node(self):
        plain = (
            "  logger: {protocol: dds, domain: 1, implementation: cyclonedds,"
            " publishes: {rt/scan: {reliability: best_effort}}}\n"
            "  ui: {domain: 2, subscribes: {/scan: {reliability: best_effort}}}\n"
        )
        report = check(together(plain + "  lidar: {domain: 1, publishes: {/scan: {reliability: best_effort}}}\n"))
        assert [each for each in loud(report) if each[0] == "error" or each[1].startswith("ROS1")] == []


class TestWhoIsThereFirst:
    @pytest.mark.parametrize(
        ("offered", "requested", "expected"),
        [
            ("reliability: reliable", "reliability: reliable", []),
            ("reliability: best_effort", "reliability: best_effort", []),
            ("reliability: reliable", "reliability: best_effort", []),
            # alone that would never fit; over bridges it does where the publisher is there first
            ("reliability: best_effort", "reliability: reliable", [("warning", "ROS101", "/scan")]),
            ("durability: transient_local", "durability: transient_local", []),
            ("durability: transient_local", "durability: volatile", []),
            (
                "durability: volatile",
                "durability: transient_local",
                [("warning", "ROS102", "/scan"), ("warning", "ROS102", "/scan")],
            ),
            # bridges do not announce deadline and liveliness to each other
            ("deadline: 100ms", "deadline: 200ms", [("warning", "ROS103", "/scan")]),
            ("deadline: 100ms", "", []),
            ("lease_duration: 1s", "lease_duration: 2s", [("warning", "ROS105", "/scan")]),
            ("lifespan: 1s", "", []),
        ],
    )
    def test_pairs_that_depend_on_the_start_order_are_warnings(self, offered, requested, expected):
        assert loud(check(together(nodes(offered, requested)))) == expected

    @pytest.mark.parametrize(
        ("late", "code"), [("lidar: {starts_after: [ui], ", "ROS101"), ("ui: {starts_after: [lidar], ", None)]
    )
    def test_a_stated_order_settles_it(self, late, code):
        text = nodes("reliability: best_effort", "reliability: reliable").replace(f"{late.partition(':')[0]}: {{", late)
        assert [each[1] for each in loud(check(together(text)))] == ([code] if code else [])

    def test_of_two_publishers_that_differ_the_bridge_copies_one(self):
        two = "  other: {domain: 1, publishes: {/scan: {reliability: best_effort}}}\n"
        (said,) = loud(check(together(nodes("", "") + two)))
        assert said == ("warning", "ROS101", "/scan")

    def test_fixes_never_set_values_that_the_bridge_copies(self):
        report = check(together(nodes("reliability: best_effort", "reliability: reliable")))
        remedies = [remedy.text for finding in report.findings for remedy in finding.remedies]
        assert remedies == ["offer reliability `reliable` on lidar/publisher/scan"]


class TestNeeds:
    def test_what_is_stored_for_late_subscriptions_crosses(self):
        kept = "durability: transient_local, depth: 1"
        assert loud(check(together(nodes(kept, f"{kept}, needs: {{late_join: 1, latest: true}}")))) == []

    def test_where_routes_do_not_block_zenoh_may_drop(self):
        text = nodes("", "needs: {latest: true}")
        # The bridge waits for 5 s; then its transport closes, and what is sent until it opens again is lost.
        assert loud(check(together(text))) == [("warning", "ROS523", "scan")]
        text += "options: {ros2: {longest_congestion: 4s}}\n"
        assert loud(check(together(text))) == []
        assert loud(check(together(text, f"{ROBOT}, reliable_routes_blocking: false"))) == [
            ("warning", "ROS523", "scan")
        ]

    def test_a_need_that_is_lost_is_lost_at_its_hop(self):
        text = nodes("reliability: best_effort", "reliability: best_effort, needs: {latest: true}")
        errors = [each for each in check(together(text)).findings if each.severity == "error"]
        assert [(each.code, each.topic) for each in errors] == [("ROS501", "/scan"), ("ROS501", "/scan")]


class TestCalls:
    calls = "  arm: {domain: 1, serves: {/reset: {}}, action_servers: {/dock: {}}}\n"
    client = "  ui: {domain: 2, calls: {/reset: {}}, action_clients: {/dock: {}}}\n"

    def test_services_and_actions_cross(self):
        report = check(together(self.calls + self.client))
        assert loud(report) == []
        assert all(each.severity != "note" or not each.code.startswith("CQ4") for each in report.findings)

    @pytest.mark.parametrize(
        ("robot", "desk", "topics"),
        [
            (", deny: {service_servers: ['/reset']}", "", ["/reset (response)"]),
            ("", ", deny: {service_clients: ['/reset']}", ["/reset (response)"]),
            (", deny: {service_clients: ['/reset']}", "", []),
            (", deny: {action_servers: ['/dock']}", "", ["/dock (send_goal response)"]),
            ("", ", allow: {service_clients: ['.*']}", ["/dock (send_goal response)"]),
        ],
    )
    def test_lists_say_which(self, robot, desk, topics):
        report = check(together(self.calls + self.client, ROBOT + robot, DESK + desk))
        assert [(code, topic) for _, code, topic in loud(report)] == [("ROS401", topic) for topic in topics]

    def test_the_topics_of_an_action_are_no_topics_of_their_own(self):
        report = check(together(self.calls + self.client))
        ids = {end for group in report.groups for end in (*group.publishers, *group.subscribers)}
        assert not [end for end in ids if "/publisher/dock" in end]


class TestAlone:
    everything = (
        "  robot: {domain: 1, publishes: {/scan: {reliability: best_effort, deadline: 1s}, /map: {lifespan: 1s}},"
        " subscribes: {/cmd_vel: {deadline: 1s, reliability: reliable}, /scan: {reliability: best_effort}},"
        " serves: {/reset: {}}, calls: {/elsewhere: {}}, action_servers: {/dock: {}}, action_clients: {/go: {}}}\n"
    )

    def test_one_bridge_whose_other_side_is_in_no_file_makes_nothing_wrong(self):
        assert loud(check(together(self.everything, desk=None))) == []

    @pytest.mark.parametrize("example", ["mobile_robot.yaml", "smart_agriculture.yaml", "mixed/weather_station.yaml"])
    def test_with_nothing_but_defaults_it_makes_nothing_wrong_beside_any_system(self, example):
        systems = [
            read_source(Source(path.name, path.read_bytes()))
            for path in (EXAMPLES / example, CASES / "zenoh_bridge" / "defaults.json5")
        ]
        before = {(each.code, each.message) for each in check(systems[0]).findings if each.severity != "note"}
        after = {(each.code, each.message) for each in check(merge(systems)).findings if each.severity != "note"}
        assert after <= before

    def test_a_denied_topic_has_no_publisher(self):
        report = check(together(self.everything, f"{ROBOT}, deny: {{subscribers: ['/cmd_vel']}}", None))
        assert loud(report) == [("warning", "CQ401", "/cmd_vel")]

    @pytest.mark.parametrize(
        ("publishers", "about", "said"),
        [
            (10, "", []),
            (11, "", [("warning", "ROS204", "/tf_static")]),
            (3, ", transient_local_cache_multiplier: 3", []),
            (3, ", transient_local_cache_multiplier: 2", [("warning", "ROS204", "/tf_static")]),
        ],
    )
    def test_the_cache_has_room_for_as_many_publishers_as_its_multiplier(self, publishers, about, said):
        frames = "".join(
            f"  f{number}: {{domain: 1, publishes: {{/tf_static: tf_static_broadcaster}}}}\n"
            for number in range(publishers)
        )
        assert loud(check(together(frames, ROBOT + about, None))) == said

    def test_two_bridges_in_one_domain_are_on_networks_of_their_own(self):
        report = check(together(nodes("", "").replace("domain: 2", "domain: 1"), ROBOT, ROBOT))
        assert loud(report) == []

    def test_a_network_may_be_stated_where_two_robots_share_a_domain(self):
        text = (
            nodes("", "")
            .replace("domain: 2", "domain: 1, network: desk")
            .replace("lidar: {", "lidar: {network: robot, ")
        )
        report = check(together(text, ROBOT, ROBOT))
        assert loud(report) == []
        way = explain(together(text, ROBOT, ROBOT), publisher="lidar/publisher/scan", subscriber="ui/subscriber/scan")
        assert len(way.hops) == 3

    def test_a_bridge_that_does_not_start_carries_nothing(self):
        report = check(together(nodes("", ""), f'{ROBOT}, namespace: "bot1"'))
        assert loud(report) == [("error", "ROS950", None), ("warning", "ROS401", "/scan")]


def test_parameters_of_nodes_are_no_parameters_of_the_bridge():
    overrides = "/**: {ros__parameters: {qos_overrides: {/scan: {subscription: {reliability: reliable}}}}}"
    text = nodes("reliability: best_effort", "reliability: best_effort").replace("ui: {", "ui: {namespace: /x, ")
    system = merge([together(text), read_source(Source("params.yaml", overrides.encode()))])
    report = check(system)
    assert ("error", "ROS101", "/scan") not in loud(report)
    assert not [each for each in report.findings if "zenoh_bridge_ros2dds" in each.message and each.severity == "error"]


@pytest.mark.parametrize(
    "about", ["nodename: 'station/zenoh-bridge'", "namespace: '/robot-1'", "nodename: 'my bridge'"]
)
def test_names_that_ros_would_refuse_do_not_keep_the_bridge_from_starting(about):
    source = Source("b.json5", f"{{plugins: {{ros2dds: {{{about}}}}}}}".encode())
    assert read_source(source).notes == []


class TestExpressions:
    """What the bridge searches for as ``^text$`` with Rust's regular expressions, as expressions of whole names."""

    @pytest.mark.parametrize(
        ("text", "name", "carried"),
        [
            ("*/cmd_vel", "/robot/cmd_vel", True),
            ("*/cmd_vel", "/cmd_vel", True),
            ("*/cmd_vel", "/cmd_vel_raw", False),
            ("?/scan", "/a/scan", True),
            ("+/scan", "/a/scan", False),
            ("+/scan", "/scan", True),
            ("{0,2}/scan", "/a/scan", True),
            ("{1}/scan", "/a/scan", False),
            ("^*/scan", "/a/scan", False),
            ("/a|/b", "/a/c", True),
            ("/a|/b", "/c/b", True),
            ("/a.*", "/abc", True),
            (r"/a\.b", "/a.b", True),
            ("/s[ck]an", "/scan", True),
        ],
    )
    @pytest.mark.parametrize("before", ["", "zenoh:/bot"])
    def test_are_searched_for(self, text, name, carried, before):
        assert name_matcher(whole_names(text, before))(f"{before}{name}") == carried

    @pytest.mark.parametrize(
        "text", [r"\Qa\E", "a{", "{x}", r"\<a", r"\b{start}a", "(?i)/a|/b", "(?P<n>a)(?P<n>b)", "(", "[a&&b]", r"\01"]
    )
    def test_that_rust_reads_in_another_way_are_not_followed(self, text):
        with pytest.raises(PatternError):
            whole_names(text)

    def test_an_anchor_behind_a_namespace_is_not_followed(self):
        assert name_matcher(whole_names("(^/a|/b)"))("/a")
        with pytest.raises(PatternError):
            whole_names("(^/a|/b)", "zenoh:/bot")

    @pytest.mark.parametrize("kind", ["allow", "deny"])
    def test_that_are_not_followed_leave_unknown_what_is_carried(self, kind):
        report = check(together(nodes("", ""), f"{ROBOT}, {kind}: {{publishers: ['(?x)/ scan']}}"))
        assert report.verdict == "unknown"
        assert [each.code for each in report.findings if each.severity.value == "warning"] == ["ROS905"]

    def test_beside_those_that_are_followed_decide_nothing(self):
        allowed = f"{ROBOT}, allow: {{publishers: ['/scan', '(?x)/ map']}}"
        assert check(together(nodes("", ""), allowed)).verdict in {"compatible", "unknown"}
        denied = f"{ROBOT}, deny: {{publishers: ['/scan', '(?x)/ map']}}"
        assert ("warning", "ROS401", "/scan") in loud(check(together(nodes("", ""), denied)))


class TestLinks:
    """What the configuration says of the links below Zenoh."""

    KEPT = "depth: 1, durability: transient_local"

    def report(self, zenoh):
        system = [
            Source("nodes.yaml", ("cqos: 1\nprotocol: ros2\nparticipants:\n" + nodes(self.KEPT, self.NEEDS)).encode()),
            *(
                Source(f"{name}.json5", f"{{{zenoh}, plugins: {{ros2dds: {{{about}}}}}}}".encode())
                for name, about in (("robot", ROBOT), ("desk", DESK))
            ),
        ]
        return check(merge([read_source(source) for source in system]))

    NEEDS = f"{KEPT}, needs: {{late_join: 1}}"

    @pytest.mark.parametrize(
        ("zenoh", "verdict"),
        [
            ('mode: "peer"', "compatible"),
            ('connect: {endpoints: ["tcp/10.0.0.1:7447"]}', "compatible"),
            ('connect: {endpoints: {peer: ["unixsock-stream/a"], router: ["tls/10.0.0.1:7447"]}}', "compatible"),
            ('connect: {endpoints: ["udp/10.0.0.1:7447"]}', "incompatible"),
            ('connect: {endpoints: ["udp/10.0.0.1:7447"]}, listen: {endpoints: ["tcp/[::]:7447"]}', "unknown"),
            ('connect: {endpoints: ["carrier_pigeon/here"]}', "unknown"),
        ],
    )
    def test_the_protocol_of_the_endpoints_decides_what_is_sent_again(self, zenoh, verdict):
        assert self.report(zenoh).verdict == verdict

    @pytest.mark.parametrize(("wait", "text"), [("60000000", "60000000us"), ("-1", "infinite")])
    def test_how_long_a_publisher_waits_is_read(self, wait, text):
        block = f"{{link: {{tx: {{queue: {{congestion_control: {{block: {{wait_before_close: {wait}}}}}}}}}}}}}"
        source = Source("robot.json5", f"{{transport: {block}, plugins: {{ros2dds: {{{ROBOT}}}}}}}".encode())
        (wire,) = [each for name, each in read_source(source).participants.items() if name.endswith("/zenoh")]
        assert wire.settings["wait_before_close"].text == text
