"""What is written for ROS 2: as it should look, as its own readers read it, and as nothing but itself."""

import ast
import os
import shutil
import subprocess
from dataclasses import replace
from pathlib import Path
from typing import Literal

import pytest
import yaml
from hypothesis import given
from hypothesis import strategies as st

import cqos_core as cqos
from cqos_core import Endpoint, Participant, Profile, ProfileRef, Setting, System
from cqos_core.api import context
from cqos_core.files.source_reader import read_source
from cqos_core.files.system_merge import merge
from cqos_core.model.source import Source
from cqos_core.packs.export import ExportContext
from cqos_core.plugins import load_plugins
from tests.command_process import run_here

Role = Literal["publisher", "subscriber"]
HERE = Path(__file__).parent
EXAMPLES = HERE.parents[3] / "examples"
GOLDEN = HERE / "golden"
WHERE = context()
FORMS = [
    ("qos_overrides", {}, "qos_overrides.yaml"),
    ("rosbag2_overrides", {"side": "player"}, "player.yaml"),
    ("rosbag2_overrides", {"side": "recorder"}, "recorder.yaml"),
    ("rclpy", {}, "qos.py"),
    ("rclcpp", {}, "qos.hpp"),
]


def export(system, name, changed=None, **chosen):
    info = load_plugins().exporters[name]
    chosen = {name: values[0] for name, values in info.choices().items()} | chosen
    return info.load()(system, ExportContext(WHERE.find_pack, settings=chosen, changed=changed))


def every():
    return cqos.read(HERE / "every.yaml")


@pytest.mark.parametrize(("name", "chosen", "file"), FORMS, ids=[file for *_, file in FORMS])
def test_golden(name, chosen, file):
    exported = export(every(), name, **chosen)
    notes = "".join(f"{note}\n" for note in exported.notes)
    written = {GOLDEN / f"{file}.txt": exported.text, GOLDEN / f"{file}.notes.txt": notes}
    if os.environ.get("UPDATE_GOLDEN"):
        for path, text in written.items():
            path.write_text(text, encoding="utf-8")
    assert written == {path: path.read_text(encoding="utf-8") for path in written}


@pytest.mark.parametrize(("name", "chosen", "file"), FORMS, ids=[file for *_, file in FORMS])
def test_nothing_is_written_of_nothing(name, chosen, file):
    del file
    exported = export(System("empty", "ros2"), name, **chosen)
    assert (exported.text, exported.expressed) == ("", 0)


# Code


def test_python_code_is_python():
    module = ast.parse(export(every(), "rclpy").text)
    names = [ast.unparse(target) for each in module.body if isinstance(each, ast.Assign) for target in each.targets]
    assert len(names) == len(set(names)) > 0
    assert all(name.isidentifier() for name in names)


RCLCPP = """
#pragma once
#include <chrono>
#include <cstddef>
#include <cstdint>
#define POLICY(kind) enum kind { kind ## _any };
enum rmw_h { RMW_QOS_POLICY_HISTORY_SYSTEM_DEFAULT };
enum rmw_r { RMW_QOS_POLICY_RELIABILITY_SYSTEM_DEFAULT, RMW_QOS_POLICY_RELIABILITY_BEST_AVAILABLE };
enum rmw_d { RMW_QOS_POLICY_DURABILITY_SYSTEM_DEFAULT, RMW_QOS_POLICY_DURABILITY_BEST_AVAILABLE };
enum rmw_l { RMW_QOS_POLICY_LIVELINESS_MANUAL_BY_TOPIC, RMW_QOS_POLICY_LIVELINESS_MANUAL_BY_NODE };
namespace rclcpp {
struct Duration { template<class R, class P> Duration(const std::chrono::duration<R, P> &) {} };
struct QoSInitialization { QoSInitialization(rmw_h, size_t) {} };
struct KeepAll : QoSInitialization { KeepAll() : QoSInitialization(RMW_QOS_POLICY_HISTORY_SYSTEM_DEFAULT, 0) {} };
struct KeepLast : QoSInitialization { explicit KeepLast(size_t d) : QoSInitialization(RMW_QOS_POLICY_HISTORY_SYSTEM_DEFAULT, d) {} };
class QoS {
public:
  explicit QoS(const QoSInitialization &) {}
  QoS & reliable() { return *this; }
  QoS & best_effort() { return *this; }
  QoS & transient_local() { return *this; }
  QoS & durability_volatile() { return *this; }
  QoS & reliability(rmw_r) { return *this; }
  QoS & durability(rmw_d) { return *this; }
  QoS & liveliness(rmw_l) { return *this; }
  QoS & deadline(const Duration &) { return *this; }
  QoS & lifespan(const Duration &) { return *this; }
  QoS & liveliness_lease_duration(const Duration &) { return *this; }
  QoS & avoid_ros_namespace_conventions(bool) { return *this; }
};
}
"""


NANOSECONDS = {"seconds": 1_000_000_000, "nanoseconds": 1}


def read_python(node):
    """The value of an expression of the written code: a word of an enumeration, nanoseconds, a count or a flag."""
    if isinstance(node, ast.Constant):
        return node.value
    if isinstance(node, ast.Attribute):
        return node.attr.lower()
    assert isinstance(node, ast.Call)
    assert ast.unparse(node.func) == "Duration"
    return sum(NANOSECONDS[each.arg or ""] * read_python(each.value) for each in node.keywords)


def profiles_of(code):
    """Every `QoSProfile` of a module by the id of its endpoint, which stands in the comment above it."""
    module, lines, found = ast.parse(code), code.splitlines(), {}
    imported = {alias.name for each in module.body if isinstance(each, ast.ImportFrom) for alias in each.names}
    for each in module.body:
        if isinstance(each, ast.Assign):
            assert isinstance(each.value, ast.Call)
            used = {node.id for node in ast.walk(each.value) if isinstance(node, ast.Name)}
            assert used <= imported
            identifier = lines[each.lineno - 2].rpartition("(")[2].removesuffix(")")
            found[identifier] = {keyword.arg: read_python(keyword.value) for keyword in each.value.keywords}
    return found


DURATIONS = {"deadline", "lifespan", "liveliness_lease_duration"}
ABSENT = {
    **dict.fromkeys(DURATIONS, 0),
    "liveliness": "system_default",
    "avoid_ros_namespace_conventions": False,
}
"""What `QoSProfile` takes for a policy that is not named; the others always are."""


@pytest.mark.skipif(shutil.which("g++") is None, reason="there is no g++")
def test_cpp_code_compiles(tmp_path):
    (tmp_path / "rclcpp").mkdir()
    (tmp_path / "rclcpp" / "qos.hpp").write_text(RCLCPP, encoding="utf-8")
    system = every()
    system.name = "ends in a backslash \\"
    (tmp_path / "all.hpp").write_text(export(system, "rclcpp").text, encoding="utf-8")
    (tmp_path / "all.cpp").write_text('#include "all.hpp"\n', encoding="utf-8")
    command = ["g++", "-std=c++17", "-Wall", "-Wextra", "-Werror", "-fsyntax-only", "-I.", "all.cpp"]
    done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, check=False, timeout=60)
    assert (done.returncode, done.stderr) == (0, "")


@pytest.mark.parametrize("text", ["*/ x", '"""', "a\nimport os", "\\", "\x1b[0m", "//", "'", "\u2028"])
def test_no_text_gets_out_of_its_comment(text):
    system = every()
    system.name = text
    system.endpoints[0].id = text
    for name, mark in (("rclpy", "#"), ("rclcpp", "//")):
        plain = export(every(), name).text.splitlines()
        strange = export(system, name).text.splitlines()
        assert [line for line in strange if not line.startswith(mark)] == [
            line for line in plain if not line.startswith(mark)
        ]
        assert not any(line.endswith("\\") for line in strange)
    ast.parse(export(system, "rclpy").text)


# Round trips

VALUES = {
    "history": ["keep_last", "keep_all"],
    "depth": ["1", "7", "0"],
    "reliability": ["reliable", "best_effort"],
    "durability": ["volatile", "transient_local"],
    "deadline": ["1s", "500ms", "infinite", "3ns"],
    "lease_duration": ["2s", "infinite"],
    "liveliness": ["automatic", "manual_by_topic"],
    "lifespan": ["10s"],
    "avoid_ros_namespace_conventions": ["true", "false"],
}
WORDS = {
    **VALUES,
    **{name: [*VALUES[name], "best_available"] for name in ("deadline", "lease_duration")},
    **{
        name: [*VALUES[name], "best_available", "system_default"]
        for name in ("reliability", "durability", "liveliness")
    },
    "history": [*VALUES["history"], "system_default"],
    "depth": [*VALUES["depth"], "system_default"],
}
"""Also those whose meaning depends on the middleware, or on who is met."""


@st.composite
def robots(draw, values=WORDS):
    stated = st.fixed_dictionaries({}, optional={name: st.sampled_from(v).map(Setting) for name, v in values.items()})
    system = System("robot", "ros2")
    system.profiles["mine"] = Profile("mine", draw(stated))
    for name in ("a", "/ns/b"):
        system.participants[name] = Participant(name)
        for topic in draw(st.sets(st.sampled_from(["scan", "/map", "~/pose"]))):
            for role in draw(st.sets(st.sampled_from(["publisher", "subscriber"]))):
                refs = draw(st.sampled_from([(), ("mine",), ("sensor_data",)]))
                system.endpoints.append(
                    Endpoint(
                        id=f"{name}/{role}/{topic}",
                        role=role,
                        topic=topic,
                        participant=name,
                        settings=draw(stated),
                        profiles=tuple(map(ProfileRef, refs)),
                    )
                )
    return system


def stripped(system):
    """The system without any setting of an endpoint: what the programs would do by themselves."""
    return replace(system, endpoints=[replace(each, settings={}, profiles=()) for each in system.endpoints])


MIDDLEWARES = st.sampled_from(["fastdds", "cyclonedds", "connext", "zenoh"])
"""With one stated, the meaning of `system_default` is known."""


def differences(system, other, rmw):
    """Policies that two systems give different values, but those that have no parameter."""
    found = cqos.diff(system, other, options={"ros2": {"rmw": rmw}})
    assert not found.missing
    assert found.matched == len(system.endpoints)
    named = {*VALUES, "liveliness_lease_duration"}
    return [
        each
        for each in found.different
        if each.policy in named and (each.policy, each.a.kind) != ("lifespan", "subscriber")
    ]


def verdicts(system):
    if not system.endpoints:
        return []
    return sorted((each.topic, each.publisher, each.subscriber, each.verdict) for each in cqos.check(system).pairs)


@given(robots(), MIDDLEWARES)
def test_overrides_make_of_bare_nodes_what_was_designed(system, rmw):
    exported = export(system, "qos_overrides")
    if not exported.expressed:
        assert not any(each.settings.keys() - {"lifespan"} for each in system.endpoints if each.role == "subscriber")
        return
    overrides = read_source(Source("params.yaml", exported.text.encode()), "qos_overrides")
    again = merge([stripped(system), overrides])
    assert [note for note in overrides.notes if note.severity == "error"] == []
    assert not differences(again, system, rmw)
    assert verdicts(again) == verdicts(system)


@pytest.mark.parametrize("name", ["mobile_robot.yaml", "robot_directory", "smart_agriculture_incompatible.bpmn"])
def test_with_overrides_bare_nodes_get_the_verdicts_of_the_design(name):
    system = cqos.read(EXAMPLES / name)
    exported = export(system, "qos_overrides")
    overrides = read_source(Source("params.yaml", exported.text.encode()), "qos_overrides")
    # Notes name the endpoints that the form cannot express; only those keep their own settings.
    noted = {each.id for each in system.endpoints if any(f"`{each.id}`" in note for note in exported.notes)}
    noted = {each for each in noted if not any(f"`{each}`: subscriptions have no" in note for note in exported.notes)}
    bare = [
        each if each.id in noted or each.observed else replace(each, settings={}, profiles=())
        for each in system.endpoints
    ]
    assert len(noted) < len(system.endpoints) / 2
    again = merge([replace(system, endpoints=bare), overrides])
    assert verdicts(again) == verdicts(system)
    assert verdicts(replace(system, endpoints=bare, overlays=[])) != verdicts(system)


@given(robots(), MIDDLEWARES)
def test_python_code_states_what_was_designed(system, rmw):
    stated = profiles_of(export(system, "rclpy").text) if system.endpoints else {}
    written = replace(
        system,
        endpoints=[
            replace(
                each,
                profiles=(),
                settings={name: Setting(str(value).lower()) for name, value in (ABSENT | stated[each.id]).items()},
                dialect="parameters",  # nanoseconds, as `Duration` has them
            )
            for each in system.endpoints
        ],
    )
    assert not differences(written, system, rmw)
    assert verdicts(written) == verdicts(system)


@given(robots(VALUES))
def test_a_player_meets_every_subscription_and_a_recorder_every_publisher(system):
    sides: list[tuple[str, Role, Role]] = [
        ("player", "publisher", "subscriber"),
        ("recorder", "subscriber", "publisher"),
    ]
    for side, role, other in sides:
        profiles = yaml.safe_load(export(system, "rosbag2_overrides", side=side).text) or {}
        met = replace(system, endpoints=[each for each in system.endpoints if each.role == other])
        bag = System("bag", "ros2", participants={"bag": Participant("bag", external=True)})
        for topic, profile in profiles.items():
            if "avoid_ros_namespace_conventions" in profile:
                continue
            stated = {name: Setting(str(value)) for name, value in profile.items()}
            bag.endpoints.append(
                Endpoint(id=f"bag{topic}", role=role, topic=topic, participant="bag", settings=stated, dialect="rosbag")
            )
        report = cqos.check(merge([replace(met, participants=dict(met.participants)), bag]))
        assert {pair.verdict for pair in report.pairs} <= {"compatible"}


@pytest.mark.parametrize("side", ["player", "recorder"])
def test_rosbag2_overrides_are_read_by_their_reader(side):
    text = export(every(), "rosbag2_overrides", side=side).text
    system = read_source(Source("qos.yaml", text.encode()), "rosbag2_overrides")
    assert [note.message for note in system.notes] == []
    assert len(system.overlays) == text.count("history:")


BAG = """rosbag2_bagfile_information:
  version: 9
  topics_with_message_count:
"""


@given(robots(VALUES), st.sampled_from(["player", "recorder"]))
def test_a_bag_with_the_written_overrides_fits_the_system(system, side):
    """Through both readers: the bag as `ros2 bag` plays or records it, and the file as it takes it."""
    exported = export(system, "rosbag2_overrides", side=side)
    if not exported.expressed:
        return
    topics = yaml.safe_load(exported.text)
    if any("avoid_ros_namespace_conventions" in profile for profile in topics.values()):
        return
    bag = BAG + "".join(
        f"    - {{topic_metadata: {{name: {topic}, offered_qos_profiles: []}}, message_count: 1}}\n" for topic in topics
    )
    switches = {"rosbag2": {"as": side}}
    sources = (Source("metadata.yaml", bag.encode()), Source("qos.yaml", exported.text.encode()))
    other = "subscriber" if side == "player" else "publisher"
    met = replace(system, endpoints=[each for each in system.endpoints if each.role == other])
    whole = merge(
        [replace(met, participants=dict(met.participants)), *(read_source(each, None, switches) for each in sources)]
    )
    report = cqos.check(whole)
    assert {pair.verdict for pair in report.pairs} <= {"compatible"}
    assert "CQ214" not in [finding.code for finding in report.findings]


WITH_BAG = """
cqos: 1
protocol: ros2
participants:
  rosbag2_player: {publishes: {/scan: {reliability: best_effort}}}
  camera: {publishes: {/image: {reliability: best_effort}}}
  viewer: {subscribes: {/scan: {reliability: reliable}, /image: {reliability: reliable}}}
"""


@pytest.mark.parametrize("fixed", [False, True])
def test_what_is_not_in_the_bag_needs_no_override(fixed):
    system = cqos.read(WITH_BAG.encode())
    changed = frozenset(("viewer/subscriber/" + topic, "reliability") for topic in ("scan", "image"))
    exported = export(system, "rosbag2_overrides", changed=changed if fixed else None, side="player")
    assert list(yaml.safe_load(exported.text)) == ["/scan"]
    # A note names the missing topic only if a fix was asked for it.
    said = "`/image` is not in the bag, so there is nothing to override"
    assert exported.notes == ((said,) if fixed else ())


@pytest.mark.parametrize(("stated", "written"), [("system_default", None), ("manual_by_topic", "manual_by_topic")])
def test_a_word_whose_meaning_is_known_is_no_worst_case(stated, written):
    """Liveliness `system_default`, which all presets have, is automatic on every middleware."""
    design = f"cqos: 1\nprotocol: ros2\nparticipants: {{a: {{subscribes: {{/t: {{liveliness: {stated}}}}}}}}}\n"
    (profile,) = yaml.safe_load(export(cqos.read(design.encode()), "rosbag2_overrides").text).values()
    assert profile.get("liveliness") == written


@pytest.mark.parametrize(
    ("rmw", "reliability"), [("fastdds", "best_effort"), ("cyclonedds", "reliable"), (None, "reliable")]
)
def test_what_depends_on_the_middleware_is_known_where_that_is_stated(rmw, reliability):
    design = "cqos: 1\nprotocol: ros2\nparticipants: {a: {subscribes: {/t: {reliability: system_default}}}}\n"
    options = {} if rmw is None else {"ros2": {"rmw": Setting(rmw)}}
    system = replace(cqos.read(design.encode()), options=options)
    (profile,) = yaml.safe_load(export(system, "rosbag2_overrides").text).values()
    assert profile["reliability"] == reliability


# Who takes no parameters

TOOLS = """
cqos: 1
protocol: ros2
participants:
  rosbag2_player: {publishes: {/scan: {reliability: best_effort}}}
  rviz2: {subscribes: {/scan: {reliability: reliable}, /tf: {depth: 100}}}
  driver: {publishes: {/scan: {observed: true, reliability: best_effort}}}
"""


def test_notes_name_nodes_that_take_their_qos_from_elsewhere():
    exported = export(cqos.read(TOOLS.encode()), "qos_overrides")
    assert yaml.safe_load(exported.text) == {
        "/rviz2": {"ros__parameters": {"qos_overrides": {"/tf": {"subscription": {"depth": 100}}}}},
        "/driver": {"ros__parameters": {"qos_overrides": {"/scan": {"publisher": {"reliability": "best_effort"}}}}},
    }
    assert exported.notes == (
        "`rosbag2_player/publisher/scan`: `ros2 bag play` takes its QoS from `--qos-profile-overrides-path`, not from parameters",
        "`rviz2/subscriber/scan`: RViz takes its QoS from its configuration, not from parameters",
    )


def test_a_remedy_for_what_was_observed_shows_in_a_new_snapshot_only(tmp_path):
    design = TOOLS.replace("rosbag2_player", "planner").replace(
        "publishes: {/scan: {reliability: best_effort", "subscribes: {/scan: {depth: 5"
    )
    notes = fixed(tmp_path, design).err
    assert "fixed: offer reliability `reliable` on driver/publisher/scan (for ROS101)" in notes
    assert (
        "`driver/publisher/scan` was observed as it was: a new snapshot shows whether it was started with this" in notes
    )


# Remedies

CLASH = """
cqos: 1
protocol: ros2
participants:
  lidar: {publishes: {/scan: [{id: front, reliability: best_effort}, {id: rear, reliability: best_effort}]}}
  planner: {subscribes: {/scan: {reliability: reliable, deadline: 2s}, /map: {durability: transient_local}}}
  maps: {publishes: {/map: {}}}
"""


def fixed(folder, design, *options):
    """What `cqos convert --fix` writes."""
    (folder / "design.yaml").write_text(design)
    done = run_here(["convert", "design.yaml", "--to", "qos_overrides", "--fix", *options], folder)
    assert done.code == 0
    return done


def test_only_what_fixes_is_written(tmp_path):
    text = fixed(tmp_path, CLASH).out
    written = yaml.safe_load(text)
    assert written == {
        "/lidar": {"ros__parameters": {"qos_overrides": {"/scan": {"publisher": {"reliability": "reliable"}}}}},
    }
    left = {finding.code for finding in cqos.check(CLASH.encode(), text.encode()).findings}
    assert "ROS101" not in left


def test_what_nodes_take_from_no_parameter_by_default_is_no_remedy(tmp_path):
    notes = fixed(tmp_path, CLASH, "--weaken").err
    assert "durability is left out: a program takes it from parameters only where it lists it" in notes
    assert "deadline is left out" in notes


def test_one_of_several_needs_an_id():
    system = cqos.read(CLASH.encode())
    exported = export(system, "qos_overrides", frozenset({("rear", "reliability")}))
    entities = yaml.safe_load(exported.text)["/lidar"]["ros__parameters"]["qos_overrides"]["/scan"]
    assert entities == {"publisher_rear": {"reliability": "best_effort"}}
    assert exported.notes == (
        "publisher of `/scan` in `/lidar`: several differ; `rear` has to be the id in its QosOverridingOptions",
    )


@pytest.mark.parametrize(("rmw", "called"), [("zenoh", False), ("cyclonedds", True), ("", True)])
def test_a_package_for_zenoh_has_no_callbacks_that_keep_it_from_starting(rmw, called):
    """What ROS326 says."""
    option = f"options: {{ros2: {{rmw: {rmw}}}}}" if rmw else ""
    text = f"""cqos: 1
protocol: ros2
{option}
participants: {{a: {{publishes: {{scan: {{deadline: 1s, liveliness_lease_duration: 2s}}}}}}}}
"""
    exported = export(cqos.read(text.encode()), "ros2_package")
    assert ("deadline=self.on_deadline" in exported.text) is called
    assert ("liveliness=self.on_liveliness" in exported.text) is called
    assert any("ROS326" in each for each in exported.notes) is not called
