"""Inputs of any size, each of a form whose cost once grew faster than the input. All are made here, from a number."""

from __future__ import annotations

import io
import json
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, Any, Final, NamedTuple

import cqos_core as cqos
from cqos_core.analysis.baseline import read_baseline, write_baseline
from cqos_core.analysis.runtime_logs import explain_mismatches
from cqos_core.api import context
from cqos_core.formatters.json_report import render_json
from cqos_core.model.settings import Setting
from cqos_core.model.style import Style
from cqos_core.model.system import Endpoint, Overlay, Participant, System
from cqos_core.packs.log_mismatches import read_mismatches
from cqos_core.plugins import load_plugins

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable

    from cqos_core.model.report import Report


DOMAINS: Final = 232
"""So many domains a network of ROS 2 has; the id of another one is invalid, so its endpoints may be in any."""


class Model(NamedTuple):
    """One input: its size in bytes, and what to do with it; that returns the bytes of what comes out."""

    size: int
    work: Callable[[], int]


def printed(report: Report) -> int:
    """The size of a report as JSON."""
    return len(render_json(report, Style()))


def checked(text: bytes) -> Model:
    """Check a system file."""
    return Model(len(text), lambda: printed(cqos.check(text)))


def checked_files(files: dict[str, str], *named: str) -> Model:
    """Write files into a new folder, and check those that are named."""

    def work() -> int:
        with TemporaryDirectory() as folder:
            for name, text in files.items():
                Path(folder, name).write_text(text, encoding="utf-8")
            return printed(cqos.check(*(str(Path(folder, name)) for name in named)))

    return Model(sum(map(len, files.values())), work)


def document(protocol: str, **parts: Any) -> bytes:
    """Write a system file in JSON, which is YAML."""
    return json.dumps({"cqos": 1, "system": "growing", "protocol": protocol} | parts).encode()


def node(name: str, publishes: Any = (), subscribes: Any = (), **more: Any) -> dict[str, Any]:
    return {name: {"publishes": dict(publishes), "subscribes": dict(subscribes)} | more}


def nodes(each: Iterable[dict[str, Any]]) -> dict[str, Any]:
    return {name: value for one in each for name, value in one.items()}


def _broken(number: int) -> dict[str, Any]:
    """As many topics with one error each."""
    best, reliable = {"reliability": "best_effort"}, {"reliability": "reliable"}
    return {
        "a": {"publishes": {f"/t{i}": best for i in range(number)}},
        "b": {"subscribes": {f"/t{i}": reliable for i in range(number)}},
    }


def broken_topics(n: int) -> Model:
    return checked(document("ros2", participants=_broken(n)))


def acceptances(n: int) -> Model:
    accept = [{"rule": "ROS101", "topic": f"/t{i}", "because": "known"} for i in range(n)]
    return checked(document("ros2", participants=_broken(n), accept=accept))


def baseline(n: int) -> Model:
    """Compare as many findings with as many known ones."""
    report = cqos.check(document("ros2", participants=_broken(n)))
    text = write_baseline("known.json", [(None, report)]).encode()
    return Model(len(text), lambda: printed(read_baseline("known.json", text).mark(report)))


def log_lines(n: int) -> Model:
    """Explain what as many topics complain of."""
    text = document("ros2", participants=_broken(n))
    line = (
        "[WARN] [1700000000.0] [b]: New publisher discovered on topic '/t{}', offering incompatible QoS. "
        "No messages will be received from it. Last incompatible policy: RELIABILITY\n"
    )
    log = "".join(line.format(i) for i in range(n)).encode()

    def work() -> int:
        pack = load_plugins().pack("ros2")
        assert pack is not None
        occurrences, _ = read_mismatches("log", io.BytesIO(log), [pack.read_log])
        return sum(len(str(each)) for each in explain_mismatches(occurrences, cqos.read(text), context()))

    return Model(len(text) + len(log), work)


def best_available(n: int) -> Model:
    participants = nodes(node(f"p{i}", {"/t": {"deadline": f"{i + 1}ms"}}) for i in range(n))
    participants |= nodes(node(f"s{i}", (), {"/t": "best_available"}) for i in range(n))
    rmw = {"ros2": {"rmw": "cyclonedds", "distro": "jazzy"}}
    return checked(document("ros2", participants=participants, options=rmw))


def best_available_each(n: int) -> Model:
    """Endpoints that all differ; one side takes its values from the other."""
    taken = {"reliability": "best_available", "deadline": "best_available"}
    participants = nodes(node(f"p{i}", {"/t": {"depth": i + 1}}) for i in range(n))
    participants |= nodes(node(f"s{i}", (), {"/t": taken | {"depth": i + 1}}) for i in range(n))
    rmw = {"ros2": {"rmw": "cyclonedds", "distro": "jazzy"}}
    return checked(document("ros2", participants=participants, options=rmw))


def partitions(n: int, offered: str = "p{}", requested: str = "p{}") -> Model:
    """Endpoints of one topic, each in a few of many partitions."""

    def some(name: str, start: int, step: int) -> dict[str, Any]:
        return {"partition": [name.format((start * 7 + k * step) % (2 * n)) for k in range(4)]}

    participants = nodes(node(f"p{i}", {"t": some(offered, i, 3)}) for i in range(n))
    participants |= nodes(node(f"s{i}", (), {"t": some(requested, i, 5)}) for i in range(n))
    return checked(document("dds", participants=participants))


def wild_partitions(n: int) -> Model:
    return partitions(n, "p{}/*", "p{}/left")


def near_misses(n: int) -> Model:
    """Publishers and subscribers whose names nearly meet."""
    publishers: dict[str, Any] = {f"/robot{i}/camera/image": {} for i in range(n)}
    subscribers: dict[str, Any] = {f"/robot{i}/camera/imaeg": {} for i in range(n)}
    return checked(document("ros2", participants={"a": {"publishes": publishers}, "b": {"subscribes": subscribers}}))


def unknown_profiles(n: int) -> Model:
    publishes = {f"/t{i}": f"profil_{i}" for i in range(n)}
    profiles = {f"profile_{i}": {"depth": 3} for i in range(n)}
    return checked(document("ros2", participants={"a": {"publishes": publishes}}, profiles=profiles))


def unknown_participants(n: int) -> Model:
    """A system made by a program, whose endpoints are of participants with other names."""
    system = System("growing", "ros2", participants={f"p{i}": Participant(f"p{i}") for i in range(n)})
    system.endpoints = [Endpoint(id=f"e{i}", role="publisher", topic="t", participant=f"q{i}") for i in range(n)]

    def work() -> int:
        try:
            cqos.check(system)
        except cqos.InputError as error:
            return len(str(error))
        raise AssertionError

    return Model(n * 10, work)


def unknown_settings(n: int) -> Model:
    publishes = {f"/t{i}": {f"reliabilty{i}": "reliable"} for i in range(n)}
    return checked(document("ros2", participants={"a": {"publishes": publishes}}))


def team_checks(n: int) -> Model:
    checks = [
        {"name": f"c{i}", "where": {"topic": f"/t{i}"}, "require": {"reliability": "reliable"}, "because": "we said so"}
        for i in range(n)
    ]
    return checked(document("ros2", participants=_broken(n), checks=checks))


def overlays(n: int) -> Model:
    """Overrides by pattern from a parameter file, over as many nodes."""
    text = document("ros2", participants=nodes(node(f"n{i}", {f"/t{i}": {}}) for i in range(n)))
    setting = {"reliability": Setting("best_effort")}

    def work() -> int:
        system = cqos.read(text)
        system.overlays = [
            Overlay(f"o{i}", setting, topic=f"/t{i}", participant=f"/n{i}", protocol="ros2") for i in range(n)
        ]
        return printed(cqos.check(system))

    return Model(len(text) * 2, work)


def bridge_ring(n: int) -> Model:
    """Bridges that carry one topic around; it has another name in each round of the domains."""
    places = [(f"/t{i // DOMAINS}", i % DOMAINS) for i in range(n)]
    participants = nodes(node(f"d{i}", domain=domain) for i, (_, domain) in enumerate(places))
    participants |= {"source": {"domain": 0, "publishes": {"/t0": {}}}}
    ends = [(i, (i + 1) % n) for i in range(n)]
    bridges = {f"b{i}": {"routes": [_route(f"d{i}", f"d{j}", places[i][0], places[j][0])]} for i, j in ends}
    return checked(document("ros2", participants=participants, bridges=bridges))


def pattern_ring(n: int) -> Model:
    """Bridges that carry around whatever there is: in each domain under a first name of its own, as many as are needed."""
    domains = [(i // DOMAINS, i % DOMAINS) for i in range(n)]
    participants = nodes(node(f"d{i}", domain=domain) for i, (_, domain) in enumerate(domains))
    participants |= {"source": {"domain": 0, "publishes": {"/n0/t": {}}}}
    bridges = {
        f"b{i}": {"routes": [_between(f"d{i}", f"d{(i + 1) % n}", domains[i][0], domains[(i + 1) % n][0])]}
        for i in range(n)
    }
    return checked(document("ros2", participants=participants, bridges=bridges))


def bridge_clique(n: int) -> Model:
    """Bridges between every two domains: n is the number of bridges."""
    some = max(2, int(n**0.5))
    participants = nodes(node(f"d{i}", domain=i) for i in range(some))
    participants |= {"source": {"domain": 0, "publishes": {"/t": {}}}}
    bridges = {f"b{i}_{j}": {"routes": [_route(f"d{i}", f"d{j}")]} for i in range(some) for j in range(some) if i != j}
    return checked(document("ros2", participants=participants, bridges=bridges))


def _between(a: str, b: str, name: int, other: int) -> dict[str, Any]:
    return {"from": {"participant": a, "topic": f"/n{name}/*"}, "to": {"participant": b, "topic": f"/n{other}/*"}}


def _route(a: str, b: str, topic: str = "/t", other: str = "/t") -> dict[str, Any]:
    return {"from": {"participant": a, "topic": topic}, "to": {"participant": b, "topic": other}}


def access_control(n: int) -> Model:
    """Clients of one broker, each with lines of its own in the acl_file."""
    lines = "".join(f"user u{i}\ntopic write t/{i}\ntopic read t/{i}\n" for i in range(n))
    participants = nodes(
        node(f"c{i}", {f"t/{i}": {}}, {f"t/{i}": {}}, broker="mosquitto", username=f"u{i}", client_id=f"k{i}")
        for i in range(n)
    )
    files = {"acl": lines, "mosquitto.conf": "acl_file acl\n"}
    files["clients.yaml"] = document("mqtt", participants=participants).decode()
    return checked_files(files, "clients.yaml", "mosquitto.conf")


def references(n: int) -> Model:
    """Channels of AsyncAPI that each lead to the next, and an operation at each."""
    channels: dict[str, Any] = {f"c{i}": {"$ref": f"#/channels/c{i + 1}"} for i in range(n)}
    operations = {f"o{i}": {"action": "send", "channel": {"$ref": f"#/channels/c{i}"}} for i in range(n)}
    servers = {"a": {"host": "h", "protocol": "mqtt"}}
    parts = {"servers": servers, "channels": channels | {f"c{n}": {"address": "t"}}, "operations": operations}
    return checked(json.dumps({"asyncapi": "3.0.0", "info": {"title": "growing"}} | parts).encode())


def includes(n: int) -> Model:
    """Files that each include the next."""
    files = {
        f"f{i}.yaml": document(
            "mqtt", participants=node(f"c{i}", {f"t{i}": {}}), include=[f"f{i + 1}.yaml"] if i + 1 < n else []
        ).decode()
        for i in range(n)
    }
    return checked_files(files, "f0.yaml")


def allow_lists(n: int) -> Model:
    """A Zenoh bridge that lets as many topics through as there are."""
    names = [f"/t{i}" for i in range(n)]
    allow = {"publishers": [*names, "/other/.*"], "subscribers": names}
    bridge = json.dumps({"plugins": {"ros2dds": {"domain": 0, "allow": allow}}})
    participants = node("a", {name: {} for name in names}) | node("b", (), {name: {} for name in names})
    files = {"zenoh.json5": bridge, "robot.yaml": document("ros2", participants=participants).decode()}
    return checked_files(files, "robot.yaml", "zenoh.json5")


def brokers(n: int) -> Model:
    participants = nodes(node(f"c{i}", {"t": {}}, {"u": {}}, broker=f"b{i}") for i in range(n))
    return checked(document("mqtt", participants=participants, brokers={f"b{i}": {} for i in range(n)}))


def topics(n: int) -> Model:
    """Many topics with diverse values; a tenth is broken."""
    publishes = {f"/t{i}": {"deadline": f"{i + 1}ms", "depth": i + 1} for i in range(n)}
    subscribes = {f"/t{i}": {"deadline": f"{i + 1 - (i % 10 == 0) * 1}ms"} for i in range(1, n)}
    rmw = {"ros2": {"rmw": "cyclonedds"}}
    return checked(
        document("ros2", participants={"a": {"publishes": publishes}, "b": {"subscribes": subscribes}}, options=rmw)
    )


MODELS: Final = {
    acceptances: 50,
    access_control: 50,
    allow_lists: 75,
    baseline: 100,
    best_available: 30,
    best_available_each: 60,
    bridge_clique: 400,
    bridge_ring: 50,
    broken_topics: 150,
    brokers: 100,
    includes: 75,
    log_lines: 100,
    near_misses: 200,
    overlays: 200,
    partitions: 100,
    pattern_ring: 50,
    references: 200,
    team_checks: 50,
    topics: 200,
    unknown_participants: 150,
    unknown_profiles: 150,
    unknown_settings: 50,
    wild_partitions: 100,
}
"""Each with its smallest size that takes long enough to be measured."""
ALWAYS: Final = (
    acceptances,
    access_control,
    best_available,
    bridge_clique,
    broken_topics,
    includes,
    log_lines,
    near_misses,
    overlays,
    partitions,
    references,
    topics,
)
"""Those of each run of the tests: one for each part of a check whose cost could grow faster. `dev.py explore` counts all."""
LARGEST: Final = {includes: 1000}
"""How large the input of a model may be before C-QoS refuses it."""


def table() -> None:
    """Print sizes, processor time and the exponent of every model."""
    from tests.growth.test_growth import exponent, measured

    for model, smallest in MODELS.items():
        points = measured(model, smallest)
        print(f"{model.__name__:<18}", f"{exponent(points):5.2f} ", *(f"{b}B {s:.2f}s" for b, s in points))  # noqa: T201


if __name__ == "__main__":
    table()
