"""Classes of Python with a base class that was not read: what its methods may change, and what those of a node cannot."""

from __future__ import annotations

import pytest

from cqos_ros2_sources.node_files.node_file_maker import learn
from cqos_ros2_workspace.launch.workspace import find_packages

FIVE = {"depth": 5}
UNKNOWN = "unknown"
SETUP = "from setuptools import setup\nsetup(entry_points={'console_scripts': ['driver = bot.driver:main']})\n"
SOURCE = """
import rclpy
from rclpy.node import Node
from rclpy.qos import QoSProfile
from std_msgs.msg import String
from other_package import Base, Mixin

class Read:
    def known(self):
        return 1

class Between(Node):
    pass

class Driver({bases}):
    def __init__(self):
        super().__init__('driver')
        self.qos = QoSProfile(depth=5)
        {call}
        self.create_publisher(String, 'x', self.qos)

    def own(self):
        return 1

    def get_clock(self):
        self.qos.depth = 7

def main():
    rclpy.init()
    rclpy.spin(Driver())
"""


def learned_of(learned, bases, call):
    files = {"setup.py": SETUP, "bot/__init__.py": "", "bot/driver.py": SOURCE.format(bases=bases, call=call)}
    qos = learned(files).document["nodes"]["driver"]["publishes"]["x"]["qos"]
    return UNKNOWN if isinstance(qos, dict) and ("unknown" in qos or "unread" in qos) else qos


NODE_CALLS = [
    "self.get_logger().info('x')",
    "self.create_timer(1.0, self.own)",
    "self.get_name()",
    "self.create_rate(10)",
    "self.create_guard_condition(self.own)",
    "self.add_on_set_parameters_callback(print)",
    "self.get_topic_names_and_types()",
    "self.own()",
    "pass",
]


@pytest.mark.parametrize("bases", ["Node, Base", "Between, Read", "Node, Base, Mixin"])
@pytest.mark.parametrize("call", NODE_CALLS)
def test_methods_of_a_node_change_nothing_where_the_node_comes_first(learned, bases, call):
    assert learned_of(learned, bases, call) == FIVE


@pytest.mark.parametrize("call", [each for each in NODE_CALLS[:-2] if "get_name" not in each])
@pytest.mark.parametrize("bases", ["Base, Node", "Between, Base"])
def test_an_unread_base_that_may_come_before_the_node_may_have_such_a_method(learned, bases, call):
    """Of `Between, Base` the order rests on what `Base` is made from."""
    assert learned_of(learned, bases, call) == UNKNOWN


@pytest.mark.parametrize("bases", ["Node, Base", "Base, Node"])
@pytest.mark.parametrize("call", ["self.prepare()", "self.get_config()", "self.qos.prepare()", "self.get_clock()"])
def test_other_methods_may_change_it(learned, bases, call):
    assert learned_of(learned, bases, call) in (UNKNOWN, {"depth": 7})


CPP = {
    "lib/include/lib/base.hpp": '#include <rclcpp/rclcpp.hpp>\nclass Base : public rclcpp::Node { public: Base(const std::string & n) : Node(n) { p_ = create_publisher<std_msgs::msg::String>("left", 1); } rclcpp::Publisher<std_msgs::msg::String>::SharedPtr p_; };\n',
    "bot/src/driver.cpp": '#include "lib/base.hpp"\nclass Cam : public Base { public: Cam() : Base("cam") {} };\nint main() { rclcpp::spin(std::make_shared<Cam>()); }\n',
    "bot/CMakeLists.txt": "add_executable(driver src/driver.cpp)",
}
PYTHON = {
    "lib/lib/base.py": "from rclpy.node import Node\nfrom std_msgs.msg import String\nclass Base(Node):\n    def __init__(self, name):\n        super().__init__(name)\n        self.p = self.create_publisher(String, 'left', 1)\n",
    "bot/bot/driver.py": "import rclpy\nfrom lib.base import Base\nclass Cam(Base):\n    def __init__(self):\n        super().__init__('cam')\ndef main():\n    rclpy.init()\n    rclpy.spin(Cam())\n",
    "bot/setup.py": SETUP,
}


@pytest.mark.parametrize("sources", [CPP, PYTHON], ids=["C++", "Python"])
def test_a_base_class_in_a_package_that_package_xml_does_not_list_is_followed(tmp_path, parser, sources):
    packages = {f"{name}/package.xml": f"<package><name>{name}</name></package>" for name in ("lib", "bot")}
    for name, content in {**packages, **sources}.items():
        (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / name).write_text(content)
    node = learn("bot", find_packages(str(tmp_path))).document["nodes"]["driver"]
    assert (node["name"], node["publishes"]["left"]["qos"]) == ("cam", {"depth": 1})
