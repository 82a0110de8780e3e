"""Large systems of a simple order, so that what is said of them folds into a page: topic after topic goes through the same kinds.

A kind is what a publisher and a subscriber state; a seed chooses it from a vocabulary. The form in which a file states the same decides
how it is read, so each form has its golden.
"""

from __future__ import annotations

import random
import re
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from typing import Final, TypeAlias

Settings: TypeAlias = "dict[str, str]"
Values: TypeAlias = Mapping[str, "tuple[str, ...]"]

FIRST: Final = 100
"""The number of the first topic, so that all have three digits or more."""
_VALUES_OF_A_SHAPE: Final = 4

ROBOTS: Final[Values] = {
    "reliability": ("best_effort", "reliable", "reliable"),
    "durability": ("volatile", "transient_local"),
    "deadline": ("100ms", "500ms", "1s", "infinite"),
    "lifespan": ("50ms", "1s", "infinite"),
    "liveliness": ("automatic", "manual_by_topic"),
    "liveliness_lease_duration": ("500ms", "1s", "infinite"),
    "history": ("keep_last", "keep_all"),
    "depth": ("0", "1", "10", "100"),
}
UNDECIDED: Final[Values] = {
    **ROBOTS,
    "reliability": ("best_effort", "reliable", "system_default", "best_available"),
    "durability": ("volatile", "transient_local", "system_default", "best_available"),
    "depth": ("0", "1", "many"),
    "depht": ("5",),
}
DATA: Final[Values] = {
    "reliability": ("best_effort", "reliable"),
    "durability": ("volatile", "transient_local", "persistent"),
    "deadline": ("500ms", "1s", "infinite"),
    "latency_budget": ("0s", "10ms"),
    "liveliness": ("automatic", "manual_by_participant", "manual_by_topic"),
    "ownership": ("shared", "exclusive"),
    "destination_order": ("by_reception_timestamp", "by_source_timestamp"),
    "presentation.access_scope": ("instance", "topic", "group"),
    "history.depth": ("1", "10", "500"),
    "resource_limits.max_samples": ("1", "100"),
}
MESSAGES: Final[Values] = {
    "qos": ("0", "1", "2"),
    "retain": ("true", "false"),
    "message_expiry_interval": ("10s", "1h"),
    "retain_handling": ("send", "do_not_send"),
    "taken_every": ("1s", "10s"),
}
EVENTS: Final[Values] = {
    "reliability": ("best_effort", "reliable", "1"),
    "durability": ("volatile", "transient_local", "0"),
    "deadline": ("0", "0.5", "2"),
    "lifespan": ("0", "10"),
    "liveliness": ("automatic", "manual_by_topic"),
    "leaseDuration": ("1", "10"),
    "history": ("keep_last", "keep_all"),
    "depth": ("1", "10"),
}
_ODD_LISTENER: Final = re.compile(r"(  listener[0-9]*[13579]:\n)((?:    .*\n)+)")
_ENDS: Final = (("talker", "publishes"), ("listener", "subscribes"))


@dataclass(frozen=True)
class Fleet:
    """A large system of one protocol.

    Attributes:
        protocol: its pack.
        values: the vocabulary.
        kinds: how many kinds there are; four each state the same policies.
        times: how often each occurs, on a topic with one publisher and one subscriber. Once all kinds belong to the same two participants.
        seed: what chooses them.
        most: how many settings an end states at most.
        head: what the file states before its participants.
        more: what it states after those that are made here.
    """

    protocol: str
    values: Values
    kinds: int = 16
    times: int = 40
    seed: int = 1
    most: int = 4
    head: str = ""
    more: str = ""

    def __str__(self) -> str:
        return ", ".join(f"{name}={getattr(self, name)}" for name in ("protocol", "kinds", "times", "seed", "most"))

    def pairs(self) -> Iterator[tuple[int, tuple[Settings, Settings]]]:
        """Yield each topic's number, and what its ends state."""
        chance = random.Random(self.seed)  # noqa: S311 - no secret
        shapes = [(self._names(chance), self._names(chance)) for _ in range(max(1, self.kinds // _VALUES_OF_A_SHAPE))]
        kinds = [
            [{name: chance.choice(self.values[name]) for name in names} for names in shapes[kind % len(shapes)]]
            for kind in range(self.kinds)
        ]
        for number in range(FIRST, FIRST + self.kinds * self.times):
            offered, requested = kinds[(number - FIRST) % self.kinds]
            yield number, (offered, requested)

    def _names(self, chance: random.Random) -> list[str]:
        return sorted(chance.sample(sorted(self.values), chance.randint(1, self.most)))


def lines(fleet: Fleet) -> str:
    """Return a system file with the settings of an endpoint on one line, as most are written."""
    return _file(fleet, lambda settings: f" {_flow(settings)}")


def blocks(fleet: Fleet) -> str:
    """Return a system file with each setting on a line of its own."""
    return _file(fleet, lambda settings: "".join(f"\n        {name}: {text}" for name, text in settings.items()))


def aliases(fleet: Fleet) -> str:
    """Return a system file in which endpoints that state the same refer to the first of them, as no simple reader of YAML understands."""
    known: dict[str, str] = {}

    def written(settings: Settings) -> str:
        text = _flow(settings)
        if text in known:
            return f" *{known[text]}"
        known[text] = f"end_{'abcdefghijklmnopqrstuvwxyz'[len(known) % 26]}{len(known) // 26}"
        return f" &{known[text]} {text}"

    return _file(fleet, written)


def crowds(fleet: Fleet) -> str:
    """Return a system file in which each topic has many publishers and many subscribers, no two of which state the same."""
    pairs = [stated for number, stated in fleet.pairs() if number < FIRST + fleet.kinds]
    found = [_head(fleet)]
    for owner in range(FIRST, FIRST + fleet.times):
        found.append(f"  node{owner}:\n")
        for end, (_, key) in enumerate(_ENDS):
            found.append(f"    {key}:\n")
            for topic in range(fleet.kinds):
                stated = pairs[(topic + owner * (end + 1)) % fleet.kinds][end]
                stated = stated | {"depth": str(owner), "deadline": f"{_deadline(owner) if end else owner}ms"}
                found.append(f"      line{FIRST + topic}/value: {_flow(stated)}\n")
    return "".join([*found, fleet.more])


def _deadline(owner: int) -> int:
    """Return what a subscriber of a crowd requests: most let all publishers through, and some few or none."""
    return owner + 1000 if owner % 200 else owner - 90


def copies(fleet: Fleet) -> str:
    """Return a system file whose participants are instances of two templates."""
    pairs = [stated for number, stated in fleet.pairs() if number < FIRST + fleet.kinds]
    names = ", ".join(f"c{FIRST + number}" for number in range(fleet.times))
    found = [_head(fleet).replace("participants:", f"instances: {{copy: [{names}]}}\nparticipants:")]
    for end, (name, key) in enumerate(_ENDS):
        found.append(f'  "{name}_${{copy}}":\n    {key}:\n')
        found += [f'      "line{topic}/${{copy}}": {_flow(stated[end])}\n' for topic, stated in enumerate(pairs, FIRST)]
    return "".join([*found, fleet.more])


def calls(fleet: Fleet) -> str:
    """Return a system file of services in place of topics."""
    return lines(fleet).replace("    publishes:", "    serves:").replace("    subscribes:", "    calls:")


def wires(fleet: Fleet) -> str:
    """Return a system file in which what talks are nodes of ROS 2, and every other one that listens is a program of DDS."""
    return _ODD_LISTENER.sub(
        lambda found: f"{found[1]}    protocol: dds\n{found[2].replace(' line', ' rt/line')}", lines(fleet)
    )


def domains(fleet: Fleet) -> str:
    """Return a system file in which every other one that listens is in another domain."""
    return _ODD_LISTENER.sub(lambda found: f"{found[1]}    domain: 3\n{found[2]}", lines(fleet))


def _file(fleet: Fleet, written: Callable[[Settings], str]) -> str:
    found = [_head(fleet)]
    pairs = [*fleet.pairs()]
    for start in range(0, len(pairs), fleet.kinds):
        for end, (name, key) in enumerate(_ENDS):
            found.append(f"  {name}{FIRST + start // fleet.kinds}:\n    {key}:\n")
            ends = pairs[start : start + fleet.kinds]
            found += [f"      line{number}/value:{written(stated[end])}\n" for number, stated in ends]
    return "".join([*found, fleet.more])


def _head(fleet: Fleet) -> str:
    return f"cqos: 1\nsystem: fleet\nprotocol: {fleet.protocol}\n{fleet.head}participants:\n"


def _flow(settings: Settings) -> str:
    return f"{{{', '.join(f'{name}: {text}' for name, text in settings.items())}}}"


def attributes(fleet: Fleet) -> str:
    """Return a diagram of two pools with the settings of events as attributes."""
    return _diagram(fleet, "".join, lambda name, text: f' qos:{name}="{text}"')


def elements(fleet: Fleet) -> str:
    """Return the diagram with the settings of events as FaMe modeler writes them."""

    def policy(parts: list[str]) -> str:
        return f"><extensionElements><qos:policy{''.join(parts)}/></extensionElements"

    return _diagram(fleet, policy, lambda name, text: f' {name}="{text}"')


def _diagram(fleet: Fleet, joined: Callable[[list[str]], str], written: Callable[[str, str], str]) -> str:
    pairs = [*fleet.pairs()]
    found = [
        '<?xml version="1.0" encoding="UTF-8"?>',
        '<definitions xmlns="http://www.omg.org/spec/BPMN/20100524/MODEL" xmlns:qos="http://qos" id="D" targetNamespace="t"',
        f'  qos:protocol="{fleet.protocol}">',
        *(f'<signal id="Signal{number}" name="line{number}"/>' for number, _ in pairs),
        '<collaboration id="C">',
        '<participant id="Talker" name="Talker" processRef="Talking"/>',
        '<participant id="Listener" name="Listener" processRef="Listening"/>',
        "</collaboration>",
    ]
    for end, (process, tag) in enumerate(
        (("Talking", "intermediateThrowEvent"), ("Listening", "intermediateCatchEvent"))
    ):
        found.append(f'<process id="{process}">')
        for number, stated in pairs:
            parts = joined([written(name, text) for name, text in stated[end].items()])
            found.append(f'<{tag} id="{process}{number}" name="event {number}"{parts}>')
            found.append(
                f'  <signalEventDefinition id="Definition{process}{number}" signalRef="Signal{number}"/></{tag}>'
            )
        found.append("</process>")
    return "\n".join([*found, "</definitions>", ""])


_CYCLONE: Final = "options: {ros2: {rmw: cyclonedds}}\n"
_BESIDE: Final = """\
  late:
    subscribes:
      line724/value: {profile: sensor_data, needs: {latest: true}}
      line725/value: fast
      line726/valeu: {depth: 3}
      line727/Value: {}
      line730/value: {needs: {loss_free: true}}
      /only: {}
    publishes:
      line734/value: {reliability: relaible}
      line735/value: {depth: null, lifespan: 1s}
      line736/value: {depth: 3, lifespan: 2s}
      /tf_static: {}
      /rosout: {depth: 7}
  far:
    domain: 3
    publishes:
      line728/value: {depth: 3}
      line729/value: {reliability: best_effort}
      line737/value: {depth: null, lifespan: 1s}
    subscribes:
      line729/value: {depth: 3}
  both:
    publishes:
      own/value: {depth: 3}
    subscribes:
      own/value: {depth: 4}
  clock:
    publishes:
      tick/value: {deadline: 100ms, lifespan: 5s}
      tock/value: {deadline: 200ms, lifespan: 6s}
      odd__name/value: {depth: 2}
      _odd/value: {depth: 2}
  watch:
    subscribes:
      tick/value: {deadline: 1s, liveliness_lease_duration: infinite}
      tock/value: {deadline: 2s, liveliness_lease_duration: infinite}
  server:
    serves: {/reset: {}}
"""
_FACTS: Final = """\
options: {ros2: {rmw: cyclonedds}}
topics:
  /line730/value: {period: 10s, type: a/msg/B}
  /line731/value: {external: true}
  /line732/value: {latched: true}
  /line733/value: {latched: true}
  /line734/value: {period: 10s}
  /line735/value: {period: 10s}
  /line736/value: {period: 10s}
"""
_UNUSUAL: Final = """\
  unusual:
    subscribes:
      line728/value: [{reliability: best_effort}, {durability: transient_local}]
    publishes:
      bad name: {depth: 3}
      line729/value: {depth: {unknown: it is elsewhere}}
"""
_BRIDGE: Final = """\
bridges:
  over:
    routes:
      - from: {participant: talker139, topic: "/line73*/value"}
        to: {participant: listener139, topic: "/far/*"}
"""
_ACCEPTED: Final = """\
accept:
  - {rule: ROS103, topic: "/line73*", because: it is known}
severities: {ROS105: warning, ROS304: off}
"""
_CHECKS: Final = """\
checks:
  - {name: watched, where: {topic: "/line73*"}, require: {deadline: {at_most: 1s}}, because: silence is seen}
"""
_PROGRAM: Final = """\
  program:
    protocol: dds
    publishes:
      rt/line709/value: {durability: volatile}
    subscribes:
      rt/line708/value: {reliability: reliable, durability: transient_local}
      rt/line710/value: {deadline: 10ms}
"""
_FILTERS: Final = """\
  watcher:
    subscribes:
      +/value: {qos: 0}
      "state/#": {qos: 2, needs: {loss_free: true}}
      $share/group/state/+/a: {qos: 1}
  others:
    publishes:
      state/1/a: {qos: 1, retain: true}
      state/2/a: {qos: 0}
      state/2/b: {qos: 2}
"""
WIRE: Final[Values] = {name: ROBOTS[name] for name in ("reliability", "durability", "deadline", "liveliness")}
_CYCLONES: Final = "options: {ros2: {rmw: cyclonedds}, dds: {implementation: cyclonedds}}\n"
_BROKER: Final = "brokers: {main: {profile: mosquitto}}\n"
PLAIN: Final = Fleet("ros2", ROBOTS, head=_CYCLONE)
ALL: Final[Mapping[str, tuple[Callable[[Fleet], str], Fleet]]] = {
    "lines": (lines, PLAIN),
    "blocks": (blocks, PLAIN),
    "aliases": (aliases, PLAIN),
    "beside": (lines, Fleet("ros2", ROBOTS, seed=7, head=_CYCLONE, more=_BESIDE)),
    "facts": (lines, Fleet("ros2", ROBOTS, seed=7, head=_FACTS, more=_UNUSUAL)),
    "bridge": (lines, Fleet("ros2", ROBOTS, seed=8, head=_CYCLONE, more=_BRIDGE)),
    "accepted": (lines, Fleet("ros2", ROBOTS, seed=8, head=_CYCLONE, more=_ACCEPTED)),
    "checks": (lines, Fleet("ros2", ROBOTS, seed=8, head=_CYCLONE, more=_CHECKS)),
    "assumed": (lines, Fleet("ros2", ROBOTS, seed=8)),
    "crowds": (crowds, Fleet("ros2", ROBOTS, kinds=2, times=320, seed=9, head=_CYCLONE)),
    "copies": (copies, Fleet("ros2", ROBOTS, seed=10, head=_CYCLONE)),
    "calls": (calls, Fleet("ros2", ROBOTS, seed=11, head=_CYCLONE)),
    "wires": (wires, Fleet("ros2", WIRE, seed=12, head=_CYCLONES, more=_PROGRAM)),
    "domains": (domains, Fleet("ros2", ROBOTS, seed=13, head=_CYCLONE)),
    "undecided": (lines, Fleet("ros2", UNDECIDED, seed=2)),
    "data": (lines, Fleet("dds", DATA, seed=3, head="options: {dds: {implementation: cyclonedds}}\n")),
    "messages": (lines, Fleet("mqtt", MESSAGES, seed=4, head=_BROKER)),
    "filters": (lines, Fleet("mqtt", MESSAGES, seed=4, head=_BROKER, more=_FILTERS)),
    "attributes": (attributes, Fleet("ros2", EVENTS, seed=5)),
    "elements": (elements, Fleet("ros2", EVENTS, seed=5)),
}
