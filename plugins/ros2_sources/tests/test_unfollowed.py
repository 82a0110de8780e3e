"""What one program reaches says nothing about another: each node names creating calls that its own walk may come to and did not follow."""

from __future__ import annotations

import pytest

from cqos_ros2_sources.node_files.node_file_maker import learn
from cqos_ros2_workspace.launch.workspace import find_packages

PUB = "create_publisher<std_msgs::msg::String>"
CAMERA = f'class Camera {{ public: Camera(rclcpp::Node * n) : n_(n) {{}} void start() {{ open(); }} void open() {{ p_ = n_->{PUB}("image", 1); }} rclcpp::Node * n_; rclcpp::Publisher<std_msgs::msg::String>::SharedPtr p_; }};\n'
DIRECT = '#include "camera.hpp"\nclass F : public rclcpp::Node { public: F() : Node("f") { cam_ = std::make_shared<Camera>(this); cam_->start(); } std::shared_ptr<Camera> cam_; };\nint main() { rclcpp::spin(std::make_shared<F>()); }\n'
CMAKE = "add_executable(e src/e.cpp)\nadd_executable(f src/f.cpp)\nadd_executable(g src/g.cpp)\n"
OTHER = f'class G : public rclcpp::Node {{ public: G() : Node("g") {{ {PUB}("g", 1); timer_->start(); motor()->start(); }} std::shared_ptr<library::Timer> timer_; }};\nint main() {{ rclcpp::spin(std::make_shared<G>()); }}\n'
SETUP = "from setuptools import setup\nsetup(entry_points={'console_scripts': ['e = bot.e:main', 'f = bot.f:main', 'g = bot.g:main']})\n"
IMPORTS = "import rclpy\nfrom rclpy.node import Node\nfrom bot.camera import Camera, Box\n"


def unread(part):
    return [each["what"] for each in part.get("unread", [])]


@pytest.mark.parametrize(
    ("body", "members", "expected"),
    [
        ('cameras_["a"] = std::make_shared<Camera>(this); for (auto & c : cameras_) { c.second->start(); }', "std::map<std::string, std::shared_ptr<Camera>> cameras_;", True),
        ("for (auto & c : cameras_) { c->start(); }", "std::vector<Camera *> cameras_;", True),
        ("for (size_t i = 0; i < cameras_.size(); ++i) { cameras_[i]->start(); }", "std::vector<std::unique_ptr<Camera>> cameras_;", True),
        ('cameras_.at("a")->start();', "std::map<std::string, std::shared_ptr<Camera>> cameras_;", True),
        ("auto c = library::pick(cameras_); c->start();", "std::vector<Camera *> cameras_;", True),
        ("std::for_each(cameras_.begin(), cameras_.end(), [](auto & c) { c->start(); });", "std::vector<Camera *> cameras_;", True),
        ("auto one = std::make_shared<Camera>(this); one->start(); for (auto & c : cameras_) { c->start(); }", "std::vector<Camera *> cameras_;", True),
        ("auto one = std::make_shared<Camera>(this); one->start(); for (auto & c : cameras_) { c->stop(); }", "std::vector<Camera *> cameras_;", False),
        ("for (auto & c : cameras_) { c->stop(); }", "std::vector<Camera *> cameras_;", False),
        ("library::pick()->start();", "", False),
        ("thing_->start();", "std::shared_ptr<library::Thing> thing_; std::shared_ptr<Camera> camera_;", False),
    ],
)  # fmt: skip
def test_what_one_program_reaches_another_may_reach_too(learned, parser, body, members, expected):
    e = f'#include "camera.hpp"\nclass E : public rclcpp::Node {{ public: E() : Node("e") {{ {PUB}("e", 1); {body} }} {members} }};\nint main() {{ rclcpp::spin(std::make_shared<E>()); }}\n'
    files = {"CMakeLists.txt": CMAKE, "src/camera.hpp": CAMERA, "src/e.cpp": e, "src/f.cpp": DIRECT, "src/g.cpp": OTHER}
    nodes = learned(files).document["nodes"]
    assert unread(nodes["e"]) == (["what `open` in camera.hpp creates"] if expected else [])
    assert "image" in nodes["f"]["publishes"]
    assert unread(nodes["f"]) == unread(nodes["g"]) == []


def test_another_package(tmp_path, parser):
    e = f'#include "camera.hpp"\nclass E : public rclcpp::Node {{ public: E() : Node("e") {{ {PUB}("e", 1); for (auto & c : cameras_) {{ c.second->start(); }} }} std::map<std::string, std::shared_ptr<Camera>> cameras_; }};\nint main() {{ rclcpp::spin(std::make_shared<E>()); }}\n'
    files = {
        "parts/package.xml": "<package><name>parts</name></package>",
        "parts/include/camera.hpp": CAMERA,
        "bot/package.xml": "<package><name>bot</name><depend>parts</depend></package>",
        "bot/CMakeLists.txt": CMAKE,
        "bot/src/e.cpp": e,
        "bot/src/f.cpp": DIRECT,
        "bot/src/g.cpp": OTHER,
    }
    for name, content in files.items():
        (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / name).write_text(content)
    nodes = learn("bot", find_packages(str(tmp_path))).document["nodes"]
    assert {name: unread(each) for name, each in nodes.items()} == {
        "e": ["what `open` in camera.hpp creates"],
        "f": [],
        "g": [],
    }


@pytest.mark.parametrize(
    ("body", "expected"),
    [
        ("self.cameras = {}\nfor each in read():\n    self.cameras[each] = Camera(self)\nfor each in self.cameras.values():\n    each.start()", True),
        ("self.cameras = [Camera(self) for each in read()]\nself.cameras[read()].start()", True),
        ("self.camera = read(Camera)\nself.camera.start()", True),
        ("self.camera = Box()\nread().start()", False),
        ("read().start()", False),
    ],
)  # fmt: skip
def test_python(learned, body, expected):
    inner = "\n".join(f"        {line}" for line in body.splitlines())
    main = "def main():\n    rclpy.init()\n    rclpy.spin({}())\n"
    head = "class {0}(Node):\n    def __init__(self):\n        super().__init__('{0}')\n"
    files = {
        "setup.py": SETUP,
        "bot/camera.py": "from std_msgs.msg import String\nclass Box:\n    pass\nclass Camera:\n    def __init__(self, node):\n        self.node = node\n    def start(self):\n        self.p = self.node.create_publisher(String, 'image', 1)\n",
        "bot/e.py": IMPORTS + head.format("e") + inner + "\n" + main.format("e"),
        "bot/f.py": IMPORTS
        + head.format("f")
        + "        self.camera = Camera(self)\n        self.camera.start()\n"
        + main.format("f"),
        "bot/g.py": IMPORTS + head.format("g") + "        read().start()\n" + main.format("g"),
    }
    nodes = learned(files).document["nodes"]
    assert unread(nodes["e"]) == (["what `start` in camera.py creates"] if expected else [])
    assert "image" in nodes["f"]["publishes"]
    assert unread(nodes["f"]) == unread(nodes["g"]) == []
