"""Reports built by hand, and golden files: ``pytest tests/formatters --update-golden`` writes them anew."""

from pathlib import Path

import pytest

from cqos_core.model.finding import Fact, Finding, Remedy, Severity, Side, Verdict
from cqos_core.model.report import Assumption, Group, Report
from cqos_core.model.settings import Place
from cqos_core.model.style import Style

GOLDEN = Path(__file__).parent / "golden"

YAML = """\
cqos: 1
system: smart-agriculture
protocol: ros2

profiles:
  request: {depth: 1, reliability: best_effort, deadline: 2s}

participants:
  drone:
    publishes: {req_weather_data: request, position: sensor_data}
    subscribes:
      resp_weather_data: {reliability: RELIABLE, durability: transient_local}
  weather_station:
    subscribes:
      req_weather_data: {reliability: reliable, deadline: 1s}
    publishes: {resp_weather_data: {depth: 5}}
  tower:
    subscribes: {position: {reliability: system_default}}
"""

BPMN = """\
<?xml version="1.0" encoding="UTF-8"?>
<definitions xmlns="http://www.omg.org/spec/BPMN/20100524/MODEL" xmlns:qos="http://qos">
  <process id="Process_Drone">
    <intermediateThrowEvent id="Drone_ThrowReq" name="Req weather data" qos:history="0" qos:depth="1" qos:reliability="0" qos:durability="1" qos:deadline="2" qos:lifespan="10"/>
    <intermediateCatchEvent id="Station_CatchReq" name="Req weather data"
\t\tqos:reliability="reliable" qos:durability="volatile"/>
  </process>
</definitions>
"""

HOSTILE = """\
profiles:
\tdas 天気 profil: {reliability: "best\x1b[31m_effort"}\t# \u202etrap
  🚜/wetter: {deadline: 1s, überall: ja}
"""


def at(source, needle, text=YAML, path=None):
    """The place of the first ``needle`` in ``text``."""
    before = text[: text.index(needle)]
    return Place(source, before.count("\n") + 1, len(before) - (before.rfind("\n") + 1) + 1, path=path)


def yaml(needle):
    return at("system.yaml", needle)


STATION = "weather_station/subscriber/req_weather_data"
DRONE = "drone/publisher/req_weather_data"

RELIABILITY = Finding(
    code="ROS101",
    name="reliability-weaker-than-requested",
    severity=Severity.ERROR,
    message=f"publisher `{DRONE}` offers reliability best_effort, subscriber `{STATION}` requests reliability reliable",
    source="ros2",
    topic="req_weather_data",
    verdict=Verdict.INCOMPATIBLE,
    sides=(
        Side(
            "subscriber",
            (STATION,),
            "requested here",
            (Fact("reliability", "reliable", "explicit", yaml("reliable, deadline: 1s")),),
            yaml("req_weather_data: {rel"),
        ),
        Side(
            "publisher",
            (DRONE,),
            "offered here",
            (Fact("reliability", "best_effort", "profile request", yaml("best_effort")),),
            yaml("req_weather_data: request"),
        ),
    ),
    remedies=(
        Remedy(
            "publisher",
            (DRONE,),
            "reliability",
            "reliable",
            "configuration",
            f"offer reliability `reliable` on {DRONE}",
            1,
        ),
        Remedy(
            "subscriber",
            (STATION,),
            "reliability",
            "best_effort",
            "configuration",
            f"request reliability `best_effort` on {STATION}",
            1,
        ),
    ),
    notes=("order of reliability: best_effort < reliable",),
    because="a reliable subscription waits for retransmissions that a best-effort publisher never sends, "
    "so the middleware refuses to connect the two",
    clause="DDS 1.4, 2.2.3.14",
    pairs=1,
)

DEADLINE = Finding(
    code="ROS103",
    name="deadline-longer-than-requested",
    severity=Severity.ERROR,
    message=f"publisher `{DRONE}` offers deadline 2s, subscriber `{STATION}` requests deadline 1s",
    source="ros2",
    topic="req_weather_data",
    verdict=Verdict.INCOMPATIBLE,
    sides=(
        Side(
            "subscriber",
            (STATION,),
            "requested here",
            (Fact("deadline", "1s", "explicit", yaml("1s")),),
            yaml("req_weather_data: {rel"),
        ),
        Side(
            "publisher",
            (DRONE,),
            "offered here",
            (Fact("deadline", "2s", "profile request", yaml("2s")),),
            yaml("req_weather_data: request"),
        ),
    ),
    remedies=(
        Remedy(
            "subscriber",
            (STATION,),
            "deadline",
            "2s",
            "configuration",
            f"request deadline `2s` on {STATION}",
            1,
        ),
        Remedy("publisher", (DRONE,), "deadline", "1s", "needs_code", f"offer deadline `1s` on {DRONE}", 1, 2),
    ),
    because="the publisher promises less than is asked of it",
    clause="DDS 1.4, 2.2.3.7",
    pairs=1,
)

DURABILITY = Finding(
    code="ROS102",
    name="durability-weaker-than-requested",
    severity=Severity.ERROR,
    message="publisher `weather_station/publisher/resp_weather_data` offers durability volatile, subscriber "
    "`drone/subscriber/resp_weather_data` requests durability transient_local",
    source="ros2",
    topic="resp_weather_data",
    verdict=Verdict.INCOMPATIBLE,
    sides=(
        Side(
            "subscriber",
            ("drone/subscriber/resp_weather_data",),
            "requested here",
            (
                Fact("durability", "transient_local", "explicit", yaml("transient_local")),
                Fact("reliability", "reliable", "explicit", yaml("RELIABLE")),
            ),
            yaml("resp_weather_data: {rel"),
        ),
        Side(
            "publisher",
            ("weather_station/publisher/resp_weather_data",),
            "offered here",
            (
                Fact("durability", "volatile", "default", yaml("resp_weather_data: {dep")),
                Fact("reliability", "reliable", "default", yaml("resp_weather_data: {dep")),
            ),
            yaml("resp_weather_data: {dep"),
        ),
    ),
    pairs=1,
)

UNKNOWN = Finding(
    code="ROS101",
    name="reliability-weaker-than-requested",
    severity=Severity.WARNING,
    message="whether publisher `drone/publisher/position` and subscriber `tower/subscriber/position` (and 13 more) fit "
    "in reliability is not known: it depends on ros2.rmw",
    source="ros2",
    topic="position",
    verdict=Verdict.UNKNOWN,
    sides=(
        Side(
            "subscriber",
            ("tower/subscriber/position", *(f"tower_{n}/subscriber/position" for n in range(2, 15))),
            "requested here",
            (
                Fact(
                    "reliability",
                    "system_default (best_effort with fastdds; reliable with cyclonedds, connext)",
                    "explicit",
                    yaml("system_default"),
                ),
            ),
            yaml("position: {rel"),
        ),
        Side(
            "publisher",
            ("drone/publisher/position",),
            "offered here",
            (Fact("reliability", "best_effort", "preset sensor_data", yaml("sensor_data")),),
            yaml("position: sen"),
        ),
    ),
    because=RELIABILITY.because,
    clause="DDS 1.4, 2.2.3.14",
    help="set `--option ros2.rmw=…`, or `options:` in the system file",
    pairs=14,
    worlds={
        "ros2.rmw=connext": Verdict.INCOMPATIBLE,
        "ros2.rmw=cyclonedds": Verdict.INCOMPATIBLE,
        "ros2.rmw=fastdds": Verdict.COMPATIBLE,
    },
)

NOTE = Finding(
    code="ROS301",
    name="lifespan-shorter-than-deadline",
    severity=Severity.NOTE,
    message=f"publisher `{DRONE}` has lifespan 1s and deadline 2s: samples vanish before the next one is due",
    source="ros2",
    topic="req_weather_data",
    sides=(
        Side(
            "publisher",
            (DRONE,),
            "set here",
            (
                Fact("lifespan", "1s", "option ros2.lifespan"),
                Fact("deadline", "2s", "profile request", yaml("2s")),
                Fact("depth", "1", "profile request", yaml("1, rel")),
                Fact("history", "keep_last", "default", yaml("req_weather_data: request")),
                Fact("liveliness", "automatic", "settled from best_available", yaml("req_weather_data: req")),
            ),
            yaml("req_weather_data: request"),
        ),
    ),
)

ACCEPTED = Finding(
    code="ROS201",
    name="latched-topic-read-volatile",
    severity=Severity.WARNING,
    message="subscriber `drone/subscriber/resp_weather_data` misses what was sent before it started",
    source="ros2",
    topic="resp_weather_data",
    sides=(Side("subscriber", ("drone/subscriber/resp_weather_data",), "", (), yaml("resp_weather_data: {rel")),),
    accepted="replay is not wanted here",
)

NO_PLACE = Finding(
    code="CQ401",
    name="no-broker-named",
    severity=Severity.WARNING,
    message="the system has MQTT clients but names no broker",
    help="name one under `brokers:`",
)

REALISTIC = Report(
    verdict=Verdict.INCOMPATIBLE,
    groups=(
        Group("position", ("drone/publisher/position",), UNKNOWN.sides[0].members, Verdict.UNKNOWN, "ros2"),
        Group(
            "req_weather_data",
            (DRONE,),
            (STATION,),
            Verdict.INCOMPATIBLE,
            "ros2",
            codes=("ROS101", "ROS103"),
        ),
        Group(
            "resp_weather_data",
            ("weather_station/publisher/resp_weather_data",),
            ("drone/subscriber/resp_weather_data",),
            Verdict.INCOMPATIBLE,
            "ros2",
            codes=("ROS102",),
        ),
        Group("status", ("drone/publisher/status",), ("drone/subscriber/status",), Verdict.COMPATIBLE, "ros2", 1),
    ),
    findings=(RELIABILITY, DEADLINE, DURABILITY, UNKNOWN, NOTE, ACCEPTED, NO_PLACE),
    not_checked=("whether the network lets them reach each other", "access permissions", "start-up races"),
    assumed=(Assumption("ros2.rmw", ("cyclonedds", "fastdds", "connext")),),
    system="smart-agriculture",
    sources=("system.yaml",),
    endpoints=22,
    topics=4,
)

CLEAN = Report(
    verdict=Verdict.COMPATIBLE,
    groups=(
        Group("a", ("p/publisher/a",), ("q/subscriber/a",), Verdict.COMPATIBLE, "dds"),
        Group("b", ("p/publisher/b",), ("q/subscriber/b",), Verdict.COMPATIBLE, "dds"),
    ),
    not_checked=("access permissions",),
    sources=("two/systems.yaml", "two/more.yaml"),
    endpoints=4,
    topics=2,
)

NOTHING = Report(verdict=Verdict.UNKNOWN)


def _drawn(role, element, label, value, path, line):
    place = Place("smart.bpmn", line, None, element, path)
    return Side(
        role,
        (element,),
        label,
        (Fact("reliability", value, "explicit", place),),
        Place("smart.bpmn", line, None, element),
    )


DIAGRAM = Report(
    verdict=Verdict.INCOMPATIBLE,
    groups=(Group("Req weather data", ("Drone_ThrowReq",), ("Station_CatchReq",), Verdict.INCOMPATIBLE, "ros2"),),
    findings=(
        Finding(
            code="ROS101",
            name="reliability-weaker-than-requested",
            severity=Severity.ERROR,
            message="publisher `Drone_ThrowReq` offers reliability best_effort, subscriber `Station_CatchReq` requests "
            "reliability reliable",
            topic="Req weather data",
            verdict=Verdict.INCOMPATIBLE,
            sides=(
                _drawn("subscriber", "Station_CatchReq", "requested here", "reliable", "@qos:reliability", 6),
                _drawn("publisher", "Drone_ThrowReq", "offered here", "best_effort", "@qos:reliability", 4),
            ),
            more_topics=("Resp weather data",),
            pairs=1,
        ),
    ),
    sources=("smart.bpmn",),
    endpoints=2,
    topics=1,
)

TRAP = "天気/\x1b]0;owned\x07\u202edeppart"

DANGER = Report(
    verdict=Verdict.INCOMPATIBLE,
    groups=(Group(TRAP, ("🚜/wetter",), ("a\nb", "שלום/דרך"), Verdict.INCOMPATIBLE, "ros2"),),
    findings=(
        Finding(
            code="ROS101",
            name="reliability-weaker\x1b[2J",
            severity=Severity.ERROR,
            message=f"::error::100% of `{TRAP}`\r\n天気予報は雨です、subscriber `a\nb` requests\treliable, `שלום/דרך`, too; "
            "👩\u200d🚀 é e\u0301 \ud800",
            topic=TRAP,
            verdict=Verdict.INCOMPATIBLE,
            sides=(
                Side(
                    "subscriber",
                    ("a\nb", "שלום/דרך"),
                    "requested here",
                    (
                        Fact(
                            "reliability",
                            "best\x1b[31m_effort",
                            "profile das\x07",
                            at("da, ta:%/天気.yaml", '"best', HOSTILE),
                        ),
                    ),
                ),
                Side(
                    "publisher",
                    ("🚜/wetter",),
                    "offered here",
                    (Fact("deadline", "1s", "explicit", at("da, ta:%/天気.yaml", "1s", HOSTILE)),),
                ),
                Side("topic", (), "", (), Place("gone\x1b.yaml", 7, 3)),
            ),
            remedies=(
                Remedy(
                    "publisher",
                    ("🚜/wetter",),
                    "reliability",
                    "reliable",
                    "configuration",
                    "offer\n`reliable`",
                ),
            ),
            notes=("\x9b31m, \x00 and \u2066",),
            because="]]> & <b>",
            pairs=2,
            worlds={"\x1b=1": Verdict.UNKNOWN},
        ),
    ),
    not_checked=("\x1b[0m",),
    system="::set-output name=\x1b::",
    sources=("da, ta:%/天気.yaml",),
    endpoints=3,
    topics=1,
)

REPORTS = {"realistic": REALISTIC, "clean": CLEAN, "nothing": NOTHING, "diagram": DIAGRAM, "hostile": DANGER}
SOURCES = {
    "system.yaml": YAML.encode(),
    "smart.bpmn": BPMN.encode(),
    "da, ta:%/天気.yaml": HOSTILE.encode(),
}


def pytest_addoption(parser):
    parser.addoption("--update-golden", action="store_true", help="write the golden files of formatters anew")


@pytest.fixture(params=sorted(REPORTS))
def any_report(request):
    return REPORTS[request.param]


@pytest.fixture
def reports():
    """All reports by name."""
    return REPORTS


@pytest.fixture
def style():
    return Style(sources=SOURCES, tool_version="1.2.3")


@pytest.fixture
def golden(request):
    """Compare a text with a golden file, or write the file with ``--update-golden``."""

    def check(name, text):
        file = GOLDEN / name
        if request.config.getoption("--update-golden", default=False):
            file.write_bytes(text.encode())
        assert text == file.read_bytes().decode()

    return check
