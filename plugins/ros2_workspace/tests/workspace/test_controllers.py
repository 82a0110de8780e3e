"""Controllers of ros2_control: nodes inside of the controller manager, loaded by the spawners of the launch."""

import pytest

TYPES = """controller_manager:
  ros__parameters:
    wheels: {type: diff_drive_controller/DiffDriveController}
    joints: {type: joint_state_broadcaster/JointStateBroadcaster}
joints:
  ros__parameters: {use_local_topics: true}
"""
FILES = {"bot/config/control.yaml": TYPES}
MANAGER = (
    '<node pkg="controller_manager" exec="ros2_control_node"><param from="$(find-pkg-share bot)/config/control.yaml"/>{}'
    "</node>\n"
)


def launch_of(*spawners, inner=""):
    nodes = "".join(f'<node pkg="controller_manager" exec="spawner" args="{each}"/>\n' for each in spawners)
    return {"bot/launch/bot.launch.xml": f"<launch>\n{MANAGER.format(inner)}{nodes}</launch>\n", **FILES}


def topics(system):
    return {(each.participant, each.topic) for each in system.endpoints}


HARDWARE = "the nodes of its hardware components: the robot description names them"


def gaps(system):
    return [each.message for each in system.notes if each.code == "ROS979" and HARDWARE not in each.message]


def test_spawners_load_controllers_with_parameters_and_remaps_of_the_manager(joined):
    renamed = '<remap from="/wheels/cmd_vel" to="/cmd_vel"/>'
    system = joined(launch_of("wheels", "joints -c /controller_manager --inactive", inner=renamed))
    assert topics(system) == {
        ("/controller_manager", "/controller_manager/robot_description"),
        ("/joints", "/joints/joint_states"),
        ("/joints", "/joints/dynamic_joint_states"),
        ("/wheels", "/wheels/odom"),
        ("/wheels", "/tf"),
        ("/wheels", "/cmd_vel"),
    }
    assert gaps(system) == []


@pytest.mark.parametrize("given", ["--namespace left", "-n /left"])
def test_a_spawner_finds_the_manager_of_another_namespace(joined, given):
    files = launch_of(f"wheels {given}")
    launch = files["bot/launch/bot.launch.xml"].replace(
        'exec="ros2_control_node"', 'exec="ros2_control_node" namespace="left"'
    )
    assert gaps(joined({**files, "bot/launch/bot.launch.xml": launch})) == [
        "`/left/controller_manager`: the controller `wheels`: no parameter `wheels.type`"
    ]


def test_a_remap_may_be_for_a_node_of_the_hardware(joined):
    system = joined(launch_of("wheels", inner='<remap from="~/motors" to="/motors"/>'))
    assert not [each for each in system.notes if each.code == "ROS972"]
    assert any(HARDWARE in each.message for each in system.notes)


@pytest.mark.parametrize(
    ("spawner", "message"),
    [
        ("arm", "`/controller_manager`: the controller `arm`: no parameter `arm.type`"),
        ("wheels -c /other", "`/spawner`: the controllers that it loads: the launch starts no node `/other`"),
        ("wheels --param-file x.yaml", "`/controller_manager`: the controllers that a spawner loads: its option `--param-file` is not read"),
    ],
)  # fmt: skip
def test_the_report_names_unknown_controllers(joined, spawner, message):
    assert message in gaps(joined(launch_of(spawner)))


def test_a_stated_type_wins_and_an_unknown_one_is_a_node_without_facts(joined):
    system = joined(launch_of("arm --controller-type=own_controllers/Arm"))
    assert any("`/arm` (no node file for `own_controllers` `Arm`)" in each.message for each in system.notes)
