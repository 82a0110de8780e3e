"""Systems that pictures are made of in tests and in the docs."""

import json
import random

FLEET = """\
cqos: 1
system: robot-to-cloud
options: {ros2: {rmw: cyclonedds, round_trip_time: 5ms}}
topics: {/battery: {period: 1s}}
brokers:
  main: {protocol: mqtt, profile: mosquitto}
participants:
  robot:
    protocol: ros2
    publishes:
      /battery: {depth: 5}
      /scan: sensor_data
      /pose: {}
  planner:
    protocol: ros2
    subscribes:
      /scan: {reliability: reliable}
      /pose: {}
    publishes: {/cmd_vel: {}}
  base: {protocol: ros2, subscribes: {/cmd_vel: {}}}
  gateway: {protocol: ros2}
  gateway_mqtt: {protocol: mqtt, client: {client_id: r1}}
  cloud:
    protocol: mqtt
    client: {client_id: cloud}
    subscribes: {fleet/r1/battery: {qos: 1, needs: {loss_free: true}}}
bridges:
  uplink:
    routes:
      - from: {participant: gateway, topic: /battery, depth: 5}
        to: {participant: gateway_mqtt, topic: fleet/r1/battery, qos: 0}
"""
CORRECT = """\
cqos: 1
system: fine
protocol: ros2
options: {ros2: {rmw: cyclonedds, distro: jazzy}}
participants:
  lidar: {publishes: {scan: {}}}
  planner: {subscribes: {scan: {}}}
"""
HOSTILE = (
    "<script>alert(1)</script>",
    '"><img src=x onerror=alert(2)>',
    "</style>{{name}}/*style*//*script*/",
    "a'b&amp;\\\"]",
)
"""Names that would act if one of them were written unescaped anywhere."""


def hostile():
    """Return a system in which every name is hostile."""
    script, image, style, quotes = map(json.dumps, HOSTILE)
    return f"""\
cqos: 1
system: {script}
protocol: ros2
participants:
  {image}:
    publishes: {{{style}: {{reliability: best_effort}}}}
  {quotes}:
    subscribes: {{{style}: {{reliability: reliable, needs: {{latest: true}}}}}}
  {script}:
    subscribes: {{{image}: {{reliability: {quotes}}}}}
"""


def grid(*publishers, subscribers=("reliable", "best_effort")):
    """Return a system with one topic; each publisher and subscriber is stated by its reliability."""
    lines = ["cqos: 1", "system: grid", "protocol: ros2", "participants:"]
    for verb, ends in (("publishes", publishers), ("subscribes", subscribers)):
        lines += [f"  {verb}_{number}: {{{verb}: {{scan: {{reliability: {end}}}}}}}" for number, end in enumerate(ends)]
    return "\n".join([*lines, ""])


def large(participants, topics):
    """A system with so many of both, a twelfth of its publishers too weak; the same each time."""
    dice = random.Random(7)  # noqa: S311 - a layout, no secret
    publishes: dict[int, dict[int, str]] = {number: {} for number in range(participants)}
    subscribes: dict[int, dict[int, str]] = {number: {} for number in range(participants)}
    for topic in range(topics):
        owner = dice.randrange(participants)
        publishes[owner][topic] = "best_effort" if dice.random() < 1 / 12 else "reliable"
        for _ in range(dice.randint(1, 3)):
            near = min(participants - 1, owner + dice.randint(1, 4))
            taker = near if dice.random() < 0.85 else dice.randrange(participants)
            subscribes[taker][topic] = dice.choice(("reliable", "best_effort"))
    lines = ["cqos: 1", "system: fleet", "protocol: ros2", "participants:"]
    for number in range(participants):
        lines.append(f"  node_{number:02}:")
        for role, found in (("publishes", publishes[number]), ("subscribes", subscribes[number])):
            entries = ", ".join(f"topic_{topic:03}: {{reliability: {value}}}" for topic, value in found.items())
            lines.append(f"    {role}: {{{entries}}}")
    return "\n".join([*lines, ""])
