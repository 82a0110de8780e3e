"""Keys that look like QoS: typing errors of its names, and its names in the wrong place."""

import pytest

from cqos_core.packs.qos_keys import looks_like_qos

NAMES = ("qos", "max_qos", "reliability", "Reliability Policy", "history.depth", "depth", "retain", "will")


@pytest.mark.parametrize(
    ("key", "name"),
    [
        ("reliabilty", "reliability"),
        ("reliability", "reliability"),
        ("Reliability", "reliability"),
        ("Reliabilty Policy", "Reliability Policy"),
        ("maxQos", "max_qos"),
        ("max_qoss", "max_qos"),
        ("history-depht", "history.depth"),
        ("qoss", "qos"),
        ("qso", "qos"),
        ("dpeth", "depth"),
        ("retan", "retain"),
    ],
)
def test_looks_like_qos(key, name):
    assert looks_like_qos(key, NAMES) == name


@pytest.mark.parametrize("key", ["", "q", "qo", "pos", "cos", "wil", "bill", "topic", "health", "colour", "r" * 5000])
def test_does_not(key):
    assert looks_like_qos(key, NAMES) is None


def test_the_nearest_name_is_meant():
    assert looks_like_qos("depth", ("dept", "depth")) == "depth"
