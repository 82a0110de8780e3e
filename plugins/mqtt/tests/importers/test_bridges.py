"""The bridges that people have: parameters of mqtt_client, and connections of Mosquitto."""

import json
import shutil
import subprocess

import pytest

import cqos_core as cqos
from cqos_core.model.settings import EVERY_OTHER

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


def test_entries_that_mqtt_client_ignores_are_reported_with_their_line():
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
    subscribes: {fleet/r1/battery: {qos: 1, taken_every: 0ms, needs: {loss_free: true}}}
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
    fixed = CLIENT.replace(b"primitive: true, ros_type", b"primitive: true, advanced: {mqtt: {qos: 1}}, ros_type")
    (tmp_path / "params.yaml").write_bytes(fixed)
    report = cqos.check(tmp_path / "params.yaml", tmp_path / "rest.yaml")
    left = [each for each in report.findings if each.topic == "/battery" and each.severity == "warning"]
    assert report.verdict == "unknown"
    assert {each.code for each in left} == {"ROS505"}  # ROS506 lacks the same facts
    assert all("period is not stated" in each.message for each in left)
    latest = (tmp_path / "rest.yaml").read_text().replace("loss_free: true", "latest: true")
    (tmp_path / "rest.yaml").write_text(latest)
    assert cqos.check(tmp_path / "params.yaml", tmp_path / "rest.yaml").verdict == "compatible"


def test_connections_of_mosquitto_are_bridges_between_brokers():
    system = cqos.read(MOSQUITTO, importer="mosquitto")
    assert list(system.bridges) == ["barn (<bytes>)", "attic (<bytes>)"]
    assert ends(system.bridges["barn (<bytes>)"]) == [
        ("barn (<bytes> at barn.example)", "weather/*", "barn (<bytes>)", "farm/weather/*"),
        ("barn (<bytes> at barn.example)", "weather", "barn (<bytes>)", "farm/weather"),
        ("barn (<bytes>)", "cmd", "barn (<bytes> at barn.example)", "cmd"),
        ("barn (<bytes> at barn.example)", "cmd", "barn (<bytes>)", "cmd"),
        ("barn (<bytes>)", "*", "barn (<bytes> at barn.example)", "*"),
    ]
    assert system.bridges["barn (<bytes>)"].routes[-1].only == ("a/[^/]*/b",)
    remote = system.participants["barn (<bytes> at barn.example)"]
    assert texts(remote.settings) == {
        "broker": "barn.example:1884",
        "client_id": "farm",
        "clean_start": "true",
        "keep_alive": "60",
        "protocol_version": "5.0",
        "session_expiry_interval": "60",
        "will.topic": "$SYS/broker/connection/farm/state",
        "will.payload": "0",
        "will.qos": "1",
        "will.retain": "true",
    }
    assert system.participants["barn (<bytes>)"].settings["client_id"].text == "local.<bytes>.barn"
    (attic,) = system.bridges["attic (<bytes>)"].routes
    assert (attic.source.participant, attic.target.settings["qos"].text) == ("attic (<bytes>)", "0")
    assert system.participants["attic (<bytes> at attic.example)"].settings["clean_start"].text == "false"
    (broker,) = [each for name, each in system.brokers.items() if ":" not in name]
    cases = (("port 1883", "0"), ("a bridge of its own", "2"))
    assert broker.settings["maximum_qos"].unknown.values == cases, (
        "a connection ends with the first line of another kind"
    )


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
    mine = {name for group in report.groups for name in group.subscribers if name.startswith("b (")}
    assert mine == {f"b (mosquitto)/subscriber/farm/{name}" for name in carried}


def test_a_configuration_alone_gives_notes_only():
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
    report = cqos.check(data, importer="mosquitto")
    (error,) = (each for each in report.findings if each.severity == "error")
    assert (error.code, error.place.line) == ("MQTT940", 4)
    assert why in error.message
    assert [(each.kind, each.name) for each in report.coverage.unread] == [("bridge", "b")]


def test_a_connection_without_address_is_an_error():
    report = cqos.check(b"connection b\ntopic a\n", importer="mosquitto")
    assert "a connection needs an `address`" in report.findings[0].message


def test_what_a_bridge_renames_is_no_near_miss():
    ping_pong = FLAT.replace(b"/a", b"/ping/a") + (
        b"    bridge.mqtt2ros.mqtt_topics: [b]\n    bridge.mqtt2ros.b.ros_topic: /pong/a\n    bridge.mqtt2ros.b.primitive: true\n"
    )
    assert "CQ403" not in {finding.code for finding in cqos.check(ping_pong).findings}
    beside = b"cqos: 1\nparticipants: {n: {protocol: ros2, publishes: {/pang/a: {}}}}\n"
    assert "CQ403" in {finding.code for finding in cqos.check(FLAT.replace(b"/a", b"/ping/a"), beside).findings}


def carried(text, *more):
    """The system of a configuration with one connection of these lines, and its bridge."""
    lines = "\n".join(("connection b", "address far.example", text, *more))
    system = cqos.read(lines.encode(), importer="mosquitto")
    (bridge,) = system.bridges.values()
    return system, bridge


def test_a_filter_with_the_rest_carries_the_name_before_it_too():
    _, bridge = carried("topic t/# out")
    assert [route.source.topic for route in bridge.routes] == ["t/*", "t"]


@pytest.mark.parametrize(("filter_", "kept"), [("#", True), ("+/x", True), ("t/#", False)])
def test_wildcards_at_the_start_carry_nothing_of_the_broker(filter_, kept):
    _, bridge = carried(f"topic {filter_} out")
    assert all(bool(route.but) == kept for route in bridge.routes)


@pytest.mark.parametrize(
    ("more", "way", "retain"),
    [
        ((), "out", "from_publishers"),
        ((), "in", "from_publishers"),
        (("bridge_outgoing_retain false",), "out", "false"),
        (("bridge_outgoing_retain false",), "in", "from_publishers"),
        (("try_private false",), "in", "unknown"),
        (("try_private false", "bridge_protocol_version mqttv50"), "in", "from_publishers"),
    ],
)
def test_the_way_of_the_retain_flag(more, way, retain):
    _, bridge = carried(f"topic t {way}", *more)
    assert [route.target.settings["retain"].text for route in bridge.routes] == [retain]


@pytest.mark.parametrize(
    ("more", "back"),
    [((), False), (("try_private false",), True), (("try_private false", "bridge_protocol_version mqttv50"), False)],
)
def test_a_broker_that_does_not_know_the_bridge_sends_everything_back(more, back):
    system, bridge = carried("topic t both 1", *more)
    assert ("MQTT943" in {each.code for each in system.notes}) == back
    assert bridge.carries == (("own",) if back else ())


@pytest.mark.parametrize(
    ("topics", "back"),
    [
        (("topic t both",), ["t"]),
        (("topic t out", "topic t in"), ["t"]),
        (("topic t out",), None),
        (("topic t out", "topic u in"), None),
        (("topic # out", "topic t/+ in"), ["t/+"]),
        (("topic t/# out", "topic +/a in"), ["t/a"]),
        # Under another name it comes back as another topic.
        (('topic t out 0 "" far/', "topic t in"), None),
        (("topic t both 0 here/ far/",), ["here/t"]),
        (("topic t out 0 here/ far/", 'topic here/t in 0 "" far/'), None),
        (("topic t out 0 a/ x/", "topic b/t in 0 a/ x/"), None),
        (("topic b/t out 0 a/ x/", "topic t in 0 a/b/ x/b/"), ["a/b/t"]),
    ],
)
def test_what_a_broker_sends_back_is_named(topics, back):
    system, bridge = carried(*topics, "try_private false")
    here = {name: each.settings.get("brings_back") for name, each in system.participants.items()}
    assert [json.loads(each.text) for each in here.values() if each is not None] == ([] if back is None else [back])
    assert [name for name, each in here.items() if each is not None] == ([] if back is None else [bridge.id])
    assert [each.code for each in system.notes].count("MQTT943") == (0 if back is None else len(back))


def test_states_of_bridges_are_published_on_both_brokers():
    system, _ = carried("topic t out")
    assert {(each.topic, each.kind) for each in system.endpoints} == {("$SYS/broker/connection/+/state", "pattern")}
    assert len(system.endpoints) == 2
    system, _ = carried("topic t out", "notifications_local_only true", "notification_topic far/up")
    assert [each.topic for each in system.endpoints] == ["far/up"]
    assert carried("topic t out", "notifications false")[0].endpoints == []


CLIENTS = """cqos: 1
protocol: mqtt
participants:
  here: {broker: farm, client: {client_id: here}, publishes: {t: {qos: 2}}}
  there: {broker: barn, client: {client_id: there}, subscribes: {t: {qos: 2}}}
  back: {broker: farm, client: {client_id: back}, subscribes: {t: {qos: 2, needs: {duplicate_free: true}}}}
"""


def two(tmp_path, address, *more, port="1883"):
    """The report of two configurations and their clients, where the first bridges to an address."""
    lines = ("listener 1885", "connection out", f"address {address}", "topic t both 2", *more)
    (tmp_path / "farm.conf").write_text("\n".join(lines))
    (tmp_path / "barn.conf").write_text(f"listener {port}\n")
    (tmp_path / "clients.yaml").write_text(CLIENTS)
    return cqos.check(*(tmp_path / name for name in ("farm.conf", "barn.conf", "clients.yaml")))


@pytest.mark.parametrize(
    ("address", "port", "joined"),
    [
        ("barn:1883", "1883", True),
        ("barn.example", "1883", True),
        ("127.0.0.1:1884", "1884", True),
        ("far.example:1884", "1884", True),
        ("far.example:1883", "1883", False),
        ("barn.example:1886", "1884", False),
    ],
)
def test_configurations_of_bridged_brokers_are_one_system(tmp_path, address, port, joined):
    report = two(tmp_path, address, port=port)
    pairs = {(one, other) for group in report.groups for one in group.publishers for other in group.subscribers}
    assert any(one.startswith("out (farm)") and other.startswith("there") for one, other in pairs) == joined
    assert "CQ503" not in {finding.code for finding in report.findings}


def test_configurations_with_one_name_are_two_brokers(tmp_path):
    for name, lines in (
        ("farm", "listener 1885\nconnection out\naddress barn.example\ntopic t out\n"),
        ("barn", "listener 1883\n"),
    ):
        (tmp_path / name).mkdir()
        (tmp_path / name / "mosquitto.conf").write_text(lines)
    system = cqos.read(tmp_path / "farm" / "mosquitto.conf", tmp_path / "barn" / "mosquitto.conf")
    assert sorted(system.brokers) == ["mosquitto", "mosquitto#2"]
    assert system.participants["out (mosquitto at barn.example)"].settings["broker"].text == "mosquitto#2"


@pytest.mark.parametrize(("more", "twice"), [((), False), (("try_private false",), True)])
def test_copies_that_come_back_are_no_loop(tmp_path, more, twice):
    report = two(tmp_path, "barn:1883", *more)
    codes = {finding.code for finding in report.findings}
    assert ("CQ507" in codes) == twice
    assert "CQ503" not in codes


@pytest.mark.parametrize(
    ("lines", "why"),
    [
        ("connection b\naddress\ntopic x", "it needs a value"),
        ("connection b\naddress h\ntopic", "it needs a value"),
        ("topic x", "it belongs below a `connection`"),
        ("connection b\naddress h\ntopic x\nconnection b", "another connection has this name"),
        ("connection b\naddress h\ntopic x\ntry_private maybe", "expected true or false"),
    ],
)
def test_lines_that_mosquitto_refuses(lines, why):
    found = [each for each in cqos.read(lines.encode(), importer="mosquitto").notes if each.severity == "error"]
    assert {each.code for each in found} == {"MQTT940"}
    assert why in found[0].message


@pytest.mark.parametrize(
    ("lines", "found"),
    [
        ("max_qos 0\nlistener 1884", "cases"),
        ("listener 1884\nmax_qos 0", "0"),
        ("port 1885\nmax_qos 1", "1"),
        ("listener 1884\nmax_qos 0\nmax_qos 2", "2"),
        ("listener 1884\nmax_qos 1\nlistener 1885\nmax_qos 1", "1"),
    ],
)
def test_a_limit_of_one_listener_holds_there_only(lines, found):
    (broker,) = cqos.read(lines.encode(), importer="mosquitto").brokers.values()
    setting = broker.settings["maximum_qos"]
    assert ("cases" if setting.unknown else setting.text) == found


@pytest.mark.parametrize(
    ("line", "policy", "meant"),
    [
        ("max_qoss 1", "maximum_qos", "max_qos"),
        ("allow_anonymus true", EVERY_OTHER, "allow_anonymous"),
        ("bridge_keyfil a", EVERY_OTHER, "bridge_keyfile"),
        ("fast_mode true", EVERY_OTHER, None),
    ],
)
def test_a_directive_that_mosquitto_does_not_know_is_a_warning_and_what_it_may_set_unknown(
    line, policy, meant, tmp_path
):
    text = f"listener 0 127.0.0.1\n{line}\n"
    system = cqos.read(text.encode(), importer="mosquitto")
    assert [(each.code, each.severity) for each in system.notes] == [("CQ040", "warning")]
    assert system.notes[0].help == (f"write `{meant}`" if meant else "correct or remove it")
    (broker,) = system.brokers.values()
    assert broker.settings[policy].unknown
    if shutil.which("mosquitto"):
        (tmp_path / "a.conf").write_text(text)
        done = subprocess.run(
            ["mosquitto", "-c", tmp_path / "a.conf"], capture_output=True, text=True, timeout=60, check=False
        )
        assert done.returncode != 0
        assert f'Unknown configuration variable "{line.split()[0]}"' in done.stdout + done.stderr


def test_mosquitto_knows_two_directives_by_two_names():
    text = b"listener 1884\nmaximum_qos 1\nretained_persistence true\nauth_opt_db mine\ntls_keyform pem\n"
    system = cqos.read(text, importer="mosquitto")
    (broker,) = system.brokers.values()
    assert not system.notes
    assert {name: each.text for name, each in broker.settings.items()} == {"maximum_qos": "1", "persistence": "true"}


@pytest.mark.parametrize(
    ("text", "claimed"),
    [
        (b"listener 1884\n", True),
        (b"connection a\naddress far.example\ntopic t out\n", True),
        (b"connection string\n", False),
    ],
)
def test_configurations_are_recognised(text, claimed):
    from cqos_mqtt.importers.detect import claims_mosquitto

    assert claims_mosquitto("broker.conf", text) == claimed


@pytest.mark.parametrize(
    ("directive", "policy"),
    [("cleansesion true", "clean_start"), ("keepalive_intervall 5", "keep_alive"), ("bridge_protocol_versoin x", "*")],
)
def test_a_misspelt_directive_of_a_connection_leaves_unknown_what_it_may_have_set(directive, policy):
    system = cqos.read(f"connection b\naddress h\ntopic x out 1\n{directive}\n".encode(), importer="mosquitto")
    assert [each.code for each in system.notes] == ["CQ040"]
    wanted = "protocol_version" if policy == "*" else policy
    unknown = {name for each in system.participants.values() for name, to in each.settings.items() if to.unknown}
    assert unknown == {wanted}


def test_a_misspelt_topic_leaves_unknown_with_which_qos_topics_are_carried():
    system = cqos.read(b"connection b\naddress h\ntopic x out 1\ntopicc x out 2\n", importer="mosquitto")
    (bridge,) = system.bridges.values()
    assert [bool(route.source.settings["qos"].unknown) for route in bridge.routes] == [True]


def test_a_bridge_between_brokers_keeps_up(tmp_path):
    """No program stands between: nobody has to state how often a bridge of Mosquitto takes messages."""
    (tmp_path / "farm.conf").write_text("listener 1883\nconnection up\naddress barn:1884\ntopic t out 1\n")
    (tmp_path / "barn.conf").write_text("listener 1884\n")
    (tmp_path / "rest.yaml").write_text("""
cqos: 1
protocol: mqtt
topics: {t: {period: 1s}}
participants:
  device: {client: {client_id: device, broker: farm}, publishes: {t: {qos: 1}}}
  portal: {client: {client_id: portal, broker: barn}, subscribes: {t: {qos: 1, taken_every: 0ms, needs: {loss_free: true}}}}
""")
    report = cqos.check(tmp_path / "farm.conf", tmp_path / "barn.conf", tmp_path / "rest.yaml")
    assert "MQTT707" not in {each.code for each in report.findings}


NEAR = 'listener 1883\nconnection b\naddress far.example:1883\ntopic sensor out 2 "" up/\n'
FAR = "listener 1883\n"
FAR_CLIENTS = """cqos: 1
protocol: mqtt
{include}participants:
  pub: {{broker: near, client: {{client_id: p}}, publishes: {{sensor: {{qos: 0}}}}}}
  sub: {{broker: far, client: {{client_id: s}}, subscribes: {{up/sensor: {{qos: 0}}}}}}
"""


def test_files_that_are_included_are_joined_as_files_that_are_named(tmp_path):
    for name, text in (("near.conf", NEAR), ("far.conf", FAR), ("named.yaml", FAR_CLIENTS.format(include=""))):
        (tmp_path / name).write_text(text, encoding="utf-8")
    (tmp_path / "all.yaml").write_text(FAR_CLIENTS.format(include="include: [near.conf, far.conf]\n"), encoding="utf-8")
    named = cqos.check(*(tmp_path / each for each in ("named.yaml", "near.conf", "far.conf")))
    included = cqos.check(tmp_path / "all.yaml")
    assert [(each.topic, each.verdict, each.pairs) for each in included.groups] == [
        (each.topic, each.verdict, each.pairs) for each in named.groups
    ]
    assert {each.topic for each in included.groups} == {"sensor", "up/sensor"}


def test_a_broker_that_a_system_file_only_names_is_as_an_included_file_describes_it(tmp_path):
    (tmp_path / "near.conf").write_text(NEAR + "max_qos 1\n", encoding="utf-8")
    for stated in ("", "brokers: {near: {}}\n", "brokers: {near: }\n"):
        text = FAR_CLIENTS.format(include=f"include: near.conf\n{stated}").replace("broker: far", "broker: near")
        (tmp_path / "all.yaml").write_text(text, encoding="utf-8")
        broker = cqos.read(tmp_path / "all.yaml").brokers["near"]
        assert broker.settings["maximum_qos"].text == "1", stated
    (tmp_path / "second.yaml").write_text(
        "cqos: 1\nprotocol: mqtt\nbrokers: {near: {maximum_qos: 2}}\n", encoding="utf-8"
    )
    (tmp_path / "all.yaml").write_text(text.replace("near.conf", "[near.conf, second.yaml]"), encoding="utf-8")
    with pytest.raises(cqos.CqosError, match="broker `near` is stated twice, first at"):
        cqos.read(tmp_path / "all.yaml")


def test_a_system_file_describes_a_broker_that_a_bridge_names(tmp_path):
    (tmp_path / "near.conf").write_text(NEAR, encoding="utf-8")
    stated = 'include: near.conf\nbrokers: {"far.example:1883": {maximum_qos: 1}}\n'
    (tmp_path / "all.yaml").write_text(
        FAR_CLIENTS.format(include=stated).replace("broker: far", 'broker: "far.example:1883"'), encoding="utf-8"
    )
    report = cqos.check(tmp_path / "all.yaml")
    assert "MQTT201" in {each.code for each in report.findings}
    assert "up/sensor" in {each.topic for each in report.groups}


@pytest.mark.parametrize(
    ("address", "codes"),
    [
        ("x1-ats.iot.eu-west-1.amazonaws.com:8883", {"MQTT201"}),
        ("x1.iot.cn-north-1.amazonaws.com.cn", {"MQTT201"}),
        ("x1.iot.amazonaws.com.example:8883", set()),
        ("mqtt.example.com", set()),
    ],
)
def test_a_cloud_broker_is_known_by_its_address(address, codes):
    text = f"listener 1883\nconnection cloud\naddress {address}\ntopic position out 2\n"
    found = {each.code for each in cqos.check(text.encode(), importer="mosquitto").findings}
    assert found & {"MQTT201"} == codes


def test_what_a_system_states_of_a_cloud_broker_comes_before_its_address():
    text = b"""cqos: 1
protocol: mqtt
brokers: {"x1.iot.eu-west-1.amazonaws.com:8883": {maximum_qos: 2}}
participants: {pub: {publishes: {t: {qos: 2}}}, sub: {subscribes: {t: {qos: 2}}}}
"""
    assert "MQTT201" not in {each.code for each in cqos.check(text).findings}


def brokers(tmp_path, **lines):
    """Configurations of brokers, each with what stands below its listener; addresses are the names of their files."""
    for name, own in lines.items():
        (tmp_path / f"{name}.conf").write_text("\n".join(("listener 1883", *own)) + "\n")
    return cqos.check(*(tmp_path / f"{name}.conf" for name in lines))


def bridge_to(name, *topics):
    return (f"connection to_{name}", f"address {name}:1883", *(f"topic {each}" for each in topics))


BOTH = "# both 0"


@pytest.mark.parametrize(
    ("lines", "loops"),
    [
        # Measured on Mosquitto 2.0 (`tests/conformance/test_bridge_loops.py`).
        (
            {"a": (*bridge_to("b", BOTH), *bridge_to("c", BOTH)), "b": bridge_to("a", BOTH), "c": bridge_to("b", BOTH)},
            2,
        ),
        ({"a": bridge_to("b", BOTH), "b": bridge_to("a", BOTH)}, 1),
        ({"a": bridge_to("b", "# out"), "b": bridge_to("a", "# out")}, 1),
        ({"a": bridge_to("b", "# out"), "b": bridge_to("c", "# out"), "c": bridge_to("a", "# out")}, 1),
        ({"a": bridge_to("b", "# out 0 s/ r/"), "b": bridge_to("a", "# out 0 r/ s/")}, 1),
        ({"a": bridge_to("b", "+/status out"), "b": bridge_to("a", "site/# out")}, 1),
        ({"a": bridge_to("b", BOTH), "b": ()}, 0),
        ({"a": (*bridge_to("b", BOTH), "try_private false"), "b": ()}, 0),  # twice, which is MQTT943
        ({"a": bridge_to("b", BOTH), "b": bridge_to("c", BOTH), "c": ()}, 0),
        ({"a": bridge_to("h", BOTH), "b": bridge_to("h", BOTH), "h": ()}, 0),
        ({"a": bridge_to("b", "# out"), "b": bridge_to("a", "# in")}, 0),
        ({"a": bridge_to("b", "# out 0 s/ r/"), "b": bridge_to("a", "# out 0 q/ s/")}, 0),
        ({"a": bridge_to("b", "+/status out"), "b": bridge_to("a", "site/+/status out")}, 0),
    ],
)
def test_loops_follow_from_bridges_alone(tmp_path, lines, loops):
    found = [each for each in brokers(tmp_path, **lines).findings if each.code == "CQ503"]
    assert len(found) == loops
    assert all(each.severity == "error" for each in found)


def test_two_connections_to_one_broker_are_a_loop(tmp_path):
    once, again = bridge_to("h", BOTH), ("connection again", *bridge_to("h", BOTH)[1:])
    assert "CQ503" in {each.code for each in brokers(tmp_path, a=(*once, *again)).findings}


def test_what_access_control_keeps_back_is_no_loop(tmp_path):
    (tmp_path / "b.acl").write_text("topic read #\n")
    lines = {"a": bridge_to("b", BOTH), "b": (*bridge_to("a", BOTH), f"acl_file {tmp_path}/b.acl")}
    assert "CQ503" not in {each.code for each in brokers(tmp_path, **lines).findings}


def test_bridges_in_included_files_are_a_loop(tmp_path):
    for name, other in ("ab", "ba"):
        (tmp_path / f"{name}.d").mkdir()
        (tmp_path / f"{name}.d" / "bridge.conf").write_text("\n".join(bridge_to(other, BOTH)))
    report = brokers(tmp_path, a=(f"include_dir {tmp_path}/a.d",), b=(f"include_dir {tmp_path}/b.d",))
    assert "CQ503" in {each.code for each in report.findings}
