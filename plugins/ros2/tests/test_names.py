"""Names: what rcl makes of them, and what becomes of names that were written for people."""

import re
import string

import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from cqos_core.packs import NameContext
from cqos_ros2 import names
from cqos_ros2.interfaces import WIRE
from cqos_ros2.pack import PACK


def context(
    namespace: str | None = None,
    participant: str = "driver",
    remap: dict[str, str] | None = None,
    kind: str = "message",
    dialect: str = "yaml",
) -> NameContext:
    settings = {} if namespace is None else {"namespace": namespace}
    return NameContext(participant, None, settings, remap or {}, kind, dialect)


@pytest.mark.parametrize(
    ("written", "namespace", "full"),
    [
        # the table of design.ros2.org, "topic and service names"
        ("ping", "/", "/ping"),
        ("ping", "/my_ns", "/my_ns/ping"),
        ("/ping", "/my_ns", "/ping"),
        ("~", "/my_ns", "/my_ns/driver"),
        ("~/ping", "/my_ns", "/my_ns/driver/ping"),
        ("~/ping", "/", "/driver/ping"),
        ("foo/bar", "/my_ns", "/my_ns/foo/bar"),
        ("{node}/ping", "/my_ns", "/my_ns/driver/ping"),
        ("{ns}/ping", "/my_ns", "/my_ns/ping"),
        ("/other/{node}", "/my_ns", "/other/driver"),
        # rclcpp puts the first slash before a namespace
        ("ping", "my_ns", "/my_ns/ping"),
        ("ping", "", "/ping"),
        ("ping", "/a/b", "/a/b/ping"),
        # blanks around a name are stripped
        ("  ping ", "/", "/ping"),
    ],
)
def test_names_are_expanded_as_rcl_does_it(written: str, namespace: str, full: str):
    assert names.resolve(written, context(namespace)) == (full, full, ())


def test_a_namespace_with_a_slash_at_its_end_is_refused():
    key, shown, (problem,) = names.resolve("ping", context("/my_ns/"))
    assert (key, shown, problem.code, problem.severity) == ("/my_ns/ping", "/my_ns/ping", "ROS405", "error")
    assert problem.message == "`/my_ns/` is no namespace of ROS 2: it ends with a slash, so the node does not start"


@pytest.mark.parametrize(
    ("written", "remap", "full"),
    [
        ("scan", {"scan": "front_scan"}, "/ns/front_scan"),
        ("scan", {"scan": "/scan"}, "/scan"),
        ("scan", {"/ns/scan": "/scan"}, "/scan"),
        ("/ns/scan", {"scan": "lidar"}, "/ns/lidar"),
        ("~/scan", {"~/scan": "/scan"}, "/scan"),
        ("scan", {"scan": "~/scan"}, "/ns/driver/scan"),
        # another name, another namespace, a part of the name
        ("scan", {"/scan": "/lidar"}, "/ns/scan"),
        ("scan_raw", {"scan": "lidar"}, "/ns/scan_raw"),
        # the first that matches is the only one
        ("scan", {"scan": "a", "/ns/scan": "b"}, "/ns/a"),
        ("scan", {"scan": "a", "a": "b"}, "/ns/a"),
        # a swap
        ("left", {"left": "right", "right": "left"}, "/ns/right"),
        # the node's own name and namespace are no topics
        ("scan", {"__ns": "/other", "__node": "other"}, "/ns/scan"),
    ],
)
def test_the_first_remapping_of_the_same_full_name_replaces_it(written: str, remap: dict[str, str], full: str):
    assert names.resolve(written, context("/ns", remap=remap)).key == full


def test_a_participant_may_be_named_in_full():
    assert names.resolve("scan", context(participant="/robot/driver")).key == "/robot/scan"
    assert names.resolve("~/scan", context(participant="/robot/driver")).key == "/robot/driver/scan"
    assert names.resolve("scan", context("/other", participant="/robot/driver")).key == "/other/scan"


@pytest.mark.parametrize("written", ["", "   ", "\n"])
def test_no_name_is_no_topic(written: str):
    assert names.resolve(written, context()).key is None


@pytest.mark.parametrize(
    "written", ["a b", "a-b", "a//b", "a/", "/", "3d", "/a/3d", "~a", "a~b", "{what}/a", "ä", "a" * 247]
)
def test_what_rcl_refuses_is_an_error_with_a_legal_proposal(written: str):
    (problem,) = names.resolve(written, context()).problems
    assert (problem.code, problem.severity) == ("ROS405", "error")
    proposal = problem.help.split("`")[1]
    assert names.is_legal(proposal)


def test_the_longest_name_counts_its_slash():
    assert names.resolve("a" * 246, context()).problems == ()


@pytest.mark.parametrize(
    ("text", "full"),
    [
        ("Req weather data", "/req_weather_data"),
        ("resp-weather-data", "/resp_weather_data"),
        ("Req\nweather  data ", "/req_weather_data"),
        # legal names stay as they are
        ("req_weather_data", "/req_weather_data"),
        ("ReqWeather", "/ReqWeather"),
        ("/scan", "/scan"),
        ("robot/scan", "/robot/scan"),
    ],
)
def test_free_text_with_an_obvious_name_is_converted_silently(text: str, full: str):
    naming = names.resolve(text, context(dialect="bpmn"))
    assert (naming.key, naming.problems) == (full, ())


@pytest.mark.parametrize(
    ("text", "full"),
    [
        ("Tür auf!", "/tur_auf"),
        ("straße", "/strasse"),
        ("3D scan", "/topic_3d_scan"),
        ("Start / Stop", "/start/stop"),
        ("weather (raw)", "/weather_raw"),
        ("天气", "/u5929_u6c14"),
        ("!!!", "/u21_u21_u21"),
        ("/", "/u2f"),
        ("<b>alarm</b>", "/b_alarm/b"),
    ],
)
def test_free_text_that_changes_more_is_a_note(text: str, full: str):
    naming = names.resolve(text, context(dialect="bpmn"))
    assert (naming.key, naming.shown) == (full, text)
    assert [(problem.code, problem.severity) for problem in naming.problems] == [("ROS405", "note")]


def test_messages_keep_the_words_of_the_design():
    naming = names.resolve("Req weather data", context("/field", dialect="bpmn"))
    assert naming == ("/field/req_weather_data", "Req weather data", ())


def test_invisible_marks_do_not_change_a_name():
    left_to_right = names.resolve("Req\u200e weather\u200f data", context(dialect="bpmn"))
    assert left_to_right.key == "/req_weather_data"


def test_free_text_is_remapped_as_text():
    remap = {"Req weather data": "Weather requests"}
    naming = names.resolve("Req weather data", context(remap=remap, dialect="bpmn"))
    assert naming == ("/weather_requests", "/weather_requests", ())


def test_hidden_and_repeated_underscores_are_notes():
    assert [p.code for p in names.resolve("_a__b", context()).problems] == ["ROS407", "ROS408"]
    assert names.resolve("a_b_", context()).problems == ()


def test_services_and_actions_have_names_on_the_wire():
    naming = names.resolve("add", context("/ns", kind="request"))
    assert naming == ("rq/ns/addRequest", "/ns/add (request)", ())
    assert names.resolve("add", context("/ns", kind="response")).key == "rr/ns/addReply"
    naming = names.resolve("go", context("/ns", kind="send_goal_request"))
    assert naming == ("rq/ns/go/_action/send_goalRequest", "/ns/go (send_goal request)", ())
    assert names.resolve("go", context("/ns", kind="feedback")).key == "/ns/go/_action/feedback"


def test_a_service_is_remapped_by_its_own_name():
    assert names.resolve("add", context(remap={"add": "/sum"}, kind="request")).key == "rq/sumRequest"


def test_an_illegal_name_of_an_action_is_one_problem():
    problems = [problem for kind in WIRE for problem in names.resolve("go there", context(kind=kind)).problems]
    assert len(problems) == 2  # once as a service, once as an action: an endpoint is one of them


token = st.text(string.ascii_letters + string.digits + "_", min_size=1).filter(lambda t: not t[0].isdigit())
legal = st.lists(token, min_size=1, max_size=4).map(lambda parts: "/" + "/".join(parts)).filter(lambda n: len(n) <= 247)
anything = st.text(max_size=40)


@given(legal)
def test_a_legal_full_name_is_left_alone(name: str):
    assert names.is_legal(name)
    assert names.resolve(name, context("/ns")).key == name
    assert names.resolve(name, context("/ns", dialect="bpmn")).key == name
    assert names.legal_name(name) == name


@given(anything)
@example("~")
@example("/")
@example("//a")
@example("a" * 300)
@example("天" * 100)
def test_every_text_has_a_legal_name_and_only_one(text: str):
    name = names.legal_name(text)
    assert names.legal_name(name) == name
    if text.strip():
        assert names.is_legal(name if name.startswith("/") else f"/{name}")


@given(anything, anything, st.sampled_from(["message", "request", "feedback"]), st.sampled_from(["yaml", "bpmn"]))
def test_nothing_that_is_written_stops_the_reading(written: str, namespace: str, kind: str, dialect: str):
    naming = names.resolve(written, context(namespace, kind=kind, dialect=dialect))
    if not written.strip():
        assert naming.key is None
    elif dialect == "yaml" and kind == "message" and not naming.problems:
        assert naming.key is not None
        assert names.is_legal(naming.key)
    elif dialect == "bpmn":
        assert all(problem.severity == "note" for problem in naming.problems)


@given(legal, legal, legal)
def test_a_remapping_to_itself_changes_nothing(name: str, other: str, target: str):
    assert names.resolve(name, context(remap={name: name, other + "_": target})).key == name


@given(
    st.text("aB1_/~{} -:é", max_size=12),
    st.sampled_from(("/a", "a", "a/b", "/", "ä", "A b")),
    st.sampled_from((None, "", "/", "/x/", "n s")),
    st.sampled_from(("message", *WIRE)),
    st.sampled_from(("yaml", "bpmn")),
    st.sampled_from(("", "fastdds", "zenoh_bridge")),
)
def test_what_stands_before_plain_names(name, participant, namespace, kind, dialect, rmw):
    """The law of `TopicMatching.before`."""
    settings = {} if namespace is None else {"namespace": namespace}
    context = NameContext(participant, None, {**settings, "rmw": rmw} if rmw else settings, {}, kind, dialect)
    before, is_plain = names.before(context), re.compile(PACK.topic_matching.plain).fullmatch
    full = name if is_plain(name) else f"{before}{name}"
    if before is not None and is_plain(full):
        assert names.resolve(name, context) == (full, full, ())
