"""What options of a node decide beside its code: name, namespace, remaps and parameters. What is not followed makes names unknown."""

from __future__ import annotations

import pytest

PUB = "create_publisher<std_msgs::msg::String>"


@pytest.fixture
def node(learned, parser):
    """Return the function that learns a node from the options that its base class is given; what stands in `main` before it, and the argument of its constructor."""

    def of(options, main="", given=""):
        source = f"""class Driver : public rclcpp::Node {{ public:
  Driver({"const rclcpp::NodeOptions & options" if given else ""}) : Node("driver"{options}) {{
    auto topic = declare_parameter("topic", "scan"); {PUB}(topic, 1); {PUB}("/news", 1); }} }};
int main(int argc, char ** argv) {{ {main} rclcpp::spin(std::make_shared<Driver>({given})); }}"""
        files = {"CMakeLists.txt": "add_executable(driver src/driver.cpp)\n", "src/driver.cpp": source}
        return learned(files).document["nodes"]["driver"]

    return of


def known(found):
    return {name for name, each in found.get("publishes", {}).items() if "unknown" not in each}


MINE = ", rclcpp::NodeOptions()"
ARGUMENTS = f'{MINE}.arguments({{"--ros-args", %s}})'
MAIN = "rclcpp::NodeOptions o; "


@pytest.mark.parametrize(
    ("arguments", "expected"),
    [
        ({"options": MINE}, {}),
        ({"options": f"{MINE}.allow_undeclared_parameters(true).automatically_declare_parameters_from_overrides(true)"}, {}),
        ({"options": ", options", "main": MAIN + "o.use_intra_process_comms(true);", "given": "o"}, {}),
        ({"options": ", rclcpp::NodeOptions(options).use_intra_process_comms(true)", "main": MAIN, "given": "o"}, {}),
        ({"options": ARGUMENTS % '"-r", "__node:=other"'}, {"name": "other", "remaps": {"__node": "other"}}),
        ({"options": ARGUMENTS % '"--remap", "__ns:=/robot", "-r", "a:=b"'}, {"namespace": "/robot", "remaps": {"__ns": "/robot", "a": "b"}}),
        ({"options": ARGUMENTS % '"-r", "driver:a:=b", "-r", "other:c:=d", "--log-level", "debug"'}, {"remaps": {"a": "b"}}),
        ({"options": ', "/ns", rclcpp::NodeOptions().arguments({"--ros-args", "-r", std::string("__node:=") + "x"})'}, {"name": "x", "namespace": "/ns", "remaps": {"__node": "x"}}),
        ({"options": ", options", "main": MAIN + 'o.arguments({"--ros-args", "-r", "__node:=x"});', "given": "o"}, {"name": "x", "remaps": {"__node": "x"}}),
        ({"options": ", options", "main": MAIN + 'auto p = o; p.arguments({"--ros-args", "-r", "__node:=x"});', "given": "o"}, {}),
        ({"options": f"{MINE}.use_global_arguments(false)"}, {"global_arguments": False}),
        ({"options": ", options", "main": MAIN + "std::vector<std::string> a; for (int i = 1; i < argc; ++i) { if (check(argv[i])) { a.push_back(argv[i]); } } o.arguments(a);", "given": "o"}, {}),
        ({"options": ", options", "main": MAIN + "std::vector<std::string> a(argv, argv + argc); o.arguments(a);", "given": "o"}, {}),
        ({"options": f'{MINE}.arguments({{"-r", "a:=b"}})'}, {}),  # no `--ros-args` before it
    ],
)  # fmt: skip
def test_options_decide(node, arguments, expected):
    found = node(**arguments)
    assert known(found) == {"${topic}", "/news"}
    assert {key: found[key] for key in ("name", "namespace", "remaps", "global_arguments") if key in found} == {
        "name": "driver",
        **expected,
    }


@pytest.mark.parametrize(
    ("options", "topics"),
    [
        (f'{MINE}.parameter_overrides({{{{"topic", "fixed"}}}})', {"fixed", "/news"}),
        (f'{MINE}.parameter_overrides({{rclcpp::Parameter("topic", "fixed")}})', {"fixed", "/news"}),
        (f'{MINE}.append_parameter_override("other", 1).append_parameter_override("topic", "fixed")', {"fixed", "/news"}),
        (ARGUMENTS % '"-p", "topic:=fixed"', {"fixed", "/news"}),
        (ARGUMENTS % '"-p", "other:topic:=fixed"', {"${topic}", "/news"}),
        (f'{MINE}.parameter_overrides({{{{"topic", pick()}}}})', {"/news"}),
        (f"{MINE}.parameter_overrides(all())", {"/news"}),
        (ARGUMENTS % '"--params-file", "a.yaml"', {"/news"}),
    ],
)  # fmt: skip
def test_parameters_of_options_win(node, options, topics):
    assert known(node(options)) == topics


@pytest.mark.parametrize(
    ("arguments", "cause"),
    [
        ({"options": ", library::options()"}, "`options` is not followed"),
        ({"options": f"{MINE}.arguments(pick())"}, "`pick` is not followed"),
        ({"options": ARGUMENTS % '"-r", pick()'}, "`pick` is not followed"),
        ({"options": ", options", "main": MAIN + "if (argc > 1) { o.arguments({}); }", "given": "o"}, "it depends on a condition"),
        ({"options": ", options", "main": MAIN + "library::fill(o);", "given": "o"}, "`library::fill` may change it"),
        ({"options": ", options", "main": MAIN + "std::vector<std::string> a; while (more()) { a.push_back(argv[1]); a.push_back(pick()); } o.arguments(a);", "given": "o"}, "changes in a loop"),
        ({"options": ", options", "main": MAIN + "std::vector<std::string> a(argv, argv + argc); fill(a); o.arguments(a);", "given": "o"}, "a list that is not known"),
        ({"options": ", options", "main": MAIN + 'o.arguments().push_back("-r");', "given": "o"}, "changed in place"),
    ],
)  # fmt: skip
def test_options_that_are_not_followed_make_names_unknown(node, arguments, cause):
    found = node(**arguments)
    assert known(found) == set()
    assert not {"name", "namespace"} & set(found)
    assert any(cause in each["unknown"] for each in found["publishes"].values())


def test_a_namespace_that_is_not_followed_makes_relative_names_unknown(node):
    found = node(", pick(), rclcpp::NodeOptions()")
    assert known(found) == {"/news"}
    assert found["name"] == "driver"
    assert "`pick` is not followed" in found["publishes"]["(unknown 1)"]["unknown"]


def test_a_component_takes_its_options_from_its_container(learned, parser):
    source = f'class Driver : public rclcpp::Node {{ public: explicit Driver(const rclcpp::NodeOptions & options) : Node("driver", options) {{ {PUB}("a", 1); }} }};\nRCLCPP_COMPONENTS_REGISTER_NODE(Driver)'
    found = learned({"CMakeLists.txt": "", "src/driver.cpp": source}).document["nodes"]["Driver"]
    assert (found["name"], known(found)) == ("driver", {"a"})


NODES = "class Driver(Node):\n    def __init__(self):\n        super().__init__('driver'{})\n        t = self.declare_parameter('topic', 'scan').value\n        self.create_publisher(String, t, 1)\n        self.create_publisher(String, '/news', 1)\n"


@pytest.mark.parametrize(
    ("options", "expected", "topics"),
    [
        (", namespace='robot'", {"name": "driver", "namespace": "robot"}, {"${topic}", "/news"}),
        (", cli_args=['--ros-args', '-r', '__node:=x', '-p', 'topic:=fixed']", {"name": "x", "remaps": {"__node": "x"}}, {"fixed", "/news"}),
        (", parameter_overrides=[Parameter('topic', Parameter.Type.STRING, 'fixed')]", {"name": "driver"}, {"fixed", "/news"}),
        (", parameter_overrides=[Parameter('topic', value='fixed')]", {"name": "driver"}, {"fixed", "/news"}),
        (", parameter_overrides=pick()", {"name": "driver"}, {"/news"}),
        (", use_global_arguments=False", {"name": "driver", "global_arguments": False}, {"${topic}", "/news"}),
        (", cli_args=pick()", {}, set()),
        (", namespace=pick()", {"name": "driver"}, {"/news"}),
        (", **pick()", {}, set()),
    ],
)  # fmt: skip
def test_python(learned, options, expected, topics):
    setup = "from setuptools import setup\nsetup(entry_points={'console_scripts': ['driver = bot.driver:main']})\n"
    before = "import rclpy\nfrom rclpy.node import Node\nfrom rclpy.parameter import Parameter\nfrom std_msgs.msg import String\nfrom other import pick\n"
    source = f"{before}{NODES.format(options)}def main():\n    rclpy.spin(Driver())\n"
    found = learned({"setup.py": setup, "bot/driver.py": source}).document["nodes"]["driver"]
    assert known(found) == topics
    assert {key: found[key] for key in ("name", "namespace", "remaps", "global_arguments") if key in found} == expected
