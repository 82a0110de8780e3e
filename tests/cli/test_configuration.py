"""``cqos.toml`` and ``[tool.cqos]``, under the command line."""

import json

import pytest

SILENT = '[severities]\nROS101 = "off"\n'


def report_of(done):
    return json.loads(done.out)


def test_the_nearest_configuration_holds(cqos, files):
    inner = files / "a" / "b"
    inner.mkdir(parents=True)
    (inner / "clashes.yaml").write_text((files / "clashes.yaml").read_text())
    (files / "cqos.toml").write_text(SILENT)
    assert cqos("check", "a/b/clashes.yaml").code == 0
    assert cqos("check", "a").code == 0
    (files / "a" / "pyproject.toml").write_text("[tool.cqos]\n")
    assert cqos("check", "a/b/clashes.yaml").code == 1
    assert cqos("check", "clashes.yaml").code == 0


def test_a_configuration_can_be_named_or_left_out(cqos, files):
    (files / "cqos.toml").write_text(SILENT)
    (files / "other.toml").write_text('fail_on = "warning"\n')
    assert cqos("check", "clashes.yaml", "--no-config").code == 1
    assert cqos("check", "clashes.yaml", "--config", "other.toml").code == 1
    assert cqos("check", "lonely.yaml", "--config", "other.toml").code == 1
    assert cqos("check", "lonely.yaml").code == 0


@pytest.mark.parametrize(
    ("configuration", "arguments", "code"),
    [
        ('fail_on = "warning"', ["lonely.yaml"], 1),
        ('fail_on = "warning"', ["lonely.yaml", "--fail-on", "error"], 0),
        ("[options.ros2]\nrmw = 'zenoh'", ["clashes.yaml"], 0),
        ("[options.ros2]\nrmw = 'zenoh'", ["clashes.yaml", "--option", "ros2.rmw=fastdds"], 1),
        ("protocol = 'nonsense'", ["fits.yaml"], 2),
        ("format = 'nonsense'", ["fits.yaml"], 2),
        ("nonsense = 1", ["fits.yaml"], 2),
        ("= ", ["fits.yaml"], 2),
        ("packs = ['missing.yaml']", ["fits.yaml"], 2),
        ("baseline = 'missing.json'", ["fits.yaml"], 2),
    ],
)
def test_the_command_line_wins(cqos, files, configuration, arguments, code):
    (files / "cqos.toml").write_text(configuration + "\n")
    done = cqos("check", *arguments)
    assert done.code == code
    if code == 2:
        assert done.out == ""
        assert "cqos.toml" in done.err or "missing" in done.err


def test_text_is_shown_as_configured(cqos, files):
    (files / "cqos.toml").write_text('format = "json"\nshow = "notes"\n')
    assert report_of(cqos("check", "fits.yaml"))["verdict"] == "compatible"
    assert cqos("check", "fits.yaml", "--format", "concise").out.startswith("fits.yaml: compatible")


def test_the_protocol_of_the_configuration_is_for_files_that_state_none(cqos, files):
    (files / "cqos.toml").write_text('protocol = "ros2"\n')
    (files / "bare.yaml").write_text((files / "clashes.yaml").read_text().replace("protocol: ros2\n", ""))
    assert cqos("check", "bare.yaml").code == 1
    assert cqos("check", "bare.yaml", "--no-config").code == 2


def test_a_baseline_of_the_configuration_stands_beside_it(cqos, files):
    inner = files / "deep"
    inner.mkdir()
    (inner / "clashes.yaml").write_text((files / "clashes.yaml").read_text())
    (files / "cqos.toml").write_text('baseline = "known.json"\n')
    assert cqos("check", "deep", "--write-baseline", "known.json").code == 0
    assert cqos("check", "deep").code == 0


def test_the_configuration_is_no_source_of_the_system(cqos, files):
    (files / "cqos.toml").write_text(SILENT)
    assert report_of(cqos("check", "fits.yaml", "--format", "json"))["sources"] == ["fits.yaml"]


def test_an_exception_is_unused_only_if_no_system_of_the_run_needs_it(cqos, files):
    accept = '[[accept]]\nrule = "ROS101"\nbecause = "known"\n[[accept]]\nrule = "ROS102"\nbecause = "never"\n'
    (files / "cqos.toml").write_text(accept)
    done = cqos("check", "--each", "clashes.yaml", "fits.yaml", "lonely.yaml", "--format", "json")
    unused = [finding["message"] for finding in report_of(done)["findings"] if finding["code"] == "CQ601"]
    assert done.code == 0
    assert len(unused) == 1
    assert "ROS102" in unused[0]


def test_a_finding_about_the_configuration_shows_its_line(cqos, files):
    (files / "cqos.toml").write_text('[[accept]]\nrule = "ROS102"\nbecause = "never"\n')
    out = cqos("check", "fits.yaml").out
    assert "--> cqos.toml:1" in out
    assert "1 | [[accept]]" in out


def test_standard_input_has_the_configuration_of_its_name(cqos, files):
    (files / "a").mkdir()
    (files / "a" / "cqos.toml").write_text(SILENT)
    text = (files / "clashes.yaml").read_text()
    assert cqos("check", "-", stdin=text).code == 1
    assert cqos("check", "-", "--stdin-name", "a/x.yaml", stdin=text).code == 0
