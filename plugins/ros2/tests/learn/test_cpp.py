"""What is learned from C++: known values as they are, all others as not known. Sources are our own."""

from __future__ import annotations

import pytest

PUB = "create_publisher<std_msgs::msg::String>"


@pytest.mark.parametrize(
    ("body", "name", "qos"),
    [
        (f'{PUB}("a", 7);', "a", {"depth": 7}),
        (f'auto t = std::string("x") + "/y"; {PUB}(t, 1);', "x/y", {"depth": 1}),
        (f'{PUB}("a", rclcpp::SensorDataQoS());', "a", "sensor_data"),
        (f'{PUB}("a", rclcpp::QoS(3).reliable().transient_local());', "a", {"depth": 3, "reliability": "reliable", "durability": "transient_local"}),
        (f'rclcpp::QoS q(2); q.best_effort(); {PUB}("a", q);', "a", {"depth": 2, "reliability": "best_effort"}),
        (f'rclcpp::QoS q(2); auto r = q; r.best_effort(); {PUB}("a", q);', "a", {"depth": 2}),
        (f'rclcpp::QoS q{{rclcpp::KeepAll()}}; {PUB}("a", q);', "a", {"history": "keep_all"}),
        (f'rclcpp::QoS q(1); q.deadline(std::chrono::milliseconds(100)); {PUB}("a", q);', "a", {"depth": 1, "deadline": "100ms"}),
        (f'rmw_qos_profile_t p = rmw_qos_profile_default; p.depth = 4; p.reliability = RMW_QOS_POLICY_RELIABILITY_BEST_EFFORT; {PUB}("a", rclcpp::QoS(rclcpp::QoSInitialization::from_rmw(p), p));', "a", {"depth": 4, "reliability": "best_effort"}),
        (f'auto t = declare_parameter<std::string>("topic", "scan"); {PUB}(t, 1);', "${topic}", {"depth": 1}),
        (f'std::string t; declare_parameter("topic", "scan"); get_parameter("topic", t); {PUB}(t, 1);', "${topic}", {"depth": 1}),
        (f'int d = declare_parameter("depth", 5); {PUB}("a", rclcpp::QoS(d));', "a", {"depth": "${depth}"}),
        (f'{PUB}(std::string(get_name()) + "/a", 1);', "${node}/a", {"depth": 1}),
    ],
)  # fmt: skip
def test_values_are_followed(cpp, body, name, qos):
    found = cpp(body)
    assert list(found["publishes"]) == [name]
    entry = found["publishes"][name]
    assert entry["qos"] == qos
    assert entry["type"] == "std_msgs/msg/String"
    assert entry["at"].startswith("src/driver.cpp:")


@pytest.mark.parametrize(
    "body",
    [
        f'std::string t = "a"; if (rclcpp::ok()) {{ t = "b"; }} {PUB}(t, 1);',  # one of two, by a condition that is not known
        f'std::string t = "a"; for (int i = 0; i < 3; ++i) {{ t += "x"; }} {PUB}(t, 1);',
        f'std::string t = "a"; change(t); {PUB}(t, 1);',  # it may be changed by reference
        f"std::string t = argv[1]; {PUB}(t, 1);",
        f'int n = 0; n++; {PUB}("a" + std::to_string(n), 1);',
    ],
)  # fmt: skip
def test_a_name_that_is_not_decided_is_unknown(cpp, body):
    found = cpp(body)
    assert all("unknown" in each for each in found["publishes"].values())


def test_a_helper_class_belongs_to_the_node_that_makes_it(cpp):
    before = f"class Sensor {{ public: Sensor(rclcpp::Node * node, const std::string & topic) {{ pub_ = node->{PUB}(topic, 10); }} rclcpp::Publisher<std_msgs::msg::String>::SharedPtr pub_; }};"
    found = cpp('a_ = std::make_unique<Sensor>(this, "imu"); b_ = new Sensor(this, "odom");', "", before)
    assert set(found["publishes"]) == {"imu", "odom"}


def test_an_argument_by_reference_comes_back(cpp):
    found = cpp(f"std::string t; fill(t); {PUB}(t, 1);", 'void fill(std::string & out) { out = "filled"; }')
    assert list(found["publishes"]) == ["filled"]


def test_a_flag_of_a_parameter_decides_whether_it_is_made(cpp):
    found = cpp(
        f'auto on = declare_parameter<bool>("on", true); if (on) {{ {PUB}("a", 1); }} else {{ {PUB}("b", 1); }}'
    )
    assert found["publishes"]["a"]["when"] == {"on": "true"}
    assert found["publishes"]["b"]["when"] == {"on": {"not": "true"}}
    assert found["parameters"] == {"on": {"default": True}}


def test_what_only_a_callback_makes_is_not_certain(cpp):
    found = cpp(
        "timer_ = create_wall_timer(std::chrono::seconds(1), std::bind(&Driver::tick, this));",
        f'void tick() {{ {PUB}("late", 1); }}',
    )
    assert "perhaps" in found["publishes"]["late"]


def test_both_branches_of_the_preprocessor_are_one_endpoint(cpp):
    found = cpp(f'#if RCLCPP_VERSION_GTE(29, 0, 0)\n{PUB}("a", 1);\n#else\n{PUB}("a", 1);\n#endif\n')
    assert "perhaps" not in found["publishes"]["a"]


def test_different_qualities_at_two_places_are_unknown(cpp):
    found = cpp(f'{PUB}("a", 1); {PUB}("a", rclcpp::SensorDataQoS());')
    assert "unknown" in found["publishes"]["a"]["qos"]


def test_a_creating_call_that_nothing_calls_is_named(cpp):
    found = cpp(f'{PUB}("a", 1);', f'void never() {{ {PUB}("b", 1); }}')
    assert list(found["publishes"]) == ["a"]
    assert "`never`" in found["unread"][0]["cause"]


def test_a_loop_over_a_list_makes_one_endpoint_for_each(cpp):
    found = cpp(f'std::vector<std::string> names{{"l", "r"}}; for (auto n : names) {{ {PUB}(n + "/scan", 1); }}')
    assert set(found["publishes"]) == {"l/scan", "r/scan"}


def test_a_loop_over_a_parameter_is_one_endpoint_with_a_variable(cpp):
    found = cpp(
        f'auto names = declare_parameter<std::vector<std::string>>("names"); for (auto n : names) {{ {PUB}(n + "/scan", 1); }}'
    )
    assert found["publishes"]["${each_n}/scan"]["for_each"] == {"each_n": "${names}"}


def test_overrides_that_the_code_opts_in_to(cpp):
    found = cpp(
        f'rclcpp::PublisherOptions o; o.qos_overriding_options = rclcpp::QosOverridingOptions::with_default_policies(); {PUB}("a", 1, o);'
    )
    assert found["publishes"]["a"]["overridable"] == ["history", "depth", "reliability"]


def test_a_member_that_another_method_sets_is_unknown_in_a_callback(cpp):
    members = f'std::string t_ = "a"; void set(std::string s) {{ t_ = s; }} void tick() {{ {PUB}(t_, 1); }}'
    found = cpp("timer_ = create_wall_timer(std::chrono::seconds(1), [this]() { tick(); });", members)
    assert all("unknown" in each for each in found["publishes"].values())


def test_components_and_life_cycle(learned, parser):
    source = f"""
namespace bot {{
class Server : public rclcpp_lifecycle::LifecycleNode {{
public:
  explicit Server(const rclcpp::NodeOptions & options) : LifecycleNode("server", "", options) {{}}
  CallbackReturn on_configure(const rclcpp_lifecycle::State & state) {{ pub_ = {PUB}("map", rclcpp::QoS(1).transient_local()); return CallbackReturn::SUCCESS; }}
}};
}}
RCLCPP_COMPONENTS_REGISTER_NODE(bot::Server)
"""
    cmake = 'rclcpp_components_register_node(lib PLUGIN "bot::Server" EXECUTABLE server_node)'
    found = learned({"CMakeLists.txt": cmake, "src/server.cpp": source}).document["nodes"]["server_node"]
    assert (found["name"], found["plugin"], found["lifecycle"]) == ("server", "bot::Server", True)
    assert found["publishes"]["map"]["qos"] == {"depth": 1, "durability": "transient_local"}


def test_a_team_adds_a_call(learned, tmp_path, parser):
    table = tmp_path / "team.calls.yaml"
    table.write_text(
        "cqos_calls: 1\nlanguage: cpp\ncalls:\n  - {call: 'team::advertise', node: 0, makes: publishes, type: template 0, topic: 1, qos: 2}\n"
    )
    source = 'int main() { auto n = std::make_shared<rclcpp::Node>("n"); team::advertise<std_msgs::msg::String>(n, "a", 3); }'
    cmake = "add_executable(driver src/driver.cpp)"
    found = learned({"CMakeLists.txt": cmake, "src/driver.cpp": source}, str(table)).document["nodes"]["driver"]
    assert found["publishes"]["a"]["qos"] == {"depth": 3}
