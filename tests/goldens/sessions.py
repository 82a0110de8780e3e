"""Sessions: after each edit what it changed, and at the end the whole report.

Edits of single endpoints come first, so that they find the state that only such edits keep. Then come edits that concern all endpoints.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from functools import partial
from typing import TYPE_CHECKING, Any, Final, TypeAlias

from cqos_core import (
    Acceptance,
    Bound,
    Endpoint,
    Participant,
    Profile,
    ProfileRef,
    Session,
    Setting,
    TeamRule,
    Topic,
    read,
)
from tests.goldens import fleets
from tests.goldens.stanza import Lines, Writer

if TYPE_CHECKING:
    from cqos_core.model.system import Role

SYSTEMS: Final = "tests/goldens/systems"
Edit: TypeAlias = Callable[[Session], object]


def played(source: str | bytes, edits: Mapping[str, Sequence[Edit]]) -> Lines:
    """Open a system, do edits step by step, and return what each step changed and the last report."""
    session, writer = Session(read(source)), Writer(source if isinstance(source, str) else "<bytes>")
    lines: Lines = []
    for step, parts in edits.items():
        for edit in parts:
            edit(session)
        lines += [f"-- {step}", *writer.changes(session.changes())]
    return [*lines, "-- all of it", *writer.report(session.report())]


def texts(stated: Mapping[str, str]) -> dict[str, Setting]:
    """Return settings of texts."""
    return {name: Setting(text) for name, text in stated.items()}


def stating(endpoint: str, stated: Mapping[str, str], **fields: Any) -> Edit:
    """Let an endpoint state other settings, and perhaps have other fields."""

    def edit(session: Session) -> None:
        (found,) = (each for each in session.system.endpoints if each.id == endpoint)
        session.put(replace(found, settings=texts(stated), **fields))

    return edit


def added(endpoint: str, role: Role, topic: str, owner: str, stated: Mapping[str, str], **fields: Any) -> Edit:
    """Add an endpoint."""
    new = Endpoint(id=endpoint, role=role, topic=topic, participant=owner, settings=texts(stated), **fields)
    return lambda session: session.put(new)


def removed(endpoint: str) -> Edit:
    """Remove an endpoint."""
    return lambda session: session.remove(endpoint)


def done(kind: str, *values: Any, **named: Any) -> Edit:
    """Do an edit by the name of its method."""
    return lambda session: getattr(session, kind)(*values, **named)


ROBOT: Final = b"""
cqos: 1
protocol: ros2
options: {ros2: {rmw: cyclonedds}}
participants:
  lidar: {publishes: {/scan: {reliability: best_effort, deadline: 100ms}, /status: {depth: 1}}}
  camera: {publishes: {/image: {reliability: best_effort}, /info: {depth: 3}}}
  planner: {subscribes: {/scan: {reliability: best_effort}, /image: {reliability: best_effort}, /info: {}}}
  display: {subscribes: {/status: {depth: 2}, /scan: {reliability: best_effort, deadline: 200ms}}}
"""
PROFILES: Final = b"""
cqos: 1
protocol: ros2
options: {ros2: {rmw: cyclonedds}}
profiles: {fast: {reliability: best_effort, depth: 2}, state: {durability: transient_local, depth: 1}}
participants:
  lidar: {publishes: {/scan: {reliability: best_effort, deadline: 100ms}, /status: state}}
  camera: {publishes: {/image: fast}}
  planner: {subscribes: {/scan: {reliability: best_effort}, /image: fast}}
  display: {subscribes: {/status: state, /scan: {reliability: best_effort, deadline: 200ms}}}
"""
GARDEN: Final = b"""
cqos: 1
protocol: mqtt
brokers: {main: {profile: mosquitto}}
participants:
  sensor: {client: {client_id: sensor}, publishes: {bed/1/moisture: {qos: 1}, bed/2/moisture: {qos: 1}}}
  app: {client: {client_id: app}, subscribes: {bed/+/moisture: {qos: 1}, bed/1/moisture: {qos: 1}}}
"""
RELAY: Final = b"""
cqos: 1
protocol: ros2
options: {ros2: {rmw: cyclonedds}}
participants:
  lidar: {domain: 1, publishes: {/scan: {deadline: 100ms}}}
  inside: {domain: 1}
  outside: {domain: 2}
  display: {domain: 2, subscribes: {/scan: {needs: {latest: true}}}}
bridges:
  relay:
    routes: [{from: {participant: inside, topic: /scan}, to: {participant: outside, topic: /scan}}]
"""
_OF_A_ROBOT: Final[Mapping[str, Sequence[Edit]]] = {
    "request more": [stating("planner/subscriber/scan", {"reliability": "reliable"})],
    "request what no one knows": [stating("planner/subscriber/scan", {"reliability": "relaible", "depht": "3"})],
    "request what is there": [stating("planner/subscriber/scan", {"reliability": "best_effort", "deadline": "1s"})],
    "offer less": [stating("lidar/publisher/scan", {"reliability": "best_effort", "deadline": "300ms"})],
    "go to a topic of another name": [stating("camera/publisher/info", {"depth": "3"}, topic="/inof")],
    "come back": [stating("camera/publisher/info", {"depth": "0"}, topic="/info")],
    "need something": [
        stating("display/subscriber/scan", {}, needs=texts({"loss_free": "true", "max_age": "1s"})),
        added("display/extra", "subscriber", "/info", "display", {"durability": "transient_local"}),
    ],
    "leave": [removed("display/extra"), removed("camera/publisher/info")],
    "do not be sure": [stating("camera/publisher/image", {"durability": "system_default", "depth": "1"})],
}
_OF_PROFILES: Final[Mapping[str, Sequence[Edit]]] = {
    "use another profile": [stating("planner/subscriber/image", {}, profiles=(ProfileRef("state"),))],
    "request what no one knows": [stating("planner/subscriber/scan", {"reliability": "relaible"})],
    "use no profile": [stating("display/subscriber/status", {"depth": "2"}, profiles=())],
    "another middleware": [done("set_option", "ros2", "rmw", "fastdds")],
    "any middleware": [done("set_option", "ros2", "rmw", None)],
    "another profile of that name": [done("put_profile", Profile("state", texts({"reliability": "best_effort"})))],
    "facts of a topic": [done("put_topic", Topic("/scan", texts({"period": "1s", "latched": "true"})))],
    "accept": [done("set_rules", accept=[Acceptance("ROS102", "it is known", "/image")])],
    "check": [
        done(
            "set_rules",
            checks=[TeamRule("deep", (), (Bound("depth", "at_least", ("4",)),), "queues are long")],
            severities={"deep": "warning", "ROS303": "off"},
        )
    ],
    "a node in a namespace": [done("put_participant", Participant("planner", "ros2", texts({"namespace": "/sub"})))],
    "an endpoint after all that": [stating("planner/subscriber/scan", {"reliability": "reliable"})],
    "a node goes": [done("remove_participant", "display")],
}
_OF_A_FLEET: Final[Mapping[str, Sequence[Edit]]] = {
    "three offers": [
        stating(f"talker{number}/publisher/line{(number - 100) * 16 + 100}/value", {"reliability": "best_effort"})
        for number in (100, 110, 139)
    ],
    "a request": [stating("listener105/subscriber/line180/value", {"durability": "transient_local", "depth": "7"})],
    "a second request": [added("more", "subscriber", "line180/value", "listener139", {"deadline": "1ms"})],
    "one that is alone": [added("alone", "publisher", "line1800/value", "talker139", {})],
    "offers go": [removed(f"talker120/publisher/line{number}/value") for number in (420, 421, 422)],
    "what is open": [stating("listener130/subscriber/line580/value", {"reliability": "system_default"})],
    "all again": [done("set_option", "ros2", "rmw", "fastdds")],
}
_OF_A_GARDEN: Final[Mapping[str, Sequence[Edit]]] = {
    "less for all that listen": [stating("sensor/publisher/bed/1/moisture", {"qos": "0"})],
    "a filter that takes all": [stating("app/subscriber/bed/+/moisture", {"qos": "2"}, topic="#")],
    "another topic": [added("light", "publisher", "bed/1/light", "sensor", {"retain": "true"})],
    "a topic goes": [removed("sensor/publisher/bed/1/moisture")],
}
_OF_A_RELAY: Final[Mapping[str, Sequence[Edit]]] = {
    "less before the bridge": [stating("lidar/publisher/scan", {"reliability": "best_effort"})],
    "more behind it": [stating("display/subscriber/scan", {"deadline": "1s"})],
    "nothing before it": [removed("lidar/publisher/scan")],
}
_OF_MESSAGES: Final[Mapping[str, Sequence[Edit]]] = {
    "a filter": [added("wide", "subscriber", "bed/+/+", "valve", {"qos": "2"})],
    "a topic": [stating("one/publisher/bed/2/moisture", {"qos": "0"}, topic="bed/4/moisture")],
    "a filter goes": [removed("control/subscriber/#")],
    "another client": [
        done("put_participant", Participant("valve", "mqtt", texts({"client_id": "v", "broker": "house"})))
    ],
    "what is implied": [done("set_option", "mqtt", "implied_needs", "warning")],
}
_OF_BRIDGES: Final[Mapping[str, Sequence[Edit]]] = {
    "an offer before a bridge": [stating("robot/publisher/battery", {"durability": "transient_local"})],
    "another one": [stating("lidar_scan", {"reliability": "reliable"})],
    "a bridge goes": [done("remove_bridge", "battery_again")],
    "the ring goes": [done("remove_bridge", "ring")],
    "a request behind": [stating("cloud/subscriber/site/+/temp", {"qos": "1"})],
}
_OF_A_DIAGRAM: Final[Mapping[str, Sequence[Edit]]] = {
    "an attribute": [stating("Report", {"reliability": "reliable"})],
    "another signal": [stating("Follow", {"reliability": "best_effort"}, topic="Weather")],
    "no flow": [done("set_flows", ())],
}
_OF_ONE_WIRE: Final[Mapping[str, Sequence[Edit]]] = {
    "a node": [stating("node/publisher/pose", {"deadline": "10ms"})],
    "a program": [stating("program/subscriber/rt/state", {"durability": "volatile"})],
    "no program": [done("remove_participant", "old_program")],
}
ALL: Final[Mapping[str, Callable[[], Lines]]] = {
    "robot": partial(played, ROBOT, _OF_A_ROBOT),
    "profiles": partial(played, PROFILES, _OF_PROFILES),
    "garden": partial(played, GARDEN, _OF_A_GARDEN),
    "relay": partial(played, RELAY, _OF_A_RELAY),
    "fleet": lambda: played(fleets.lines(fleets.PLAIN).encode(), _OF_A_FLEET),
    "messages": partial(played, f"{SYSTEMS}/wildcards.yaml", _OF_MESSAGES),
    "bridges": partial(played, f"{SYSTEMS}/bridges.yaml", _OF_BRIDGES),
    "diagram": partial(played, f"{SYSTEMS}/diagram.bpmn", _OF_A_DIAGRAM),
    "one_wire": partial(played, f"{SYSTEMS}/one_wire.yaml", _OF_ONE_WIRE),
}
