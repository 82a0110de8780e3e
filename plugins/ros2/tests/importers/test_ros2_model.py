"""Component models of RosTooling: their own little language, and models that are none."""

import pytest

from cqos_core import InputError
from cqos_core.model.source import ReadContext, Source
from cqos_ros2.importers.ros2_model import read
from tests.growth.linear import assert_linear

HEAD = "pkg:\n  artifacts:\n    talker:\n      node: talker\n      publishers:\n"


def model(text):
    return read(Source("m.ros2", text.encode()), ReadContext())


def problems(text):
    with pytest.raises(InputError) as refused:
        model(text)
    return [str(problem) for problem in refused.value.problems]


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("", "m.ros2:1:1: there is no package in this model"),
        ("\n# nothing\n", "m.ros2:1:1: there is no package in this model"),
        (
            "PackageSet {\n  CatkinPackage a {}\n}\n",
            "m.ros2:1:1: this is a model in the older form of RosTooling, with braces",
        ),
        (
            "AmentPackage a { Artifact b {} }",
            "m.ros2:1:1: this is a model in the older form of RosTooling, with braces",
        ),
        (HEAD + "        chat", "m.ros2:6:9: this is neither `key:` nor `key: value`: `chat`"),
        (HEAD + '        chatter:\n          type: "std_ms', "m.ros2:7:11: the quotes are never closed"),
        (
            HEAD + "        chatter:\n          qos: profile sensor",
            "m.ros2:7:16: `profile sensor` is no policy with a value",
        ),
        ("pkg:\n  artifacts:\n    a:\n      publishers:\n        b: x\n", "m.ros2:3:5: artifact `a` names no node"),
        (
            "".join(" " * depth + f"k{depth}:\n" for depth in range(40)),
            "m.ros2:33:33: this is nested deeper than any model",
        ),
        ("- a\n- b\n", "m.ros2:1:1: this is neither `key:` nor `key: value`: `- a`"),
    ],
)
def test_a_malformed_model_is_refused_with_its_place(text, expected):
    assert problems(text)[0].startswith(expected)


def test_all_malformed_lines_are_reported():
    assert len(problems(HEAD + "        a\n        b\n        c:\n")) == 2


@pytest.mark.parametrize(
    ("namespace", "topic"),
    [
        ("", "scan"),
        ("GlobalNamespace", "/scan"),
        ("GlobalNamespace [front, left]", "/front/left/scan"),
        ("RelativeNamespace [front]", "front/scan"),
        ("PrivateNamespace", "~/scan"),
        ('PrivateNamespace ["front"]', "~/front/scan"),
    ],
)
def test_namespaces_stand_before_names(namespace, topic):
    (endpoint,) = model(HEAD + f"        scan:\n          ns: {namespace}\n").endpoints
    assert endpoint.topic == topic


def test_comments_and_windows_line_ends_mean_nothing():
    text = (
        HEAD
        + "        # a comment\n        chatter:   # another: one\n          type: 'a/msg/B'  # third\n/* and\n more */\n"
    )
    for ends in ("\n", "\r\n"):
        (endpoint,) = model(text.replace("\n", ends)).endpoints
        assert (endpoint.topic, endpoint.type) == ("chatter", "a/msg/B")


@pytest.mark.parametrize(
    ("start", "piece", "end"), [("x", " ", "y"), ("a:", " ", "'"), ("", "[", ""), ("", "a: 'b' ", "")]
)
def test_hostile_lines_take_linear_time(start, piece, end):
    assert_linear(lambda size: problems(f"{HEAD}        {start}{piece * (size // len(piece))}{end}"), 50_000)
