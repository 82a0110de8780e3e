"""The predefined profiles: their values, their names, and that every distribution can use them."""

import pytest

from cqos_core import check_pair
from cqos_core.packs import Choice
from cqos_ros2.pack import PACK
from cqos_ros2.policies import DISTRO, RMW
from cqos_ros2.presets import PRESETS

# rmw/qos_profiles.h and rcl: history, depth, reliability, durability, deadline, lifespan, liveliness, lease ("-": unspecified)
TABLE = """
default               | keep_last      | 10   | reliable       | volatile        | -              | -   | system_default | -
sensor_data           | keep_last      | 5    | best_effort    | volatile        | -              | -   | system_default | -
services_default      | keep_last      | 10   | reliable       | volatile        | -              | -   | system_default | -
parameters            | keep_last      | 1000 | reliable       | volatile        | -              | -   | system_default | -
parameter_events      | keep_last      | 1000 | reliable       | volatile        | -              | -   | system_default | -
rosout                | keep_last      | 1000 | reliable       | transient_local | -              | 10s | system_default | -
clock                 | keep_last      | 1    | best_effort    | volatile        | -              | -   | system_default | -
action_status_default | keep_last      | 1    | reliable       | transient_local | -              | -   | system_default | -
system_default        | system_default | 0    | system_default | system_default  | -              | -   | system_default | -
best_available        | keep_last      | 10   | best_available | best_available  | best_available | -   | best_available | best_available
unknown               | unknown        | 0    | unknown        | unknown         | -              | -   | unknown        | -
"""
COLUMNS = (
    "history depth reliability durability deadline lifespan liveliness liveliness_lease_duration".split()  # noqa: SIM905
)
assert isinstance(DISTRO.domain, Choice)
assert isinstance(RMW.domain, Choice)
DISTROS, MIDDLEWARES = DISTRO.domain.names, RMW.domain.names


def test_the_table_of_profiles():
    for line in TABLE.strip().splitlines():
        name, *cells = (cell.strip() for cell in line.split("|"))
        expected = dict(zip(COLUMNS, ("unspecified" if cell == "-" else cell for cell in cells), strict=True))
        assert PRESETS[name].settings == expected | {"avoid_ros_namespace_conventions": "false"}, name


@pytest.mark.parametrize("distro", DISTROS)
@pytest.mark.parametrize("preset", PRESETS)
def test_every_preset_can_be_used_in_every_distribution_that_has_it(distro: str, preset: str):
    for rmw in MIDDLEWARES:
        report = check_pair(
            "ros2", {"profile": preset}, {"profile": preset}, {"distro": distro, "rmw": rmw}, packs=[PACK]
        )
        reported = {finding.code for finding in report.findings if finding.code.startswith("CQ")}
        too_old = preset == "best_available" and distro in {"foxy", "galactic", "humble"}
        assert reported == ({"CQ207"} if too_old else set())
        if preset not in {"unknown", "best_available"}:
            assert report.verdict == "compatible"


@pytest.mark.parametrize("preset", sorted(set(PRESETS) - {"unknown", "best_available"}))
def test_every_preset_meets_itself_whatever_the_middleware(preset: str):
    report = check_pair("ros2", {"profile": preset}, {"profile": preset}, packs=[PACK])
    assert report.verdict == "compatible"


@pytest.mark.parametrize(
    ("written", "preset"),
    [
        ("SENSOR_DATA", "sensor_data"),
        ("Sensor Data", "sensor_data"),
        ("qos_profile_sensor_data", "sensor_data"),
        ("rmw_qos_profile_sensor_data", "sensor_data"),
        ("SensorDataQoS", "sensor_data"),
        ("sensor_qos", "sensor_data"),
        ("default_qos", "default"),
        ("services_qos", "services_default"),
        ("parameter_qos", "parameters"),
        ("SystemDefaultsQoS", "system_defaults_cpp"),
        ("rcl_action_qos_profile_status_default", "action_status_default"),
        ("StaticListenerQoS", "tf_static_listener"),
    ],
)
def test_profiles_are_known_by_all_their_names(written: str, preset: str):
    from cqos_core.packs import normalise

    assert PACK.preset_names[normalise(written)] == preset


def test_no_two_profiles_have_a_name_in_common():
    spellings = [name for preset in PRESETS.values() for name in preset.aliases] + list(PRESETS)
    assert len(PACK.preset_names) == len({spelling.lower() for spelling in spellings})
