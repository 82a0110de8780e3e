"""The traps of the specification that were seen in public code, each rebuilt in our own words: right or not known, never wrong."""

from __future__ import annotations

import pytest

PUB = "create_publisher<std_msgs::msg::String>"
SUB = "create_subscription<std_msgs::msg::String>"
CB = "[](const std_msgs::msg::String &) {}"


def known(found, direction="publishes"):
    return {name: each for name, each in found.get(direction, {}).items() if "unknown" not in each}


@pytest.mark.parametrize(
    ("body", "members", "before", "names"),
    [
        pytest.param("timer_ = create_wall_timer(1s, std::bind(&Driver::more, this));", f'int n_ = 0; void more() {{ {PUB}("map_" + std::to_string(n_), 1); n_++; }}', "", None, id="T1 a member that counts"),
        pytest.param("Part a(this, count(), {}); ", "", f'struct Part {{ Part(rclcpp::Node * node, int argc, char ** argv) {{ std::string t = "a"; if (argc > 1) {{ t = argv[1]; }} node->{PUB}(t, 1); }} }};', None, id="T2 a default beside the command line"),
        pytest.param(f'auto a = get_node_topics_interface()->resolve_topic_name("left"); auto b = get_node_topics_interface()->resolve_topic_name("image"); {PUB}(a + b, 1);', "", "", None, id="T3 two resolved names joined"),
        pytest.param(f"std::string t; fill(t); {PUB}(t, 1);", 'void fill(std::string & t) { t = "mine"; }', 'class Other { public: void fill(std::string & t) { t = "other"; } };', {"mine"}, id="T4 one name of a helper in two classes"),
        pytest.param('createSubscription("a");', f'void createSubscription(const std::string & t) {{ {SUB}(t + "/b", 1, {CB}); }}', "", set(), id="T5 a function that is called like a wrapper"),
        pytest.param(f'std::string t = "a"; t = "/" + t; {PUB}(t, 1);', "", "", {"/a"}, id="T9 an assignment to itself"),
        pytest.param(f'std::stringstream s; s << "a" << 1; {PUB}(s.str(), 1);', "", "", {"a1"}, id="T15 a name that is streamed"),
        pytest.param(f'std::string t = "outer"; auto make = [this](const std::string & t) {{ return {PUB}(t, 1); }}; make("a"); make("b");', "", "", {"a", "b"}, id="T16 a lambda called with each topic"),
        pytest.param('a_ = new Part(this, "a"); parts_.emplace_back<Part>(this, "b"); Part c{this, "c"}; d_ = std::make_unique<Part>(this, "d");', "", f"struct Part {{ Part(rclcpp::Node * node, const std::string & t) {{ node->{PUB}(t, 1); }} }};", {"a", "b", "c", "d"}, id="T31 ways to make an object"),
    ],
)  # fmt: skip
def test_names(cpp, body, members, before, names):
    found = cpp(body, members, before)
    assert set(known(found)) == (names or set())


@pytest.mark.parametrize(
    ("body", "qos"),
    [
        pytest.param(f'rclcpp::QoS q(1); if (declare_parameter("x", true)) {{ q.best_effort(); }} {PUB}("a", q);', [{"when": {"x": "true"}, "depth": 1, "reliability": "best_effort"}, {"depth": 1}], id="T11 a policy set under a condition"),
        pytest.param(f'rclcpp::QoS q(1); auto r = q; r.transient_local(); {PUB}("a", q);', {"depth": 1}, id="T12 a copy that is changed"),
        pytest.param(f'{PUB}("a", nav2::qos::SensorDataQoS());', {"profile": "sensor_data", "depth": 10}, id="T13 one name in two libraries"),
        pytest.param(f'const rmw_qos_profile_t p = {{RMW_QOS_POLICY_HISTORY_KEEP_LAST, 3, RMW_QOS_POLICY_RELIABILITY_RELIABLE, RMW_QOS_POLICY_DURABILITY_TRANSIENT_LOCAL, RMW_QOS_DEADLINE_DEFAULT, RMW_QOS_LIFESPAN_DEFAULT, RMW_QOS_POLICY_LIVELINESS_SYSTEM_DEFAULT, RMW_QOS_LIVELINESS_LEASE_DURATION_DEFAULT, false}}; {PUB}("a", rclcpp::QoS(rclcpp::QoSInitialization::from_rmw(p), p));', None, id="T14 fields by position"),
        pytest.param(f'auto info = get_publishers_info_by_topic("b"); auto q = info[0].qos_profile(); {PUB}("a", q);', {"unknown"}, id="T17 copied from a publisher"),
    ],
)  # fmt: skip
def test_qualities(cpp, body, qos):
    entry = cpp(body)["publishes"]["a"]["qos"]
    if qos is None:
        assert (entry["depth"], entry["durability"]) == (3, "transient_local")
    elif qos == {"unknown"}:
        assert "unknown" in entry
    else:
        assert entry == qos


def test_one_endpoint_that_is_made_again(cpp):
    """T7: the same endpoint in a reset is no second one."""
    found = cpp(
        f'{PUB}("a", 1); timer_ = create_wall_timer(1s, [this]() {{ reset(); }});', f'void reset() {{ {PUB}("a", 1); }}'
    )
    assert found["publishes"]["a"]["qos"] == {"depth": 1}
    assert "perhaps" not in found["publishes"]["a"]


def test_a_callback_of_parameters_makes_no_alternative(cpp):
    """T8: what it sets is a change while the node runs."""
    found = cpp(
        f't_ = declare_parameter("t", "a"); {PUB}(t_, 1); cb_ = add_on_set_parameters_callback(std::bind(&Driver::set, this, _1));',
        "std::string t_; rcl_interfaces::msg::SetParametersResult set(const std::vector<rclcpp::Parameter> & all) { for (auto p : all) { t_ = p.as_string(); } return {}; }",
    )
    assert list(found["publishes"]) == ["${t}"]


def test_the_order_of_arguments_of_nav2(learned, parser):
    """T10: the callback stands before the quality of service."""
    source = f'class Server : public nav2::LifecycleNode {{ public: Server(const rclcpp::NodeOptions & o) : nav2::LifecycleNode("s", "", o) {{}} nav2::CallbackReturn on_configure(const rclcpp_lifecycle::State &) {{ s_ = {SUB}("a", {CB}, rclcpp::QoS(3)); }} }};\nRCLCPP_COMPONENTS_REGISTER_NODE(Server)'
    found = learned({"src/server.cpp": source, "CMakeLists.txt": ""}).document["nodes"]["Server"]
    assert found["subscribes"]["a"]["qos"] == {"depth": 3}


def test_camera_info_stands_beside_the_image(cpp):
    """T18: in its namespace, not below its name."""
    found = cpp('p_ = image_transport::create_camera_publisher(this, "left/image_raw");')
    assert set(found["publishes"]) == {"left/image_raw", "left/camera_info"}


PART = f"struct Part {{ Part(rclcpp::Node * node, const std::string & t) {{ node->{PUB}(t, 1); }} }};"


@pytest.mark.parametrize(
    ("body", "members", "names"),
    [
        ('all_.emplace_back(this, "a"); all_.emplace_back(this, "b");', "std::vector<Part> all_;", {"a", "b"}),
        ('this->all_.emplace_front(this, "a");', "std::deque<Part> all_;", {"a"}),
        ('std::list<Part> all; all.emplace_back(this, "a");', "", {"a"}),
        ('all_.emplace_back(Part(this, "a"));', "std::vector<Part> all_;", {"a"}),
        ('one_.emplace(this, "a");', "std::optional<Part> one_;", {"a"}),
        ('one_ = std::make_optional<Part>(this, "a");', "std::optional<Part> one_;", {"a"}),
        ('one_ = std::optional<Part>(std::in_place, this, "a");', "std::optional<Part> one_;", {"a"}),
        ('all_.emplace("k", Part(this, "a"));', "std::map<std::string, Part> all_;", {"a"}),
        ('all_.try_emplace("k", this, "a");', "std::map<std::string, Part> all_;", {"a"}),
        ('one_.emplace<Part>(this, "a");', "std::variant<int, Part> one_;", {"a"}),
        ('all_.emplace(all_.begin(), this, "a");', "std::vector<Part> all_;", {"a"}),
        (
            'all_.emplace(std::piecewise_construct, std::forward_as_tuple("k"), std::forward_as_tuple(this, "a"));',
            "std::map<std::string, Part> all_;",
            {"a"},
        ),
        ('all_.emplace_back(this, "a");', "using Parts = std::vector<Part>; Parts all_;", {"a"}),
        ('for (auto t : {"a", "b"}) { all_.emplace_back(this, t); }', "std::vector<Part> all_;", {"a", "b"}),
    ],
)
def test_objects_that_a_container_makes_in_place(cpp, body, members, names):
    found = cpp(f'Part first(this, "first"); {body}', members, PART)
    assert set(known(found)) == names | {"first"}
    assert "unread" not in found


@pytest.mark.parametrize(
    ("body", "members"),
    [
        ('all_.push_back({this, "a"});', "std::vector<Part> all_;"),
        ('all_ = {{this, "a"}};', "std::vector<Part> all_;"),
        ('one_ = {this, "a"};', "std::optional<Part> one_;"),
        ('all_.insert({"k", {this, "a"}});', "std::map<std::string, Part> all_;"),
        ('auto make = [this]() -> Part { return {this, "a"}; }; make();', ""),
        ('all_.insert(all_.begin(), {this, "a"});', "std::vector<Part> all_;"),
        ('all_["k"].emplace_back(this, "a");', "std::map<std::string, std::vector<Part>> all_;"),
        ('auto & all = all_; all.emplace_back(this, "a");', "std::vector<Part> all_;"),
    ],
)  # fmt: skip
def test_objects_that_a_container_may_make_are_unread(cpp, body, members):
    found = cpp(f'Part first(this, "first"); {body}', members, PART)
    assert "a" in known(found) or [each["what"] for each in found["unread"]] == ["what `Part` in driver.cpp creates"]


MORE = "    def more(self, t):\n        self.create_publisher(String, t, 1)\n"


@pytest.mark.parametrize(
    ("body", "methods"),
    [
        ("make = self.create_publisher\nmake(String, 'a', 1)", ""),
        ("make = self.more\nmake('a')", MORE),
        ("make = functools.partial(self.create_publisher, String, qos_profile=1)\nmake('a')", ""),
        ("functools.partial(self.more, 'a')()", MORE),
        ("getattr(self, 'create_publisher')(String, 'a', 1)", ""),
        ("ways = {'out': self.create_publisher}\nways['out'](String, 'a', 1)", ""),
        ("ways = {'out': self.more}\nfor each in ways.values():\n    each('a')", MORE),
        ("ways = [self.create_publisher]\nways[0](String, 'a', 1)", ""),
        ("self.make = self.create_publisher\nself.make(String, 'a', 1)", ""),
        ("self.go(self.create_publisher)", "    def go(self, make):\n        make(String, 'a', 1)\n"),
    ],
)
def test_bound_methods_of_python(python, body, methods):
    found = python(f"self.create_publisher(String, 'first', 1)\n{body}", methods, "import functools")
    assert set(known(found)) == {"a", "first"}
    assert found["publishes"]["a"]["qos"] == {"depth": 1}
    assert "unread" not in found


@pytest.mark.parametrize(
    "body",
    [
        "make = getattr(self, 'create_' + kind())\nmake(String, 'a', 1)",
        "ways = {'out': self.create_publisher}\nways[kind()](String, 'a', 1)",
        "ways = dict(out=self.create_publisher)\nways['out'](String, 'a', 1)",
        "library(self.create_publisher)",
    ],
)
def test_bound_methods_that_are_not_followed_are_unread(python, body):
    found = python(f"self.create_publisher(String, 'first', 1)\n{body}")
    assert len(found["unread"]) == 1
    assert set(known(found)) == {"first"}


def test_callers_in_tests_do_not_count(learned, parser):
    """T19: their arguments are not those of the robot."""
    part = f"struct Part {{ Part(rclcpp::Node * node, const std::string & t) {{ node->{PUB}(t, 1); }} }};"
    main = 'int main() { auto n = std::make_shared<rclcpp::Node>("n"); Part p(n.get(), "real"); }'
    test = 'TEST(A, b) { auto n = std::make_shared<rclcpp::Node>("n"); Part p(n.get(), "/late"); }'
    files = {
        "src/driver.cpp": part + main,
        "test/test_part.cpp": test,
        "CMakeLists.txt": "add_executable(driver src/driver.cpp)",
    }
    found = learned(files).document["nodes"]["driver"]
    assert list(found["publishes"]) == ["real"]


def test_a_listener_without_a_node_is_not_certain(cpp):
    """T22: it makes its own hidden node."""
    found = cpp("listener_ = std::make_shared<tf2_ros::TransformListener>(*buffer_);")
    assert found["uses"] == ["tf2_ros::TransformListener"]
    assert "version of tf2_ros" in found["unread"][0]["cause"]


def test_other_names_of_types(cpp):
    """T24: aliases of types and classes."""
    found = cpp(
        'create_publisher<Cloud>("a", 1); create_publisher<Image>("b", 1);',
        "",
        "using Cloud = sensor_msgs::msg::PointCloud2;\nusing sensor_msgs::msg::Image;",
    )
    assert {name: each["type"] for name, each in found["publishes"].items()} == {
        "a": "sensor_msgs/msg/PointCloud2",
        "b": "sensor_msgs/msg/Image",
    }


def test_parameters_of_other_packages_do_not_count(tmp_path, parser):
    """T20, T21: a base class of another package counts, a parameter of one does not."""
    from cqos_ros2_sources.node_files.node_file_maker import learn
    from cqos_ros2_workspace.launch.workspace import find_packages

    files = {
        "base/package.xml": "<package><name>base</name></package>",
        "base/include/base.hpp": f'namespace base {{ class Base : public rclcpp::Node {{ public: Base(const std::string & n) : rclcpp::Node(n) {{ {PUB}(topic_, 1); }} std::string topic_ = "from_base"; }}; }}',
        "base/src/other.cpp": 'void other(rclcpp::Node & n) { n.declare_parameter("t", "wrong"); }',
        "bot/package.xml": "<package><name>bot</name><depend>base</depend></package>",
        "bot/CMakeLists.txt": "add_executable(bot src/bot.cpp)",
        "bot/src/bot.cpp": f'class Bot : public base::Base {{ public: Bot() : base::Base("bot") {{ std::string t; get_parameter("t", t); {PUB}(t, 1); }} }}; int main() {{ rclcpp::spin(std::make_shared<Bot>()); }}',
    }
    for name, text in files.items():
        path = tmp_path / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text)
    found = learn("bot", find_packages(str(tmp_path))).document["nodes"]["bot"]
    assert set(found["publishes"]) == {"from_base", "${t}"}
    assert found["parameters"] == {"t": {}}


CHOOSE = """
    def choose(self):
        self.topic = 'b'
"""


@pytest.mark.parametrize(
    "body",
    [
        "topics = ['a']\nwhile True:\n    topics.append('b')\n    break",
        "topics = ['a']\nwhile True:\n    topics = pick()\n    break",
        "while rclpy.ok():\n    self.choose()\n    break\ntopics = [self.topic]",
        "for each in read():\n    if each:\n        self.choose()\n        break\ntopics = [self.topic]",
        "for each in read():\n    if each:\n        self.choose()\n        continue\n    print(each)\ntopics = [self.topic]",
        "for each in ['x', 'y']:\n    if read(each):\n        self.choose()\n        continue\n    print(each)\ntopics = [self.topic]",
        "for each in read():\n    while True:\n        self.choose()\n        break\n    break\ntopics = [self.topic]",
    ],
)
def test_what_a_loop_sets_before_it_is_left(python, body):
    made = "self.topic = 'a'\n" + body + "\nfor topic in topics:\n    self.create_publisher(String, topic, 1)"
    found = python(made, CHOOSE, "def pick():\n    return ['b']\n")
    assert len(found["publishes"]) == 1
    assert not known(found)


def test_what_a_loop_leaves_as_it_is(python):
    body = "self.topic = 'a'\nfor each in read():\n    if each:\n        break\nfor each in ['x', 'y']:\n    if read(each):\n        continue\n    print(each)\nself.create_publisher(String, self.topic, 1)"
    assert set(known(python(body))) == {"a"}
