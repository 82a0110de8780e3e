"""``cqos explain --log``: what running programs complain of."""

import json

import pytest

SENT = "No messages will be sent to it. Last incompatible policy:"
LOG = f"""\
[INFO] [launch]: Default logging verbosity is set to INFO
[lidar-1] \x1b[33m[WARN] [1673945160.4] [lidar]: New subscription discovered on topic '/scan', requesting incompatible QoS. {SENT} RELIABILITY_QOS_POLICY\x1b[0m
[planner-2] [WARN] [1673945160.5] [planner]: New publisher discovered on topic '/scan', offering incompatible QoS. No messages will be received from it. Last incompatible policy: RELIABILITY
[planner-2] [WARN] [1673945161.5] [planner]: New publisher discovered on topic '/scan', offering incompatible QoS. No messages will be received from it. Last incompatible policy: RELIABILITY
"""


@pytest.fixture
def log(files):
    (files / "node.log").write_text(LOG, encoding="utf-8")
    return "node.log"


def test_by_the_system_all_policies_and_what_to_change(forked, log, files):
    (files / "both.yaml").write_text(
        (files / "clashes.yaml").read_text().replace("reliability: reliable", "reliability: reliable, deadline: 1s")
    )
    done = forked("explain", "--log", log, "both.yaml", COLUMNS="200")
    assert done.code == 1
    lines = done.out.splitlines()
    assert lines[:5] == [
        "/scan",
        "  node.log:2: a publisher of /lidar discovered a subscriber that requests what does not fit: RELIABILITY_QOS_POLICY",
        "    lidar/publisher/scan and planner/subscriber/scan: incompatible, ROS101, ROS103",
        "  node.log:3, 2 times: a subscriber of /planner discovered a publisher that offers what does not fit: RELIABILITY",
        "    lidar/publisher/scan and planner/subscriber/scan: incompatible, ROS101, ROS103",
    ]
    assert done.out.count("error[ROS101]") == done.out.count("error[ROS103]") == 1
    assert "offer reliability `reliable` on lidar/publisher/scan" in done.out
    assert done.out.endswith("incompatible: 1 topic, 1 pair judged, 2 errors\n")


def test_by_the_line_alone(forked, log):
    done = forked("explain", "--log", log, COLUMNS="300")
    assert done.code == 1
    assert done.out.count("ROS101 reliability-weaker-than-requested: a best_effort publisher") == 2
    assert "only the last is named" in done.out
    assert "cqos explain --log node.log PATH..." in done.out


def test_as_json(forked, log):
    document = json.loads(forked("explain", "--log", log, "clashes.yaml", "--format", "json").out)
    assert (document["version"], document["log"], document["lines"]) == (1, "node.log", 4)
    first, second = document["misfits"]
    assert first == {
        "protocol": "ros2",
        "topic": "/scan",
        "participant": "/lidar",
        "role": "publisher",
        "named": "RELIABILITY_QOS_POLICY",
        "policies": ["reliability"],
        "count": 1,
        "place": {"source": "node.log", "line": 2},
        "rules": ["ROS101"],
        "pairs": [
            {
                "topic": "/scan",
                "publisher": "lidar/publisher/scan",
                "subscriber": "planner/subscriber/scan",
                "verdict": "incompatible",
                "rules": ["ROS101"],
            }
        ],
        "remark": None,
    }
    assert second["count"] == 2
    assert [finding["code"] for finding in document["findings"]] == ["ROS101"]


def test_standard_input(forked):
    done = forked("explain", "--log", "-", "fits.yaml", stdin=LOG)
    assert done.code == 1
    assert "<stdin>:2" in done.out
    assert "by the system they fit, so what runs differs from it" in done.out
    done = forked("explain", "--log", "-", "-", stdin=LOG)
    assert (done.code, "are both standard input" in done.err) == (2, True)


def test_a_log_without_complaints(forked, files):
    (files / "quiet.log").write_text("all is well\n")
    done = forked("explain", "--log", "quiet.log", "clashes.yaml")
    assert (done.code, done.out) == (0, "quiet.log: in 1 line no program says that an endpoint does not fit\n")
    assert json.loads(forked("explain", "--log", "quiet.log", "--format", "json").out)["misfits"] == []


@pytest.mark.parametrize(
    "data",
    [
        b"",
        b"\0" * 1000,
        bytes(range(256)) * 100,
        b"\xff\xfe\x00",
        b"\xff\xfe" + LOG.encode("utf-16-le"),
        b"[" * 300_000,
    ],
)
def test_hostile_logs(forked, files, data):
    (files / "hostile.log").write_bytes(data)
    done = forked("explain", "--log", "hostile.log", "clashes.yaml")
    assert done.code == (1 if b"N\0e\0w" in data else 0)
    assert done.err == ""


def test_a_topic_cannot_act_on_the_terminal(forked, files):
    line = LOG.splitlines()[1].replace("/scan", "/s\x07\u202ecan")
    (files / "strange.log").write_text(line, encoding="utf-8")
    done = forked("explain", "--log", "strange.log", "--color", "never")
    assert done.code == 1
    assert "\x07" not in done.out
    assert "\\x07" in done.out


@pytest.mark.parametrize("path", ["missing.log", ".", "a\0b"])
def test_logs_that_cannot_be_read(cqos, path):
    done = cqos("explain", "--log", path)
    assert done.code == 2
    assert "cannot be read" in done.err


def test_systems_that_cannot_be_read(cqos, log):
    assert cqos("explain", "--log", log, "broken.yaml").code == 2
    assert cqos("explain", "--log", log, "missing.yaml").code == 2
    assert cqos("explain").code == 2
