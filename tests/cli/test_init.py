"""``cqos init``: a configuration that says what lies in a folder, and that can be read whatever is taken out of its comments."""

import re

import pytest

from cqos_core.config import load_config

ROS = "cqos: 1\nprotocol: ros2\nparticipants: {a: {publishes: {/t: }}, b: {subscribes: {/t: }}}\n"
MQTT = ROS.replace("ros2", "mqtt")


def test_it_states_the_protocol_of_what_is_there_and_changes_no_verdict(cqos, files, tmp_path):
    folder = tmp_path / "robot"
    folder.mkdir()
    (folder / "a.yaml").write_text(ROS)
    before = cqos("check", folder).out
    done = cqos("init", folder)
    assert (done.code, done.err) == (0, "")
    assert done.out == f"{folder / 'cqos.toml'} is written: 1 whole system found, of ros2\n"
    config = load_config(folder / "cqos.toml")
    assert (config.protocol, config.fail_on, config.accept) == ("ros2", None, ())
    assert cqos("check", folder).out == before


def test_of_several_protocols_none_is_stated_and_the_options_of_all_are_listed(cqos, files, tmp_path):
    folder = tmp_path / "fleet"
    folder.mkdir()
    (folder / "a.yaml").write_text(ROS)
    (folder / "b.yaml").write_text(MQTT)
    cqos("init", folder)
    text = (folder / "cqos.toml").read_text()
    assert load_config(folder / "cqos.toml").protocol is None
    assert "[options.mqtt]" in text
    assert "[options.ros2]" in text


def test_each_commented_key_can_be_taken_into_use(cqos, files, tmp_path):
    (tmp_path / "team.toml").write_text("")
    folder = tmp_path / "robot"
    folder.mkdir()
    (folder / "a.yaml").write_text(ROS)
    cqos("init", folder)
    text = re.sub(r"^# (?=\[|\w+ = )", "", (folder / "cqos.toml").read_text(), flags=re.MULTILINE)
    (folder / "cqos.toml").write_text(text)
    config = load_config(folder / "cqos.toml")
    assert (config.fail_on, config.show, config.format) == ("warning", ("notes",), "concise")
    assert config.options["ros2"]["rmw"].text == "cyclonedds"
    assert (len(config.accept), len(config.severities), len(config.packs)) == (1, 1, 1)


@pytest.mark.parametrize(("name", "text"), [("cqos.toml", "# ours\n"), ("pyproject.toml", "[tool.cqos]\n")])
def test_a_configuration_that_is_there_is_never_changed(cqos, files, tmp_path, name, text):
    folder = tmp_path / "robot"
    folder.mkdir()
    (folder / name).write_text(text)
    done = cqos("init", folder)
    assert (done.code, "is there already; C-QoS does not overwrite it" in done.err) == (2, True)
    assert [(each.name, each.read_text()) for each in folder.iterdir()] == [(name, text)]


def test_a_configuration_above_is_named_because_it_no_longer_counts(cqos, files, tmp_path):
    (tmp_path / "cqos.toml").write_text("")
    folder = tmp_path / "robot"
    folder.mkdir()
    done = cqos("init", "robot")
    assert done.code == 0
    assert "no design found" in done.out
    assert done.err.startswith("note: cqos.toml no longer counts here")


def test_a_folder_that_is_missing_is_wrong_usage(cqos, files):
    assert cqos("init", "nowhere").code == 2
