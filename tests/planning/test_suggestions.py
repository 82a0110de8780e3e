"""Settings from requirements: applied and checked again, there is no finding; and what is stated stays."""

import pytest

import cqos_core as cqos
from cqos_core.analysis.planning.suggestion import find_suggestion
from cqos_core.model.report import Severity
from tests.planning.systems import NAME, WHERE, again, report_of

SYSTEMS = {
    "ros2": "protocol: ros2\nparticipants:\n  a: {publishes: {t: }}\n  b: {subscribes: {t: {needs: {late_join: 3, latest: true}}}}\n",
    "restart": "protocol: ros2\nparticipants:\n  a: {publishes: {t: }}\n"
    "  b: {subscribes: {t: {needs: {late_join: 1, survives: [subscriber_restart]}}}}\n",
    "dds": "protocol: dds\nparticipants:\n  a: {publishes: {t: }}\n  b: {subscribes: {t: {needs: {late_join: 2, latest: true}}}}\n",
    "mqtt": "protocol: mqtt\nparticipants:\n  a: {publishes: {t: }}\n  b: {subscribes: {t: {needs: {late_join: 1, latest: true}}}}\n",
}


def suggested(text):
    return find_suggestion({NAME: f"cqos: 1\n{text}".encode()}, again, WHERE)


@pytest.mark.usefixtures("solver")
@pytest.mark.parametrize("name", SYSTEMS)
def test_after_a_suggestion_nothing_is_found(name):
    plan = suggested(SYSTEMS[name])
    assert plan.confirmed, plan.conflict
    assert plan.proven
    assert plan.changes
    after = report_of(again(plan.edited.texts))
    assert str(after.verdict) == "compatible"
    assert [each for each in after.findings if each.severity is not Severity.NOTE] == []


@pytest.mark.usefixtures("solver")
def test_what_is_stated_stays():
    text = SYSTEMS["ros2"].replace("{t: }", "{t: {reliability: best_effort}}")
    plan = suggested(text)
    assert not plan.confirmed
    assert any("ROS" in part and "`a/publisher/t`" in part for part in plan.conflict)


@pytest.mark.usefixtures("solver")
def test_without_requirements_nothing_is_suggested():
    plan = suggested("protocol: ros2\nparticipants:\n  a: {publishes: {t: }}\n  b: {subscribes: {t: }}\n")
    assert plan.confirmed
    assert plan.changes == ()


@pytest.mark.usefixtures("solver")
def test_the_library_plans_for_files_and_bytes(tmp_path):
    text = f"cqos: 1\n{SYSTEMS['ros2']}".encode()
    (tmp_path / "a.yaml").write_bytes(text)
    of_bytes, of_file = cqos.suggest(text), cqos.suggest(tmp_path / "a.yaml")
    assert [each.text for each in of_bytes.changes] == [each.text for each in of_file.changes]
    of_file.edited.write()
    assert cqos.repair(tmp_path).changes == ()
    with pytest.raises(TypeError, match="give paths or bytes"):
        cqos.repair(cqos.read(text))
