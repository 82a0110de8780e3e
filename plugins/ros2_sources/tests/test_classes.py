"""Classes of one name, bases that only a macro names, structures, and what no program calls: each seen in public code, rebuilt in our own words."""

from __future__ import annotations

import pytest

from cqos_ros2_sources.node_files.node_file_maker import learn
from cqos_ros2_workspace.launch.workspace import find_packages

PUB = "create_publisher<std_msgs::msg::String>"
CMAKE = "project(bot)\nadd_executable(one src/one.cpp)\nadd_executable(two src/two.cpp)\n"


def published(part):
    return {name: each.get("qos") for name, each in part.get("publishes", {}).items() if "unknown" not in each}


@pytest.fixture
def node(cpp):
    """Return the function that learns which topics the constructor of a class `Driver` publishes."""
    return lambda *parts: published(cpp(*parts))


def test_what_a_file_includes_decides_between_classes_of_one_name(learned, parser):
    files = {"CMakeLists.txt": CMAKE}
    for name in ("one", "two"):
        files[f"src/{name}/Node.hpp"] = (
            f'class Node : public rclcpp::Node {{ public: Node(); std::string t_ = "{name}"; }};'
        )
        files[f"src/{name}/Node.cpp"] = (
            f'#include "Node.hpp"\nNode::Node() : rclcpp::Node("{name}") {{ {PUB}(t_, 1); }}'
        )
        files[f"src/{name}.cpp"] = (
            f'#include "{name}/Node.hpp"\nint main() {{ rclcpp::spin(std::make_shared<Node>()); }}'
        )
    found = learned(files).document["nodes"]
    assert {name: published(found[name]) for name in ("one", "two")} == {
        "one": {"one": {"depth": 1}},
        "two": {"two": {"depth": 1}},
    }


def test_the_nearest_namespace_decides_between_classes_of_one_name(node):
    before = f'namespace a {{ struct Part {{ Part(rclcpp::Node * n) {{ n->{PUB}("a", 1); }} }}; }}\nstruct Part {{ Part(rclcpp::Node * n) {{ n->{PUB}("b", 1); }} }};\nnamespace a {{ void make(rclcpp::Node * n) {{ Part p(n); }} }}'
    assert set(node("a::make(this);", "", before)) == {"a"}


@pytest.mark.parametrize(("chosen", "names"), [("ONE", {"a"}), ("TWO", set())])
def test_a_base_class_that_a_macro_names(learned, parser, chosen, names):
    source = (
        f"#define ONE 1\n#define TWO 2\n#define CHOSEN {chosen}\n#if CHOSEN == ONE\n#define BASE rclcpp::Node\n#elif CHOSEN == TWO\n#define BASE other::Thing\n#endif\n"
        f'class Driver : public BASE {{ public: Driver() : BASE("driver") {{\n#if CHOSEN == ONE\n{PUB}("a", 1);\n#endif\n}} }};\n'
        "int main() { rclcpp::spin(std::make_shared<Driver>()); }"
    )
    found = learned({"CMakeLists.txt": "add_executable(driver src/driver.cpp)", "src/driver.cpp": source}).document
    assert set(published(found.get("nodes", {}).get("driver", {}))) == names


def test_a_branch_for_ros_1_is_not_read(learned, parser):
    source = (
        '#ifdef ROS_FOUND\n#include <ros/ros.h>\nclass Out { public: Out(ros::NodeHandle & n) {} };\n#elif ROS2_FOUND\n#include "rclcpp/rclcpp.hpp"\n'
        f'class Out {{ public: Out(rclcpp::Node * n) {{ n->{PUB}("points", 2); }} }};\n#endif\n'
    )
    found = learned({"CMakeLists.txt": "", "src/out.hpp": source}).document
    assert published(found["fragments"]["Out"]) == {"points": {"depth": 2}}


@pytest.mark.parametrize(
    ("first", "read"),
    [
        ("#include <ros/ros.h>", False),
        ('#include "ros/ros.h"', False),
        ('#include "ros/ros.h"\n#include "rclcpp/rclcpp.hpp"', True),
        ('#ifdef ONE\n#include "ros/ros.h"\n#endif', True),
        ('#include "ros/ros_helpers.h"', True),
    ],
)
def test_a_file_for_ros_1_is_not_read(learned, parser, first, read):
    source = f'{first}\nclass Out {{ public: Out(rclcpp::Node * n) {{ n->{PUB}("raw", 1); }} }};\n'
    found = learned({"CMakeLists.txt": "", "src/out.cpp": source})
    assert bool(found.document.get("fragments") or found.gaps) is read


@pytest.mark.parametrize(
    ("first", "read"),
    [
        ("import rospy", False),
        ("from rospy import Publisher", False),
        ("import rospy\nimport rclpy", True),
        ("try:\n    import rospy\nexcept ImportError:\n    pass", True),
        ("from .rospy import helper", True),
    ],
)
def test_a_file_of_python_for_ros_1_is_not_read(learned, first, read):
    source = f"{first}\nfrom std_msgs.msg import String\ndef go(node):\n    node.create_publisher(String, 'a', 1)\n"
    found = learned({"setup.py": "", "bot/driver.py": source})
    assert bool(found.document.get("fragments") or found.gaps) is read


def test_what_no_program_calls_is_a_fragment_that_may_not_be_made(learned, parser):
    source = f'void helper(const std::shared_ptr<rclcpp::Node> & node) {{ node->{PUB}("a", 1); }}'
    found = learned({"CMakeLists.txt": "", "src/helper.cpp": source}).document["fragments"]["helper"]
    assert published(found) == {"a": {"depth": 1}}
    assert "nothing that calls" in found["publishes"]["a"]["perhaps"]


def test_a_class_with_a_base_that_nothing_knows_takes_the_methods_of_nodes(learned, parser):
    source = f'class Part : public elsewhere::CascadeNode {{ public: void start() {{ p_ = {PUB}("a", rclcpp::QoS(7).reliable()); }} }};'
    found = learned({"CMakeLists.txt": "", "src/part.cpp": source}).document["fragments"]["Part"]
    assert published(found) == {"a": {"depth": 7, "reliability": "reliable"}}


def test_a_wrapper_by_itself_is_no_endpoint(learned, parser):
    source = "template <class T> class Out { public: Out(rclcpp::Node * n, std::string t) { n->create_publisher<T>(t, 1); } };"
    assert "fragments" not in learned({"CMakeLists.txt": "", "src/out.hpp": source}).document


def test_a_pointer_to_a_node_is_no_second_node(learned, parser):
    source = (
        f'struct Part {{ Part(rclcpp::Node * n) : n_(n) {{ n_->{PUB}("a", 1); }} rclcpp::Node * n_; }};\n'
        'class Driver : public rclcpp::Node { public: Driver() : Node("driver") { Part p(this); } };\nint main() { rclcpp::spin(std::make_shared<Driver>()); }'
    )
    found = learned({"CMakeLists.txt": "add_executable(driver src/driver.cpp)", "src/driver.cpp": source}).document
    assert list(found["nodes"]) == ["driver"]


@pytest.mark.parametrize(
    ("body", "members", "before", "names"),
    [
        pytest.param(f"{PUB}(c_.topic, c_.depth);", "Config c_;", 'struct Config { std::string topic = "x"; int depth = 7; };', {"x": {"depth": 7}}, id="a structure with defaults"),
        pytest.param(f"READ(file, c_.topic); c_.load(); {PUB}(c_.topic, 1);", "Config c_;", 'struct Config { std::string topic = "x"; void load() { READ_INTO(file, topic); } };', {}, id="a macro may change what it is given"),
        pytest.param(f"read_all(c_); {PUB}(c_.topic, 1);", "Config c_;", 'struct Config { std::string topic = "x"; };', {}, id="a function that is not known may change a structure"),
        pytest.param(f"auto later = [this]() {{ {PUB}(c_.topic, 1); }}; timer_ = create_wall_timer(1s, later);", 'Config c_; void set() { c_.topic = "y"; }', 'struct Config { std::string topic = "x"; };', {}, id="a method that nothing calls sets a field"),
        pytest.param(f"for (const auto & each : kAll) {{ {PUB}(each.name, each.depth); }}", "", 'struct One { std::string name; int depth; };\nconst std::vector<One> kAll = {{"a", 1}, {"b", 2}};', {"a": {"depth": 1}, "b": {"depth": 2}}, id="a list of structures"),
        pytest.param(f'std::map<std::string, std::string> m{{{{"a", "x"}}}}; for (const auto & [k, v] : m) {{ {PUB}(k + "/" + v, 1); }}', "", "", {"a/x": {"depth": 1}}, id="a map"),
        pytest.param(f"{PUB}(topic_of(Kind::B), 1);", "", 'enum class Kind { A, B };\nstd::string topic_of(Kind k) { switch (k) { case Kind::A: return "a"; case Kind::B: return "b"; } return ""; }', {"b": {"depth": 1}}, id="a choice by an enumeration"),
        pytest.param(f'{PUB}(plain("/a/b"), 1);', "", 'std::string plain(const std::string & n) { if (n.find("/") == 0) { return n.substr(1); } return n; }', {"a/b": {"depth": 1}}, id="parts of a text"),
        pytest.param(f'declare_parameter("namespace", "x"); {PUB}(get_parameter("namespace").as_string() + "/a", 1);', "", "", {}, id="a parameter with the name of a variable of node files"),
    ],
)  # fmt: skip
def test_structures_and_texts(node, body, members, before, names):
    assert node(body, members, before) == names


def test_a_broadcaster_with_a_quality_of_service_of_its_own(cpp):
    found = cpp("b_ = std::make_unique<tf2_ros::TransformBroadcaster>(*this, rclcpp::QoS(3));")
    assert [each["cause"] for each in found["unread"]] == ["the call states a quality of service of its own"]


@pytest.mark.parametrize(
    ("body", "before", "names"),
    [
        pytest.param("c = Config('b', depth=2)\nself.create_publisher(String, c.topic, c.depth)", "from dataclasses import dataclass\n@dataclass\nclass Config:\n    topic: str = 'a'\n    depth: int = 1\n", {"b": {"depth": 2}}, id="a dataclass that is given values"),
        pytest.param("self.all = [self.create_publisher(String, f'r{i}', 1) for i in range(2)]", "", {"r0": {"depth": 1}, "r1": {"depth": 1}}, id="a comprehension"),
        pytest.param("i = 'a'\nself.all = [self.create_publisher(String, i, 1) for i in names()]", "", {}, id="a name of a comprehension hides another one"),
        pytest.param("self.create_publisher(String, '/%s/x' % 'r', 1)", "", {"/r/x": {"depth": 1}}, id="a text with places"),
        pytest.param("Base.start(self, 'a')", "class Base:\n    def start(self, name):\n        self.create_publisher(String, name, 1)\n", {"a": {"depth": 1}}, id="a method of a base class by its name"),
    ],
)  # fmt: skip
def test_python(python, body, before, names):
    assert published(python(body, before=before)) == names


def test_an_alias_of_one_name_in_two_classes(cpp):
    before = "struct A { using Message = std_msgs::msg::String; };\nstruct B { using Message = std_msgs::msg::Bool; };"
    found = cpp(
        'create_publisher<A::Message>("a", 1); create_publisher<B::Message>("b", 1); create_publisher<Message>("c", 1);',
        "",
        before,
    )
    assert [each.get("type") for each in found["publishes"].values()] == [
        "std_msgs/msg/String",
        "std_msgs/msg/Bool",
        None,
    ]


def test_a_single_character_is_a_text(node):
    body = f"""std::string part = "front"; std::string other = "/rear"; {PUB}(part + '/' + "scan", 1);
    {PUB}(join("a", part), 1); {PUB}(join("a", other), 1); if (part[0] == 'f') {{ {PUB}("first", 1); }} if (part.back() == '/') {{ {PUB}("never", 1); }}"""
    join = "std::string join(std::string a, std::string b) { if (b.front() == '/') { return b; } return a + '/' + b; }"
    assert set(node(body, "", join)) == {"front/scan", "a/front", "/rear", "first"}


def test_a_case_of_a_switch_by_a_value_of_an_enumeration(node):
    body = f"""{PUB}(name_of(LOG_B), 1); {PUB}(name_of(LOG_C), 1); {PUB}(name_of(read()), 1);"""
    of = """std::string name_of(Log which) { switch (which) { case LOG_A: return "a"; case LOG_B: return "b"; default: return "other"; } }"""
    assert set(node(body, "", of)) == {"b"}  # whether LOG_C is one of the others is not known


def test_what_a_function_returns_by_a_parameter(cpp):
    before = """rclcpp::QoS profile(const std::string & name) {
      if (name == "sensor") { return rclcpp::SensorDataQoS(); } else if (name == "system") { return rclcpp::SystemDefaultsQoS(); }
      return rclcpp::QoS(3); }"""
    found = cpp(f'{PUB}("scan", profile(declare_parameter<std::string>("kind", "sensor")));', "", before)
    assert found["publishes"]["scan"]["qos"] == [
        {"when": {"kind": "sensor"}, "profile": "sensor_data"},
        {"when": {"kind": "system"}, "profile": "system_defaults_cpp"},
        {"depth": 3},
    ]


def test_what_a_function_returns_while_it_runs_stays_unknown(cpp):
    before = """rclcpp::QoS profile(const std::string & name) { if (name == "sensor") { return rclcpp::SensorDataQoS(); }
      if (busy()) { return rclcpp::QoS(1); } return rclcpp::QoS(3); }"""
    found = cpp(f'{PUB}("scan", profile(declare_parameter<std::string>("kind", "sensor")));', "", before)
    assert "unknown" in found["publishes"]["scan"]["qos"]


def test_a_counted_loop_over_the_list_of_a_parameter(cpp):
    members = "std::vector<std::string> topics_; std::vector<std::string> others_;"
    body = f"""topics_ = declare_parameter<std::vector<std::string>>("topics"); others_ = declare_parameter<std::vector<std::string>>("others");
      for (size_t i = 0; i < topics_.size(); ++i) {{ {PUB}(topics_[i] + "/raw", 1); {PUB}(others_[i], 1); {PUB}("cam_" + std::to_string(i), 1); }}"""
    made = cpp(body, members)["publishes"]
    assert made["${each_i}/raw"]["for_each"] == {"each_i": "${topics}"}
    assert [each["unknown"] for name, each in sorted(made.items()) if name.startswith("(")] == [
        "an element of a list that is not known",
        "`+` is not followed",
    ]


def test_a_sub_node_puts_its_namespace_before_relative_names(cpp):
    body = f"""auto part = create_sub_node("arm"); auto own = this->create_sub_node(this->get_name()); auto other = create_sub_node(read());
      part->{PUB}("pose", 1); part->{PUB}("/tf", 1); own->{PUB}("pose", 1); other->{PUB}("~/here", 1); other->{PUB}("pose", 1);
      part->{PUB}(part->declare_parameter<std::string>("topic", "x"), 1); message_filters::Subscriber<std_msgs::msg::String> taken(part, "taken");"""
    found = cpp(body)
    assert set(found["publishes"]) == {"arm/pose", "/tf", "${node}/pose", "~/here", "(unknown 1)", "(unknown 2)"}
    assert all("unknown" in each for each in found["subscribes"].values())


def test_a_list_that_a_callback_may_add_to_is_not_known(python):
    body = "self.topics = ['a']\nself.fixed = ['b']\nself.create_timer(1.0, self.check)\nself.create_subscription(String, 'in', self.take, 1)"
    methods = """
    def check(self):
        for topic in self.topics + []:
            self.create_publisher(String, topic, 1)
        for topic in self.topics:
            self.create_publisher(String, topic, 1)
        for topic in self.fixed:
            self.create_publisher(String, topic, 1)

    def take(self, message):
        self.topics.append(message.data)
"""
    found = python(body, methods)["publishes"]
    assert {name for name in found if not name.startswith("(")} == {"b"}


@pytest.mark.parametrize("spins", ["rclpy.spin_once(driver)", "threading.Thread(target=executor.spin).start()"])
def test_what_callbacks_set_before_a_program_goes_on(learned, spins):
    source = """import rclpy
from rclpy.node import Node
from std_msgs.msg import String

class Driver(Node):
    def __init__(self):
        super().__init__('driver')
        self.topics = ['a']
        self.create_subscription(String, 'in', self.take, 1)

    def make(self):
        for topic in self.topics:
            self.create_publisher(String, topic, 1)

    def take(self, message):
        self.topics.append(message.data)

def main():
    rclpy.init()
    driver = Driver()
    SPINS
    driver.make()
""".replace("SPINS", spins)
    setup = "from setuptools import setup\nsetup(entry_points={'console_scripts': ['driver = bot.driver:main']})\n"
    made = learned({"setup.py": setup, "bot/driver.py": source}).document["nodes"]["driver"]["publishes"]
    assert [each.get("unknown", "known") for each in made.values()] == ["it is an element of a list that is not known"]


def test_a_list_that_a_service_may_add_to_is_not_known(cpp):
    body = """timer_ = create_wall_timer(1s, [this]() { check(); }); create_service<std_srvs::srv::Empty>("more", std::bind(&Driver::more, this));"""
    members = f"""void check() {{ for (const auto & t : topics_) {{ {PUB}(t, 1); }} for (const auto & t : fixed_) {{ {PUB}(t, 1); }} }}
      void more() {{ topics_.push_back(read()); }} std::vector<std::string> topics_ = {{"a"}}; std::vector<std::string> fixed_ = {{"b"}}; rclcpp::TimerBase::SharedPtr timer_;"""
    assert {name for name in cpp(body, members)["publishes"] if not name.startswith("(")} == {"b"}


def test_a_subscription_of_images_that_leaves_the_transport_out(cpp):
    body = """auto it = std::make_shared<image_transport::ImageTransport>(this); image_transport::TransportHints hints(this, "compressed");
      it->subscribe("image", 1, &Driver::take, this); it->subscribe("other", 1, std::bind(&Driver::take, this, _1), &hints);"""
    found = cpp(body, "void take(const sensor_msgs::msg::Image::ConstSharedPtr & image) {}")
    assert found["subscribes"]["image"]["when"] == {"image_transport": "raw"}
    assert found["parameters"] == {"image_transport": {}}  # two calls state different defaults


def test_a_name_that_each_class_gives_its_own_type(node):
    before = """struct OneSpec { static constexpr char name[] = "one"; static constexpr size_t depth = 4; static constexpr auto durability = RMW_QOS_POLICY_DURABILITY_TRANSIENT_LOCAL; };
      struct Other { using Spec = TwoSpec; };
      template <typename T> rclcpp::QoS qos_of() { return rclcpp::QoS{T::depth}.durability(T::durability); }"""
    members = 'using Spec = OneSpec; struct Values { std::string topic = "scan"; }; using Type = Values; Type values_;'
    body = f"{PUB}(Spec::name, qos_of<Spec>()); {PUB}(values_.topic, 1);"
    assert node(body, members, before) == {"one": {"depth": 4, "durability": "transient_local"}, "scan": {"depth": 1}}


INNER = """
rclcpp::NodeOptions child_options(const std::string & name)
{
  return rclcpp::NodeOptions().arguments({"--ros-args", "-r", "__ns:=/" + name});
}
class Map : public rclcpp::Node
{
public:
  Map(const std::string & name, const rclcpp::NodeOptions & options) : Node(name, "", OPTIONS)
  {
    map_ = create_publisher<std_msgs::msg::String>("map", 1);
  }
};
"""


@pytest.mark.parametrize(
    ("options", "inside", "unread", "remaps"),
    [
        ("options", ["local"], [], None),
        ("child_options(name)", ["local"], [], {"__ns": "/local"}),
        ("library::options(name)", [], ["the node `Map` inside"], None),
    ],
)
def test_options_that_a_function_makes_may_set_a_namespace(learned, parser, options, inside, unread, remaps):
    made = 'Map * map_ = new Map("local", rclcpp::NodeOptions());'
    server = f'class Server : public rclcpp::Node {{ public: Server() : Node("server", "shop") {{ {made} }} }};'
    main = "int main() { rclcpp::spin(std::make_shared<Server>()); }"
    source = "\n".join((INNER.replace("OPTIONS", options), server, main))
    files = {"CMakeLists.txt": "add_executable(server src/server.cpp)", "src/server.cpp": source}
    nodes = learned(files).document["nodes"]
    found = nodes["server"]
    assert found["namespace"] == "shop"
    assert nodes["server.2"].get("remaps") == remaps
    assert [each["name"] for each in found.get("inside", [])] == inside
    assert [each["what"] for each in found.get("unread", [])] == unread


@pytest.mark.parametrize("mark", ["", "BOT_VISIBLE ", "BOT_CORE_DECL "])
def test_a_class_that_a_framework_starts(learned, parser, mark):
    """Nothing calls `configure`, so the walk begins there: what it sets before is known."""
    source = f"""class {mark}Part : public System {{
public:
  void configure(const Config & config) override {{ node_ = std::make_shared<rclcpp::Node>("part"); begin(); }}
  void begin() {{ if (!node_) {{ return; }} p_ = node_->{PUB}("a", 1); }}
  rclcpp::Node::SharedPtr node_;
}};
"""
    found = learned({"src/part.cpp": source, "CMakeLists.txt": ""}).document["nodes"]["Part"]
    assert published(found) == {"a": {"depth": 1}}
    assert "calls `configure`" in found["publishes"]["a"]["perhaps"]


def test_a_structure_of_a_library_holds_a_callback(cpp):
    found = cpp(
        f'rclcpp::PublisherOptions options; options.event_callbacks.matched_callback = [this](rclcpp::MatchedInfo &) {{ {PUB}("a", 1); }}; {PUB}("b", 1, options);'
    )
    assert set(found["publishes"]) == {"a", "b"}
    assert "callback" in found["publishes"]["a"]["perhaps"]


def test_the_node_of_a_controller_has_the_name_of_the_plugin(learned, parser):
    source = f"""class Arm : public controller_interface::ControllerInterface {{
public:
  CallbackReturn on_configure(const rclcpp_lifecycle::State &) {{
    p_ = get_node()->{PUB}(std::string(get_node()->get_name()) + "/pose", 1);
    return CallbackReturn::SUCCESS;
  }}
}};
PLUGINLIB_EXPORT_CLASS(Arm, controller_interface::ControllerInterface)"""
    found = learned({"src/arm.cpp": source, "CMakeLists.txt": ""}).document["fragments"]["Arm"]
    assert set(found["publishes"]) == {"${plugin}/pose"}


def test_a_script_of_python_is_no_part_of_a_program_of_cpp(learned, parser):
    found = learned(
        {
            "CMakeLists.txt": "add_executable(driver src/driver.cpp)",
            "src/driver.cpp": f'class Driver : public rclcpp::Node {{ public: Driver() : Node("driver") {{ {PUB}("a", 1); }} }};\nint main() {{ rclcpp::spin(std::make_shared<Driver>()); }}',
            "scripts/view.py": "from std_msgs.msg import String\nclass View:\n    def go(self, node):\n        node.create_publisher(String, 'b', 1)\n",
        }
    )
    assert "unread" not in found.document["nodes"]["driver"]
    assert "view.py" in str(found.document["fragments"]) + str(found.gaps)


def test_a_class_of_another_package_is_a_fragment_of_that_one(tmp_path, parser):
    part = f'class Part {{ public: Part(rclcpp::Node * n) : n_(n) {{}} void start(bool on) {{ if (on) {{ n_->{PUB}("a", 1); }} }} rclcpp::Node * n_; }};\n'
    files = {
        "parts/package.xml": "<package><name>parts</name></package>",
        "parts/include/part.hpp": part,
        "bot/package.xml": "<package><name>bot</name><depend>parts</depend></package>",
        "bot/CMakeLists.txt": "add_executable(driver src/driver.cpp)",
        "bot/src/driver.cpp": '#include "part.hpp"\nint main() { auto n = std::make_shared<rclcpp::Node>("driver"); Part part(n.get()); part.start(false); rclcpp::spin(n); }',
    }
    for name, content in files.items():
        (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / name).write_text(content)
    parts, bot = (learn(name, find_packages(str(tmp_path))).document for name in ("parts", "bot"))
    assert "Part" in parts["fragments"]
    assert "fragments" not in bot
    assert "what `start` in part.hpp creates" in str(bot["nodes"]["driver"]["unread"])
