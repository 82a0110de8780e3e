"""Services and actions as their topics, in whole systems."""

import json
from typing import Any

import pytest

from cqos_core import Endpoint, Report, check
from cqos_ros2.interfaces import expand
from cqos_ros2.pack import PACK
from cqos_ros2.types import full_type_name


def system(participants: dict[str, Any], **more: Any) -> Report:
    document = {"cqos": 1, "protocol": "ros2", "participants": participants, **more}
    return check(json.dumps(document).encode(), importer="yaml", packs=[PACK])


def loud(report: Report) -> list[str]:
    return [finding.code for finding in report.findings if finding.severity != "note"]


def messages(report: Report) -> list[str]:
    return [finding.message for finding in report.findings]


KINDS = {
    "calls": "service_client",
    "serves": "service_server",
    "action_clients": "action_client",
    "action_servers": "action_server",
}


def test_a_server_is_a_subscription_and_a_publisher():
    server = expand(
        Endpoint(id="s", role="subscriber", topic="add", participant="adder", kind="service_server", type="pkg/Add")
    )
    assert [(part.id, part.role, part.kind, part.type) for part in server] == [
        ("s/request", "subscriber", "request", "pkg/srv/Add_Request"),
        ("s/response", "publisher", "response", "pkg/srv/Add_Response"),
    ]
    client = expand(Endpoint(id="c", role="publisher", topic="add", participant="asker", kind="service_client"))
    assert [(part.role, part.type) for part in client] == [("publisher", None), ("subscriber", None)]


def test_an_action_is_three_services_and_two_topics():
    server = expand(
        Endpoint(id="s", role="subscriber", topic="go", participant="robot", kind="action_server", type="nav/Go")
    )
    assert [(part.kind, part.role, part.profiles[0].name, part.type) for part in server] == [
        ("send_goal_request", "subscriber", "services_default", "nav/action/Go_SendGoal_Request"),
        ("send_goal_response", "publisher", "services_default", "nav/action/Go_SendGoal_Response"),
        ("cancel_goal_request", "subscriber", "services_default", "action_msgs/srv/CancelGoal_Request"),
        ("cancel_goal_response", "publisher", "services_default", "action_msgs/srv/CancelGoal_Response"),
        ("get_result_request", "subscriber", "services_default", "nav/action/Go_GetResult_Request"),
        ("get_result_response", "publisher", "services_default", "nav/action/Go_GetResult_Response"),
        ("feedback", "publisher", "default", "nav/action/Go_FeedbackMessage"),
        ("status", "publisher", "action_status_default", "action_msgs/msg/GoalStatusArray"),
    ]


def test_other_endpoints_stand_for_themselves():
    endpoint = Endpoint(id="e", role="publisher", topic="scan", participant="lidar")
    assert expand(endpoint) == (endpoint,)


def test_service_and_action_meet_on_all_their_topics():
    report = system(
        {
            "arm": {"serves": {"grasp": {}}, "action_servers": {"move": {}}},
            "planner": {"calls": {"grasp": {}}, "action_clients": {"move": {}}},
        }
    )
    assert (report.verdict, report.pair_count, loud(report)) == ("compatible", 10, [])


@pytest.mark.parametrize(
    ("client", "code"),
    [({"reliability": "best_effort"}, "ROS101"), ({"durability": "transient_local"}, "ROS102")],
)
def test_a_client_follows_the_same_rules(client: dict[str, str], code: str):
    report = system({"arm": {"serves": {"grasp": {}}}, "planner": {"calls": {"grasp": client}}})
    assert report.verdict == "incompatible"
    assert code in loud(report)


@pytest.mark.parametrize("key", ["calls", "action_clients"])
def test_a_client_without_server_is_one_warning(key: str):
    report = system({"planner": {key: {"grasp": {}}, "publishes": {"a": {}}}, "viewer": {"subscribes": {"a": {}}}})
    assert loud(report) == ["CQ401"]
    assert f"`planner/{KINDS[key]}/grasp` calls `grasp`, which no endpoint in the system serves" in messages(report)


@pytest.mark.parametrize("key", ["serves", "action_servers"])
def test_an_uncalled_server_is_only_a_note(key: str):
    report = system({"arm": {key: {"grasp": {}}, "publishes": {"a": {}}}, "viewer": {"subscribes": {"a": {}}}})
    assert loud(report) == []
    assert [finding.code for finding in report.findings].count("CQ402") == 1
    assert f"`arm/{KINDS[key]}/grasp` serves `grasp`, which no endpoint in the system calls" in messages(report)


def test_several_uncalled_servers_share_one_finding():
    report = system({"arm": {"serves": {"/grasp": {}}}, "hand": {"serves": {"/grasp": {}}}})
    said = "`arm/service_server/grasp` and 1 more serve `/grasp`, which no endpoint in the system calls"
    assert said in messages(report)


def test_a_topic_of_the_name_of_a_service_is_another_thing():
    report = system(
        {
            "arm": {"serves": {"grasp": {}}},
            "viewer": {"publishes": {"grasp": {}}, "subscribes": {"grasp": {}}},
        }
    )
    assert report.pair_count == 1


@pytest.mark.parametrize(
    ("written", "kind", "full"),
    [
        ("std_msgs/msg/String", "msg", "std_msgs/msg/String"),
        ("std_msgs/String", "msg", "std_msgs/msg/String"),
        ("std_srvs/Empty", "srv", "std_srvs/srv/Empty"),
        ("std_msgs.msg.String", "msg", "std_msgs/msg/String"),
        ("std_msgs::msg::String", "msg", "std_msgs/msg/String"),
        ("std_msgs::msg::dds_::String_", "msg", "std_msgs/msg/String"),
        ("String", "msg", "String"),
        ("a/b/c/d", "msg", "a/b/c/d"),
        (" ", "msg", ""),
    ],
)
def test_spellings_of_a_type(written: str, kind: str, full: str):
    assert full_type_name(written, kind) == full
