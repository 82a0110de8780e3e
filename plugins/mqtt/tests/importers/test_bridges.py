"""The bridges that people have: parameters of mqtt_client, and connections of Mosquitto."""

import pytest

import cqos_core as cqos

CLIENT = b"""/**/*:
  ros__parameters:
    broker: {host: broker.example, port: 1884}
    client: {id: r1, keep_alive_interval: 30.0, last_will: {topic: gone, qos: 1, retained: true}}
    bridge:
      ros2mqtt:
        ros_topics: [/battery, /forgotten, /pose]
        /battery: {mqtt_topic: fleet/r1/battery, primitive: true, ros_type: std_msgs/msg/Float32}
        /pose:
          mqtt_topic: fleet/r1/pose
          advanced: {ros: {queue_size: 5, qos: {reliability: best_effort, durability: auto}}, mqtt: {qos: 2, retained: true}}
      mqtt2ros:
        mqtt_topics: [fleet/r1/cmd]
        fleet/r1/cmd: {ros_topic: /cmd, advanced: {mqtt: {qos: 1}, ros: {latched: true}}}
"""
FLAT = b"""mqtt_client:
  ros__parameters:
    broker.host: broker.example
    bridge.ros2mqtt.ros_topics: [/a]
    bridge.ros2mqtt./a.mqtt_topic: b
    bridge.ros2mqtt./a.advanced.mqtt.qos: 1
"""
MOSQUITTO = b"""listener 1883
connection barn
address barn.example:1884
cleansession true
remote_clientid farm
bridge_protocol_version mqttv50
bridge_session_expiry_interval 60
topic weather/# in 1 farm/ ""
topic cmd both 2
topic a/+/b
max_qos 0
connection attic
address attic.example
topic x
"""


def texts(settings):
    return {name: setting.text for name, setting in settings.items()}


def ends(bridge):
    return [
        (route.source.participant, route.source.topic, route.target.participant, route.target.topic)
        for route in bridge.routes
    ]


def test_parameters_of_mqtt_client_are_a_bridge_between_a_node_and_a_client():
    system = cqos.read(CLIENT)
    bridge = system.bridges["mqtt_client"]
    assert ends(bridge) == [
        ("mqtt_client", "/battery", "mqtt_client/mqtt", "fleet/r1/battery"),
        ("mqtt_client", "/pose", "mqtt_client/mqtt", "fleet/r1/pose"),
        ("mqtt_client/mqtt", "fleet/r1/cmd", "mqtt_client", "/cmd"),
    ]
    assert system.participants["mqtt_client"].protocol == "ros2"
    client = system.participants["mqtt_client/mqtt"]
    assert client.protocol == "mqtt"
    assert texts(client.settings) == {
        "protocol_version": "3.1.1",
        "broker": "broker.example:1884",
        "clean_start": "true",
        "keep_alive": "30.0",
        "client_id": "r1",
        "will.topic": "gone",
        "will.qos": "1",
        "will.retain": "true",
    }


def test_what_the_file_leaves_out_is_as_mqtt_client_has_it():
    battery, pose, cmd = cqos.read(CLIENT).bridges["mqtt_client"].routes
    copied = {"reliability": "from_publishers", "durability": "from_publishers"}
    assert texts(battery.source.settings) == {"depth": "1", **copied}
    assert texts(battery.target.settings) == {"qos": "0", "retain": "false"}
    assert battery.source.type == "std_msgs/msg/Float32"
    assert texts(pose.source.settings) == {"depth": "5", "reliability": "best_effort", "durability": "from_publishers"}
    assert texts(pose.target.settings) == {"qos": "2", "retain": "true"}
    assert texts(cmd.source.settings) == {"qos": "1"}
    assert texts(cmd.target.settings) == {
        "depth": "1",
        "reliability": "system_default",
        "durability": "system_default",
    }


def test_types_of_messages_that_are_not_primitive_go_over_retained_topics_of_their_own():
    found = {(each.role, each.topic): texts(each.settings) for each in cqos.read(CLIENT).endpoints}
    assert found == {
        ("publisher", "mqtt_client/ros_msg_type/fleet/r1/pose"): {"qos": "2", "retain": "true"},
        ("subscriber", "mqtt_client/ros_msg_type/fleet/r1/cmd"): {"qos": "1"},
    }


def test_what_mqtt_client_does_not_do_is_told_with_its_line():
    notes = {each.code: each for each in cqos.read(CLIENT).notes}
    assert notes["MQTT960"].message.startswith("`/forgotten` is listed in `ros_topics`, but has no `mqtt_topic`")
    assert notes["MQTT960"].place.line == 7
    assert notes["MQTT961"].place.line == 14


def test_parameters_joined_by_dots_are_read_alike():
    (route,) = cqos.read(FLAT).bridges["mqtt_client"].routes
    assert (route.source.topic, route.target.topic) == ("/a", "b")
    assert route.target.settings["qos"].text == "1"


def test_a_robot_a_bridge_as_it_comes_and_a_cloud_that_must_not_lose_anything(tmp_path):
    (tmp_path / "params.yaml").write_bytes(CLIENT)
    (tmp_path / "rest.yaml").write_text("""
cqos: 1
options: {ros2: {rmw: cyclonedds, round_trip_time: 2ms}}
participants:
  robot: {protocol: ros2, publishes: {/battery: {type: std_msgs/msg/Float32, depth: 1}}}
  cloud:
    protocol: mqtt
    broker: broker.example:1884
    client: {client_id: cloud, clean_start: false}
    subscribes: {fleet/r1/battery: {qos: 1, needs: {loss_free: true}}}
""")
    report = cqos.check(tmp_path / "params.yaml", tmp_path / "rest.yaml")
    (error,) = [each for each in report.findings if each.severity == "error"]
    assert error.code == "MQTT101"
    assert error.endpoints == (
        "cloud/subscriber/fleet/r1/battery",
        "mqtt_client/mqtt/publisher/fleet/r1/battery",
    )
    assert [remedy.text for remedy in error.remedies] == [
        "offer qos `1` on mqtt_client/mqtt/publisher/fleet/r1/battery"
    ]
    mended = CLIENT.replace(b"primitive: true, ros_type", b"primitive: true, advanced: {mqtt: {qos: 1}}, ros_type")
    (tmp_path / "params.yaml").write_bytes(mended)
    report = cqos.check(tmp_path / "params.yaml", tmp_path / "rest.yaml")
    left = [each for each in report.findings if each.topic == "/battery" and each.severity == "warning"]
    assert report.verdict == "unknown"
    assert {each.code for each in left} == {"ROS505", "ROS506"}
    assert all("period is not stated" in each.message for each in left)
    latest = (tmp_path / "rest.yaml").read_text().replace("loss_free: true", "latest: true")
    (tmp_path / "rest.yaml").write_text(latest)
    assert cqos.check(tmp_path / "params.yaml", tmp_path / "rest.yaml").verdict == "compatible"


def test_connections_of_mosquitto_are_bridges_between_brokers():
    system = cqos.read(MOSQUITTO, importer="mosquitto")
    assert list(system.bridges) == ["barn", "attic"]
    assert ends(system.bridges["barn"]) == [
        ("barn (barn.example)", "weather/*", "barn (here)", "farm/weather/*"),
        ("barn (here)", "cmd", "barn (barn.example)", "cmd"),
        ("barn (barn.example)", "cmd", "barn (here)", "cmd"),
        ("barn (here)", "*", "barn (barn.example)", "*"),
    ]
    assert system.bridges["barn"].routes[-1].only == ("a/[^/]*/b",)
    remote = system.participants["barn (barn.example)"]
    assert texts(remote.settings) == {
        "broker": "barn.example:1884",
        "client_id": "farm",
        "clean_start": "true",
        "keep_alive": "60",
        "protocol_version": "5.0",
        "session_expiry_interval": "60",
    }
    assert system.participants["barn (here)"].settings["client_id"].text == "local.barn"
    (attic,) = system.bridges["attic"].routes
    assert (attic.source.participant, attic.target.settings["qos"].text) == ("attic (here)", "0")
    assert system.participants["attic (attic.example)"].settings["clean_start"].text == "false"
    (broker,) = [each for name, each in system.brokers.items() if ":" not in name]
    assert "maximum_qos" not in broker.settings, "a line within a connection is no line of the broker"


@pytest.mark.parametrize(
    ("filter_", "carried"),
    [
        (b"+/temp", {"barn/temp", "shed/temp"}),
        (b"barn/+", {"barn/temp"}),
        (b"barn/+/#", {"barn/temp", "barn/roof/wind"}),
        (b"barn/#", {"barn/temp", "barn/roof/wind"}),
        (b"+/+/+", {"barn/roof/wind"}),
        (b"shed/temp", {"shed/temp"}),
    ],
)
def test_what_matches_the_filter_of_a_bridge_is_carried_below_its_prefixes(tmp_path, filter_, carried):
    config = b"listener 1883\nconnection b\naddress far.example\ntopic " + filter_ + b" out 1 farm/ site/\n"
    (tmp_path / "mosquitto.conf").write_bytes(config)
    (tmp_path / "rest.yaml").write_text("""
cqos: 1
protocol: mqtt
participants:
  sensor:
    broker: mosquitto
    client: {client_id: sensor}
    publishes: {farm/barn/temp: {}, farm/shed/temp: {}, farm/barn/roof/wind: {}, barn/temp: {}}
""")
    report = cqos.check(tmp_path / "mosquitto.conf", tmp_path / "rest.yaml")
    mine = {name for group in report.groups for name in group.subscribers if name.startswith("b/")}
    assert mine == {f"b/subscriber/farm/{name}" for name in carried}


def test_a_configuration_alone_is_no_finding_that_anybody_has_to_look_at():
    report = cqos.check(MOSQUITTO, importer="mosquitto")
    assert {each.severity.value for each in report.findings} <= {"note"}


@pytest.mark.parametrize(
    ("line", "why"),
    [
        (b"topic a sideways", "expected one of out, in, both as the direction"),
        (b"topic a out 3", "expected 0, 1 or 2 as the QoS"),
        (b"topic a/#/b", "`#` stands for the rest, so it can only be the last level"),
        (b"bridge_protocol_version mqttv9", "expected one of mqttv31, mqttv311, mqttv50"),
    ],
)
def test_what_mosquitto_refuses_is_an_error_with_its_line(line, why):
    data = b"listener 1883\nconnection b\naddress h\n" + line + b"\n"
    with pytest.raises(cqos.InputError) as refused:
        cqos.read(data, importer="mosquitto")
    (problem,) = refused.value.problems
    assert (problem.code, problem.place.line) == ("MQTT940", 4)
    assert why in problem.message


def test_a_connection_without_address_is_an_error():
    with pytest.raises(cqos.InputError, match="a connection needs an `address`"):
        cqos.read(b"connection b\ntopic a\n", importer="mosquitto")


def test_what_a_bridge_renames_is_no_near_miss():
    ping_pong = FLAT.replace(b"/a", b"/ping/a") + (
        b"    bridge.mqtt2ros.mqtt_topics: [b]\n    bridge.mqtt2ros.b.ros_topic: /pong/a\n    bridge.mqtt2ros.b.primitive: true\n"
    )
    assert "CQ403" not in {finding.code for finding in cqos.check(ping_pong).findings}
    beside = b"cqos: 1\nparticipants: {n: {protocol: ros2, publishes: {/pang/a: {}}}}\n"
    assert "CQ403" in {finding.code for finding in cqos.check(FLAT.replace(b"/a", b"/ping/a"), beside).findings}
