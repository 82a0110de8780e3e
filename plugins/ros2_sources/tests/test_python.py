"""What is learned from Python: known values as they are, all others as not known. Nothing is imported."""

from __future__ import annotations

import pytest


@pytest.mark.parametrize(
    ("body", "name", "qos"),
    [
        ("self.create_publisher(String, 'a', 7)", "a", {"depth": 7}),
        ("self.create_publisher(String, topic='a', qos_profile=qos_profile_sensor_data)", "a", "sensor_data"),
        ("q = QoSProfile(depth=2, reliability=ReliabilityPolicy.BEST_EFFORT)\nself.create_publisher(String, 'a', q)", "a", {"depth": 2, "reliability": "best_effort"}),
        ("q = QoSProfile(depth=2)\nr = q\nr.durability = DurabilityPolicy.TRANSIENT_LOCAL\nself.create_publisher(String, 'a', q)", "a", {"depth": 2, "durability": "transient_local"}),
        ("t = self.declare_parameter('topic', 'scan').value\nself.create_publisher(String, f'{t}/x', 1)", "${topic}/x", {"depth": 1}),
        ("self.declare_parameter('topic', 'scan')\nt = self.get_parameter('topic').get_parameter_value().string_value\nself.create_publisher(String, t, 1)", "${topic}", {"depth": 1}),
        ("self.create_publisher(String, TOPIC, 1)", "constant", {"depth": 1}),
        ("self.create_publisher(String, self.named('x'), 1)", "x_topic", {"depth": 1}),
    ],
)  # fmt: skip
def test_values_are_followed(python, body, name, qos):
    found = python(body, "    def named(self, start):\n        return start + '_topic'\n", "TOPIC = 'constant'")
    assert list(found["publishes"]) == [name]
    assert found["publishes"][name]["qos"] == qos
    assert found["publishes"][name]["type"] == "std_msgs/msg/String"


@pytest.mark.parametrize(
    "body",
    [
        "import sys\nself.create_publisher(String, sys.argv[1], 1)",
        "t = 'a'\nif unknown():\n    t = 'b'\nself.create_publisher(String, t, 1)",
        "t = 'a'\nwhile unknown():\n    t = t + 'x'\nself.create_publisher(String, t, 1)",
        "self.create_publisher(String, CHANGED, 1)",
    ],
)
def test_a_name_that_is_not_decided_is_unknown(python, body):
    before = "CHANGED = 'a'\ndef change():\n    global CHANGED\n    CHANGED = 'b'\n"
    found = python(body, "", before)
    assert all("unknown" in each for each in found["publishes"].values())


def test_subscriptions_services_and_actions(python):
    body = "self.create_subscription(String, 'in', self.on, 10)\nself.create_service(Trigger, 'reset', self.on)\nself.create_client(Trigger, 'ask')"
    found = python(body, "    def on(self, m): pass\n", "from std_srvs.srv import Trigger")
    assert (list(found["subscribes"]), list(found["serves"]), list(found["calls"])) == (["in"], ["reset"], ["ask"])
    assert found["serves"]["reset"]["type"] == "std_srvs/srv/Trigger"


def test_a_script_that_is_installed_by_cmake(learned):
    script = "import rclpy\nfrom std_msgs.msg import String\ndef main():\n    node = rclpy.create_node('n')\n    node.create_publisher(String, 'a', 1)\nif __name__ == '__main__':\n    main()\n"
    files = {"CMakeLists.txt": "install(PROGRAMS scripts/n.py DESTINATION lib/bot)", "scripts/n.py": script}
    assert list(learned(files).document["nodes"]["n.py"]["publishes"]) == ["a"]


def test_nothing_is_executed(learned, tmp_path):
    mark = tmp_path / "executed"
    source = f"open({str(mark)!r}, 'w').write('x')\ndef main():\n    pass\n"
    learned(
        {
            "setup.py": f"{source}\nfrom setuptools import setup\nsetup(entry_points={{'console_scripts': ['driver = bot.driver:main']}})\n",
            "bot/driver.py": source,
        }
    )
    assert not mark.exists()


def test_what_may_be_among_the_rest_of_the_arguments_is_not_known(python):
    found = python(
        "rest = load()\nself.create_service(String, 'a', self.f, **rest)\nself.create_publisher(String, 'b', *rest)"
    )
    assert "unknown" in found["serves"]["a"]["qos"]
    assert "unknown" in found["publishes"]["b"]["qos"]


def test_a_parameter_chooses_a_policy_by_its_number(python):
    body = "n = self.declare_parameter('n', ReliabilityPolicy.BEST_EFFORT).value\nself.create_publisher(String, 'a', QoSProfile(depth=1, reliability=n))"
    found = python(body)
    assert found["parameters"] == {"n": {"default": 2}}
    assert {"when": {"n": "1"}, "depth": 1, "reliability": "reliable"} in found["publishes"]["a"]["qos"]


def test_a_parameter_that_the_program_sets(python):
    body = "self.declare_parameter('t', 'a')\nself.set_parameters([rclpy.parameter.Parameter('t', value=read())])\nself.create_publisher(String, self.get_parameter('t').value, 1)"
    assert list(python(body)["publishes"]) == ["(unknown 1)"]


@pytest.mark.parametrize(
    ("made", "names"),
    [
        ("Base('driver')", {"a"}),
        ("Base('driver', topic='b')", {"b"}),
        ("Base('driver', **unknown())", set()),
        ("Base('driver', *unknown())", {"a"}),
        ("Base(name='driver', topic='b', depth=3)", {"b"}),
    ],
)
def test_the_rest_of_the_arguments_is_what_the_call_leaves_for_it(learned, made, names):
    source = f"""import rclpy
from rclpy.node import Node
from std_msgs.msg import String

class Base(Node):
    def __init__(self, name, *rest, topic='a', **options):
        super().__init__(name, **wrapped(*rest, **options))
        self.publish(topic=topic, **options)

    def publish(self, topic, depth=1, **other):
        self.create_publisher(String, topic, depth, **other)

def wrapped(**options):
    return {{}}

def main():
    rclpy.spin({made})
"""
    setup = "from setuptools import setup\nsetup(entry_points={'console_scripts': ['driver = bot.driver:main']})\n"
    found = learned({"setup.py": setup, "bot/driver.py": source}).document["nodes"]["driver"]
    assert {name for name, each in found["publishes"].items() if "unknown" not in each} == names
    if names == {"b"} and "depth" in made:
        assert found["publishes"]["b"]["qos"] == {"depth": 3}


@pytest.mark.parametrize("base", ["LifecycleNode", "Base"])
def test_a_method_of_the_base_class(learned, base):
    source = f"""import rclpy
from rclpy.lifecycle import LifecycleNode
from std_msgs.msg import String

class Base(LifecycleNode):
    def on_configure(self, state):
        {"self.create_publisher(String, 'base', 1)" if base == "Base" else "pass"}

class Driver({base}):
    def __init__(self):
        super().__init__('driver')

    def on_configure(self, state):
        self.create_publisher(String, 'own', 1)
        super().on_configure(state)

def main():
    rclpy.spin(Driver())
"""
    setup = "from setuptools import setup\nsetup(entry_points={'console_scripts': ['it = bot.driver:main']})\n"
    found = learned({"setup.py": setup, "bot/driver.py": source}).document["nodes"]["it"]
    assert found["name"] == "driver"
    assert {*found["publishes"]} == ({"own"} if base == "LifecycleNode" else {"own", "base"})
    assert "unread" not in found
