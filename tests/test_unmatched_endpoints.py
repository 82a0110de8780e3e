"""Endpoints without partner: names that nearly agree with those of others, and names of other protocols."""

from cqos_core import check


def said(text, code):
    return [(each.severity.value, each.help) for each in check(text.encode()).findings if each.code == code]


def test_topics_of_nearly_one_name_and_two_types_have_a_hint():
    text = """cqos: 1
protocol: ros2
participants:
  one: {publishes: {/imu/data: {type: a/msg/I}}}
  two: {subscribes: {/imu_data: {type: a/msg/J}}}
"""
    assert said(text, "CQ401") == [("warning", "did you mean `/imu/data`, although the types differ?")]
    assert said(text, "CQ402") == [("note", "did you mean `/imu_data`, although the types differ?")]
    ((severity, _),) = said(text.replace("msg/J", "msg/I"), "CQ403")
    assert severity == "warning"
    numbered = text.replace("/imu/data", "/imu1/2").replace("/imu_data", "/imu1_2")
    assert "did you mean" not in said(numbered, "CQ401")[0][1]


def test_the_same_name_in_another_protocol_is_a_hint():
    text = """cqos: 1
participants:
  one: {protocol: dds, publishes: {Reading: {}}}
  two: {protocol: mqtt, subscribes: {Reading: {}}}
"""
    ((_, hint),) = said(text, "CQ401")
    assert "`one/publisher/Reading` publishes the same name by DDS" in hint
    assert "bridge" in hint
    ((_, hint),) = said(text, "CQ402")
    assert "`two/subscriber/Reading` subscribes to the same name by MQTT" in hint
    # Nodes of ROS 2 and programs of DDS meet under names of the wire.
    ((_, hint),) = said(text.replace("mqtt", "ros2").replace("{Reading: {}}", "{/chatter: {}}"), "CQ401")
    assert "bridge" not in hint
