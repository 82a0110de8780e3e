"""The join: parameters, names, containers, overrides, distributions, and what it finds wrong."""

from __future__ import annotations

import pytest

from cqos_core import check

TALKER = """cqos_nodes: 1
package: bot
versions: {humble: 1.0.0, jazzy: 2.0.0}
profiles: {latched: {profile: default, durability: transient_local, depth: 1}}
nodes:
  talker:
    name: talker
    plugin: bot::Talker
    parameters: {topic: {default: chatter}, frames: {default: []}, camera: {default: false}}
    publishes:
      ${topic}:
        type: std_msgs/msg/String
        overridable: [depth, reliability]
        qos: [{profile: latched, when: {distro: humble}}, {depth: 7}]
      "~/frame/${frame}": {type: std_msgs/msg/String, for_each: {frame: "${frames}"}}
      image: {type: sensor_msgs/msg/Image, when: {camera: true}}
      new: {type: std_msgs/msg/String, when: {distro: jazzy}}
  listener:
    name: listener
    plugin: bot::Listener
    subscribes:
      chatter: {type: std_msgs/msg/String}
"""
PACKAGE = {"bot/bot.node.yaml": TALKER}


def launch_of(*nodes):
    return {"bot/launch/bot.launch.xml": f"<launch>\n{''.join(nodes)}</launch>\n", **PACKAGE}


def node(executable="talker", inner="", more='name="talker"'):
    return f'<node pkg="bot" exec="{executable}" {more}>{inner}</node>\n'


def topics(system):
    return {(each.participant, each.topic) for each in system.endpoints}


def test_names_from_parameters_lists_and_conditions(joined):
    inner = '<param name="topic" value="news"/><param name="frames" value="[a, b]"/><param name="camera" value="true"/>'
    system = joined(launch_of(node(inner=inner, more='name="t" namespace="r"')))
    assert topics(system) == {
        ("/r/t", "/r/news"),
        ("/r/t", "/r/t/frame/a"),
        ("/r/t", "/r/t/frame/b"),
        ("/r/t", "/r/image"),
    }


def test_a_wildcard_that_appears_later_wins(joined):
    # rcl keeps one section for each pattern, in the order of their first appearance.
    files = {
        "bot/config/a.yaml": "talker: {ros__parameters: {topic: mine}}\n",
        "bot/config/b.yaml": "/**: {ros__parameters: {topic: all}}\n",
    }
    given = '<param from="$(find-pkg-share bot)/config/{}.yaml"/>'
    first = joined({**launch_of(node(inner=given.format("a") + given.format("b"))), **files})
    assert topics(first) == {("/talker", "/all")}


def test_sections_follow_the_order_of_their_first_appearance(joined):
    files = {
        "bot/config/a.yaml": "/**: {ros__parameters: {topic: all}}\ntalker: {ros__parameters: {topic: mine}}\n",
        "bot/config/b.yaml": "/**: {ros__parameters: {topic: later}}\n",
    }
    given = '<param from="$(find-pkg-share bot)/config/{}.yaml"/>'
    system = joined({**launch_of(node(inner=given.format("a") + given.format("b"))), **files})
    assert topics(system) == {("/talker", "/mine")}


REWRITTEN = [
    "from launch import LaunchDescription",
    "from launch.actions import DeclareLaunchArgument",
    "from launch.substitutions import LaunchConfiguration",
    "from launch_ros.actions import Node",
    "from launch_ros.substitutions import FindPackageShare",
    "from nav2_common.launch import RewrittenYaml",
    "def generate_launch_description():",
    "    params = RewrittenYaml(",
    "        source_file=[FindPackageShare('bot'), '/config/a.yaml'],",
    "        param_rewrites={},",
    "        value_rewrites={'TOPIC': LaunchConfiguration('topic'), 'CAMERA': 'True', 'FRAME': 'a'})",
    "    return LaunchDescription([",
    "        DeclareLaunchArgument('topic'%s),",
    "        Node(package='bot', executable='talker', name='talker', parameters=[params])])",
]


@pytest.mark.parametrize(
    ("default", "talks"), [(", default_value='news'", {("/talker", "/news")}), ("", set())], ids=["known", "unknown"]
)
def test_values_are_rewritten_by_their_text(joined, default, talks):
    system = joined(
        {
            "bot/launch/bot.launch.py": "\n".join(REWRITTEN) % default,
            "bot/config/a.yaml": "talker:\n  ros__parameters: {topic: TOPIC, camera: CAMERA, frames: [FRAME, b]}\n",
            **PACKAGE,
        }
    )
    rest = {("/talker", name) for name in ("/image", "/talker/frame/a", "/talker/frame/b")}
    assert topics(system) == talks | rest
    assert all(setting.text != "TOPIC" for each in system.endpoints for setting in each.settings.values())


def test_an_unknown_parameter_file_makes_names_unknown_with_the_cause(joined):
    system = joined(launch_of(node(inner='<param from="$(find-pkg-share other)/config/a.yaml"/>')))
    assert topics(system) == set()
    causes = [each.message for each in system.notes if each.code == "ROS979"]
    assert any("the package `other` is not in the workspace" in each for each in causes)


def test_the_places_lead_to_parameter_launch_line_and_node_file(joined):
    files = {"bot/config/a.yaml": "talker:\n  ros__parameters:\n    topic: news\n"}
    inner = '<param from="$(find-pkg-share bot)/config/a.yaml"/>'
    system = joined({**launch_of(node(inner=inner), node("listener", more="")), **files})
    places = {each.topic: (each.place.source.rpartition("/")[2], each.place.line) for each in system.endpoints}
    assert places == {"/news": ("a.yaml", 3), "/chatter": ("bot.launch.xml", 3)}
    setting = next(each for each in system.endpoints if each.topic == "/news").settings["durability"]
    assert setting.place.source.endswith("bot.node.yaml")
    assert setting.derived  # so that no fix edits a node file


@pytest.mark.parametrize(
    ("distro", "depth", "others"), [("humble", "1", set()), ("jazzy", "7", {"/new"}), ("", "", set())]
)
def test_what_depends_on_the_distribution(joined, distro, depth, others):
    system = joined(launch_of(node()), distro)
    chatter = next(each for each in system.endpoints if each.topic == "/chatter")
    assert {each.topic for each in system.endpoints} - {"/chatter"} == others
    if distro:
        assert chatter.settings["depth"].text == depth
    else:
        assert "differs between humble and jazzy" in chatter.settings["*"].unknown
        assert any("depend on the ROS 2 distribution" in each.message for each in system.notes)


def test_a_distribution_that_the_node_file_is_not_for_leaves_the_node_unknown(joined):
    system = joined(launch_of(node()), "rolling")
    assert system.endpoints == []
    assert any("is for humble and jazzy, not for rolling" in each.message for each in system.notes)


def test_components_take_parameters_and_remaps_of_their_container(joined):
    files = {"bot/config/a.yaml": "talker: {ros__parameters: {topic: news}}\n"}
    container = (
        '<node_container pkg="rclcpp_components" exec="component_container" name="box" namespace="">'
        '<param from="$(find-pkg-share bot)/config/a.yaml"/><remap from="news" to="papers"/>'
        '<composable_node pkg="bot" plugin="bot::Talker" name="talker"/></node_container>\n'
    )
    system = joined({**launch_of(container), **files})
    assert topics(system) == {("/talker", "/papers")}


def test_a_component_without_its_container_is_not_known(joined):
    inner = '<load_composable_node target="/box"><composable_node pkg="bot" plugin="bot::Talker" name="talker"/></load_composable_node>\n'
    system = joined(launch_of(inner))
    assert topics(system) == set()
    assert any("the container `/box` is not in the launch" in each.message for each in system.notes)


def test_a_node_without_a_node_file_is_a_part_with_unknown_endpoints(joined):
    system = joined(launch_of('<node pkg="other" exec="driver" name="driver"/>\n', node()))
    assert "/driver" in system.participants
    notes = [each.message for each in system.notes if each.code == "ROS978"]
    assert notes == ["nothing is known of the endpoints of 1 node: `/driver` (no node file for `other` `driver`)"]


def test_an_override_is_taken_only_where_the_endpoint_opts_in(joined, findings):
    inner = (
        '<param name="qos_overrides./chatter.publisher.reliability" value="best_effort"/>'
        '<param name="qos_overrides./chatter.publisher.durability" value="volatile"/>'
    )
    system = joined(launch_of(node(inner=inner), node("listener", more="")))
    chatter = next(each for each in system.endpoints if each.role == "publisher")
    assert {name: each.text for name, each in chatter.overlay.items()} == {"reliability": "best_effort"}
    found = findings(system)
    assert [each[0] for each in found] == ["ROS101", "ROS312", "ROS974"]
    assert "lets only depth and reliability be overridden" in found[2][2]


@pytest.mark.parametrize(
    ("parameter", "words"),
    [
        ("qos_overrides./chater.publisher.depth", "it has no topic `/chater`"),
        ("qos_overrides./chatter.subscription.depth", "it has no subscriber on `/chatter`"),
        ("qos_overrides./chatter.publisher.deadline.sec", "`deadline` is one value, and no map"),
    ],
)
def test_an_override_that_no_endpoint_accepts(joined, findings, parameter, words):
    system = joined(launch_of(node(inner=f'<param name="{parameter}" value="5"/>')))
    assert [(code, words in text) for code, _, text in findings(system)] == [("ROS974", True)]


@pytest.mark.parametrize("side", ["publisher", "publisher_front"])
def test_an_override_that_may_be_taken_leaves_the_policy_unknown(joined, findings, side):
    inner = f'<param name="qos_overrides./chatter.{side}.reliability" value="best_effort"/>'
    opened = TALKER.replace("overridable: [depth, reliability]", "overridable_unknown: its options are not followed")
    files = {**launch_of(node(inner=inner), node("listener", more="")), "bot/bot.node.yaml": opened}
    system = joined(files)
    chatter = next(each for each in system.endpoints if each.role == "publisher")
    assert "its options are not followed" in chatter.overlay["reliability"].unknown
    codes = [code for code, _, _ in findings(system)]
    assert "ROS974" not in codes
    assert "ROS101" not in codes
    assert codes, "the pair is not known to be compatible"


SLOTS = """cqos_nodes: 1
package: bot
nodes:
  server:
    name: server
    plugins: [{names: "${layers}", class: "${plugin}.plugin"}]
fragments:
  bot::Walls: {publishes: {walls: {type: std_msgs/msg/String}}}
"""


@pytest.mark.parametrize(
    ("name", "codes"), [("bot::Walls", []), ("bot/Wals", ["ROS981"]), ("bot::Doors", []), ("other::Walls", [])]
)
def test_a_plugin_with_a_class_that_is_nearly_one(joined, findings, name, codes):
    inner = f'<param name="layers" value="[w]"/><param name="w.plugin" value="{name}"/>'
    system = joined({**launch_of(node("server", inner=inner)), "bot/bot.node.yaml": SLOTS})
    assert [code for code, _, _ in findings(system)] == codes
    advice = [each.help for each in system.notes if each.code == "ROS981"]
    assert advice == ["did you mean `bot::Walls`?"] * len(codes)
    places = [each.place.line for each in system.notes if each.code == "ROS981"]
    assert places == [2] * len(codes)


NAMED = """cqos_nodes: 1
package: bot
nodes:
  talker:
    name: talker
    namespace: own
    publishes: {chatter: {type: std_msgs/msg/String}}
"""


@pytest.mark.parametrize(("given", "full"), [("", "/own/chatter"), ("there", "/there/chatter")])
def test_the_namespace_of_the_code_holds_where_the_launch_gives_none(joined, given, full):
    more = f'namespace="{given}"' if given else ""
    system = joined({**launch_of(node(more=more)), "bot/bot.node.yaml": NAMED})
    assert [each.topic for each in system.endpoints] == [full]


def test_a_remap_that_matches_nothing(joined, findings):
    system = joined(launch_of(node(inner='<remap from="chater" to="news"/>')))
    found = findings(system)
    assert [each[:2] for each in found] == [("ROS972", (("bot.launch.xml", 2),))]
    assert "`/talker` has no topic or service `/chater`" in found[0][2]


def test_a_remap_of_a_node_that_is_not_wholly_known_is_not_judged(joined, findings):
    inner = '<remap from="chater" to="news"/><param name="frames" value="$(env FRAMES)"/>'
    assert findings(joined(launch_of(node(inner=inner)))) == []


def test_remaps_apply_in_order_and_once(joined):
    inner = '<remap from="chatter" to="a"/><remap from="a" to="b"/><remap from="chatter" to="c"/>'
    system = joined(launch_of(node(inner=inner)))
    assert topics(system) == {("/talker", "/a")}


def test_a_broken_node_file_of_the_workspace_is_an_error(joined):
    from cqos_core import InputError

    with pytest.raises(InputError, match="did you mean `publishes`"):
        joined({**launch_of(node()), "bot/bot.node.yaml": TALKER.replace("publishes", "publishs", 1)})


MANAGER = '<node pkg="nav2_lifecycle_manager" exec="lifecycle_manager" name="m"><param name="node_names" value="[{}]"/></node>\n'
SERVER = '<node pkg="nav2_map_server" exec="map_server" name="map_server"/>\n'


@pytest.mark.parametrize(
    ("names", "expected"),
    [
        ("map_server", []),
        ("map_servr", ["ROS975", "ROS976"]),
        ("map_server, amcl", ["ROS975"]),
    ],
)
def test_lifecycle_nodes_and_their_managers(joined, findings, names, expected):
    system = joined(launch_of(MANAGER.format(names), SERVER))
    assert [code for code, *_ in findings(system)] == expected


@pytest.mark.parametrize(("distro", "expected"), [("humble", []), ("jazzy", ["ROS976"])])
def test_a_node_is_a_lifecycle_node_since_some_distribution(joined, findings, distro, expected):
    slam = '<node pkg="slam_toolbox" exec="async_slam_toolbox_node" name="slam_toolbox"/>\n'
    system = joined(launch_of(MANAGER.format("map_server"), SERVER, slam), distro)
    assert [code for code, *_ in findings(system) if code.startswith("ROS97")] == expected


def test_a_node_that_is_not_known_may_be_the_partner_of_a_topic_in_another_namespace(joined, findings):
    bridge = '<node pkg="ros_gz_bridge" exec="parameter_bridge" name="bridge" args="/front/scan@sensor_msgs/msg/LaserScan[gz.msgs.LaserScan"/>\n'
    amcl = '<node pkg="nav2_amcl" exec="amcl"/>\n'
    assert [code for code, *_ in findings(joined(launch_of(bridge, amcl)))] == ["CQ403", "ROS976"]
    driver = '<node pkg="other" exec="driver" name="driver"/>\n'
    ((code, _, message),) = findings(joined(launch_of(bridge, amcl, driver)))
    assert code == "ROS984"
    assert message.endswith("perhaps `/driver`, of which nothing is known, publishes `/scan`")
    same = '<node pkg="nav2_amcl" exec="amcl"><remap from="scan" to="/front/scan"/></node>\n'
    assert findings(joined(launch_of(bridge, same, driver))) == []


def test_a_bridge_of_a_launch_does_not_take_back_what_it_publishes(joined):
    bridge = '<node pkg="ros_gz_bridge" exec="parameter_bridge" name="bridge" args="/cmd_vel@geometry_msgs/msg/Twist@gz.msgs.Twist"/>'
    assert not check(joined(launch_of(bridge))).groups


def test_a_node_that_is_partly_known_may_have_any_topic_below_its_own_name(joined, findings):
    camera = '<node pkg="bot" exec="camera" name="{}"/>\n'
    viewer = '<node pkg="bot" exec="listener" name="viewer"><remap from="chatter" to="/oak/chatter"/></node>\n'
    files = {
        "bot/bot.node.yaml": TALKER
        + "  camera: {publishes: {raw: {type: a/msg/B}}, unread: [{what: streams, cause: the device decides}]}\n"
    }
    for name, expected in (("oak", []), ("usb", ["CQ403"])):
        nodes = launch_of(node(), viewer, camera.format(name))
        assert [code for code, *_ in findings(joined({**nodes, **files}))] == expected


def test_inputs_of_a_filter_follow_their_configuration(joined):
    config = "[" + ", ".join(["true"] + ["false"] * 14) + "]"
    none = "[" + ", ".join(["false"] * 15) + "]"
    files = {
        "bot/config/a.yaml": f"""ekf_filter_node:
  ros__parameters:
    odom0: wheel/odom
    odom0_config: {config}
    odom0_queue_size: 3
    odom1: visual/odom
    odom1_config: {none}
    imu0: imu/data
    imu0_config: {config}
    imu2: far/imu
    imu2_config: {config}
"""
    }
    node = '<node pkg="robot_localization" exec="ekf_node"><param from="$(find-pkg-share bot)/config/a.yaml"/></node>\n'
    system = joined({**launch_of(node), **files})
    inputs = {
        each.topic: each.settings["depth"].text
        for each in system.endpoints
        if each.type and each.role == "subscriber" and "/" in each.topic[1:]
    }
    assert inputs == {"/wheel/odom": "3", "/imu/data": "10"}


def test_an_image_that_a_node_copies_the_qos_of(joined, findings):
    nodes = (
        '<node pkg="usb_cam" exec="usb_cam_node_exe"/>',
        '<node pkg="image_proc" exec="rectify_node"><remap from="image" to="image_raw"/></node>',
    )
    system = joined(launch_of(*nodes))
    assert {each.topic for each in system.endpoints} >= {"/image_raw", "/image_rect"}
    assert findings(system) == []


def test_a_published_topic_that_nothing_takes_is_no_typing_error(joined):
    def rectify(name, camera):
        inner = f'<remap from="image" to="{camera}/image"/><remap from="image_rect" to="{camera}/image_rect"/>'
        return f'<node pkg="image_proc" exec="rectify_node" name="{name}">{inner}</node>'

    cloud = (
        '<node pkg="depth_image_proc" exec="point_cloud_xyz_node">'
        '<remap from="image_rect" to="front/image_rect"/></node>'
    )
    system = joined(launch_of(rectify("one", "front"), rectify("two", "rear"), cloud))
    assert [each.message for each in system.notes if each.code == "ROS973"] == []


def test_the_topics_of_one_node_are_no_near_misses_of_each_other(joined, findings):
    inner = '<remap from="image" to="camera/image_rect"/>'
    system = joined(launch_of(f'<node pkg="image_proc" exec="rectify_node">{inner}</node>'))
    assert {each.topic for each in system.endpoints} == {"/camera/image_rect", "/image_rect"}
    assert findings(system) == []


OWN = """cqos_nodes: 1
package: bot
nodes:
  talker:
    name: talker
    {}
    parameters: {{topic: {{default: chatter}}}}
    publishes: {{"${{topic}}": {{type: std_msgs/msg/String}}}}
"""


@pytest.mark.parametrize(
    ("own", "expected"),
    [
        ("remaps: {chatter: /mine}", ("/r/t", "/mine")),
        ("remaps: {__node: x, __ns: /y}", ("/y/x", "/y/chatter")),
        ("global_arguments: false", ("/talker", "/chatter")),
    ],
)
def test_what_a_node_states_of_itself_wins_over_the_launch(joined, own, expected):
    inner = '<remap from="chatter" to="theirs"/>' if "chatter" in own else ""
    inner += '<param name="topic" value="given"/>' if "global" in own else ""
    files = launch_of(node(inner=inner, more='name="t" namespace="r"'))
    assert topics(joined({**files, "bot/bot.node.yaml": OWN.format(own)})) == {expected}


# The middleware


def of_middleware(system):
    return [each.message for each in system.notes if each.code == "ROS982"]


def env(**variables):
    return "".join(f'<env name="{name}" value="{value}"/>' for name, value in variables.items())


@pytest.mark.parametrize(
    ("variables", "named"),
    [
        ({"ZENOH_SESSION_CONFIG_URI": "/etc/session.json5"}, ["ZENOH_SESSION_CONFIG_URI"]),
        ({"ZENOH_SESSION_CONFIG_URI": "/s.json5", "RMW_IMPLEMENTATION": "rmw_zenoh_cpp"}, ["ZENOH_SESSION_CONFIG_URI"]),
        ({"ZENOH_SESSION_CONFIG_URI": "/s.json5", "RMW_IMPLEMENTATION": "rmw_cyclonedds_cpp"}, []),
        ({"CYCLONEDDS_URI": "file:///c.xml", "RMW_IMPLEMENTATION": "rmw_cyclonedds_cpp"}, ["CYCLONEDDS_URI"]),
        ({"FASTRTPS_DEFAULT_PROFILES_FILE": "f.xml"}, ["FASTRTPS_DEFAULT_PROFILES_FILE"]),
        (
            {"ROS_LOCALHOST_ONLY": "1", "ZENOH_CONFIG_OVERRIDE": "mode='client'"},
            ["ZENOH_CONFIG_OVERRIDE", "ROS_LOCALHOST_ONLY"],
        ),
        ({"ZENOH_SESSION_CONFIG_URI": "$(env FILE)"}, ["ZENOH_SESSION_CONFIG_URI"]),
        ({"ZENOH_SESSION_CONFIG_URI": ""}, []),
        ({"ROS_DOMAIN_ID": "3", "RCUTILS_COLORIZED_OUTPUT": "1"}, []),
        ({}, []),
    ],
)
def test_a_configuration_of_the_middleware_is_named(joined, variables, named):
    said = of_middleware(joined(launch_of(node(inner=env(**variables)))))
    assert [each.partition("`")[2].partition("`")[0] for each in said] == named
    assert all("`/talker`" in each for each in said)


def test_a_configuration_of_all_nodes_is_one_note(joined):
    variable = '<set_env name="ZENOH_SESSION_CONFIG_URI" value="s.json5"/>\n'
    nodes = [node(more=f'name="t{number}"') for number in range(5)]
    (said,) = of_middleware(joined(launch_of(variable, *nodes)))
    assert "to `s.json5` for `/t0`, `/t1`, `/t2` and 2 more nodes" in said
    assert "access_control" in said


def unread(system):
    """What was not read of a launch: kind, name and how many endpoints at least."""
    return [(part.kind, part.name, part.endpoints) for each in system.notes for part in each.parts]


UNREAD = {
    "a node without a node file": ('<node pkg="other" exec="driver" name="driver"/>', [("node", "/driver", 1)]),
    "a node whose package is not known": (
        '<node pkg="$(env PACKAGE)" exec="talker" name="t"/>',
        [("node", "/t", 1)],
    ),
    "a node under a condition that is not decided": (
        '<node pkg="bot" exec="talker" name="t" if="$(env TALKS)"/>',
        [("node", "/t", 1)],
    ),
    "a process": (
        '<executable cmd="python3 play.py /scan"/>',
        [("process", "python3 play.py /scan", 1)],
    ),
    "an include of a package that is not here": (
        '<include file="$(find-pkg-share nav2_bringup)/launch/navigation_launch.py"/>',
        [("include", "$(find-pkg-share nav2_bringup)/launch/navigation_launch.py", 1)],
    ),
}


@pytest.mark.parametrize("case", UNREAD)
def test_what_a_launch_starts_and_is_not_read_is_named(joined, case):
    element, expected = UNREAD[case]
    system = joined(launch_of(node(), node("listener", more=""), f"{element}\n"))
    assert unread(system) == expected
    report = check(system)
    assert report.verdict_words == "compatible as far as read"
    assert report.coverage.percent < 100


def test_a_launch_that_was_read_whole_is_compatible(joined):
    report = check(joined(launch_of(node(), node("listener", more=""))))
    assert (report.verdict_words, report.coverage.percent) == ("compatible", 100)


@pytest.mark.parametrize("command", ["ros2 run bot talker", "ros2 run bot talker --ros-args -r chatter:=news"])
def test_ros2_run_starts_a_node_like_any_other(joined, command):
    system = joined(launch_of(f'<executable cmd="{command}"/>\n', node("listener", more="")))
    assert unread(system) == []
    assert ("/talker", "/news" if "news" in command else "/chatter") in topics(system)


@pytest.mark.parametrize(
    ("command", "processes"),
    [
        ("ros2 run --prefix nice bot talker", []),
        ("ros2 run bot talker; ros2 topic pub /a std_msgs/msg/String", ["process"]),
        ("ros2 run bot talker &amp; true", ["process"]),
        ("ros2 topic pub /a std_msgs/msg/String", ["process"]),
    ],
)
def test_a_command_line_is_a_node_only_if_it_runs_nothing_else(joined, command, processes):
    system = joined(launch_of(f'<executable cmd="{command}" shell="true"/>\n', node("listener", more="")))
    assert [kind for kind, *_ in unread(system)] == processes


def test_nodes_that_are_not_known_are_counted_once_each(joined):
    other = '<node pkg="other" exec="driver"/>\n'
    undecided = '<node pkg="bot" exec="talker" name="t" if="$(env ONE)"/>\n'
    system = joined(launch_of(node(), other, other, undecided))
    assert unread(system) == [("node", "/(other/driver)", 1), ("node", "/(other/driver)#2", 1), ("node", "/t", 1)]
    assert check(system).coverage.totals == {"node": 4}


def test_nodes_of_which_something_is_known_are_no_share_of_all(joined):
    slam = '<node pkg="slam_toolbox" exec="async_slam_toolbox_node" name="slam"/>\n'
    covered = check(joined(launch_of(node(), slam))).coverage
    assert [each.kind for each in covered.unread] == ["partly known node"]
    assert covered.totals == {}


EVENT = """from launch import LaunchDescription
from launch.actions import RegisterEventHandler
from launch.event_handlers import OnProcessStart
from launch_ros.actions import Node


def generate_launch_description():
    first = Node(package="bot", executable="listener", name="listener")
    then = Node(package="bot", executable="talker", name="talker")
    return LaunchDescription([first, RegisterEventHandler(OnProcessStart(target_action=first, on_start=[then]))])
"""


def test_a_node_that_starts_on_an_event_is_not_known(tmp_path, started):
    folder = tmp_path / "src" / "bot"
    (folder / "launch").mkdir(parents=True)
    (folder / "package.xml").write_text("<package><name>bot</name></package>", encoding="utf-8")
    (folder / "bot.node.yaml").write_text(TALKER, encoding="utf-8")
    (folder / "launch" / "bot.launch.py").write_text(EVENT, encoding="utf-8")
    report = check(started(tmp_path, str(folder / "launch" / "bot.launch.py")))
    assert [(each.kind, each.name) for each in report.coverage.unread] == [("node", "/talker")]
    assert report.coverage.totals == {"node": 2}


@pytest.mark.parametrize(
    ("nodes", "expected"),
    [
        ((SERVER,), ["ROS976"]),
        ((SERVER, "<lifecycle_transition/>\n"), []),
        ((SERVER, '<executable cmd="ros2 lifecycle set /map_server activate"/>\n'), []),
        ((SERVER, '<node pkg="other" exec="other"/>\n'), []),
        ((SERVER.replace("<node", "<lifecycle_node").replace("/>", ' autostart="true"/>'),), []),
        ((SERVER.replace("<node", "<lifecycle_node").replace("/>", ' autostart="false"/>'),), ["ROS976"]),
        ((MANAGER.format("amcl"), SERVER, '<executable cmd="ros2 lifecycle set /map_server activate"/>\n'), ["ROS975"]),
    ],
)
@pytest.mark.parametrize("distro", ["humble", "jazzy", ""])
def test_what_activates_a_lifecycle_node(joined, findings, nodes, expected, distro):
    found = [code for code, *_ in findings(joined(launch_of(*nodes), distro)) if code.startswith("ROS97")]
    assert found == expected
