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
        (f'int d = 4; rclcpp::QoS q(d); {PUB}("a", q);', "a", {"depth": 4}),  # it reads like the declaration of a function
        (f'{PUB}("a", rclcpp::QoS(1).reliability((rmw_qos_reliability_policy_t)(2)));', "a", {"depth": 1, "reliability": "best_effort"}),
        (f'std::string t = "a"; for (int i = 0; i < 3; ++i) {{ t += "x"; }} {PUB}(t, 1);', "axxx", {"depth": 1}),
        (f'std::vector<std::string> n{{"b", "a"}}; {PUB}(n.at(1), n.size());', "a", {"depth": 2}),
        (f'std::stringstream s; s << "a" << 1 << "/b"; {PUB}(s.str(), 1);', "a1/b", {"depth": 1}),
        (f'std::stringstream s; s << "x"; s.str(""); s << "a"; {PUB}(s.str(), 1);', "a", {"depth": 1}),
        (f'{PUB}(fmt::format("{{}}/b{{}}", "a", 2), 1);', "a/b2", {"depth": 1}),
        (f'{PUB}(rclcpp::expand_topic_or_service_name("a", get_name(), get_namespace()), 1);', "a", {"depth": 1}),
        (f'{PUB}("a", rmw_qos_profile_sensor_data.depth);', "a", {"depth": 5}),
        (f'{PUB}("a", RMW_QOS_POLICY_HISTORY_KEEP_LAST);', "a", {"depth": 1}),
        (f'{PUB}("/tf_static", tf2_ros::StaticListenerQoS());', "/tf_static", {"depth": 100, "durability": "transient_local"}),
        (f'bool l = declare_parameter<bool>("latch", true); {PUB}("a", rclcpp::QoS(1).durability(l ? RMW_QOS_POLICY_DURABILITY_TRANSIENT_LOCAL : RMW_QOS_POLICY_DURABILITY_VOLATILE));', "a", [{"when": {"latch": "true"}, "depth": 1, "durability": "transient_local"}, {"depth": 1, "durability": "volatile"}]),
        (f'{PUB}("a", QUALITY(3, RMW_QOS_POLICY_RELIABILITY_BEST_EFFORT));', "a", {"depth": 3, "reliability": "best_effort"}),
    ],
)  # fmt: skip
def test_values_are_followed(cpp, body, name, qos):
    found = cpp(body, "", "#define QUALITY(depth, kind) rclcpp::QoS(depth).reliability(kind)")
    assert list(found["publishes"]) == [name]
    entry = found["publishes"][name]
    assert entry["qos"] == qos
    assert entry["type"] == "std_msgs/msg/String"
    assert entry["at"].startswith("src/driver.cpp:")


@pytest.mark.parametrize(
    "body",
    [
        f'std::string t = "a"; if (rclcpp::ok()) {{ t = "b"; }} {PUB}(t, 1);',  # one of two, by a condition that is not known
        f'std::string t = "a"; for (int i = 0; i < count(); ++i) {{ t += "x"; }} {PUB}(t, 1);',
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


def test_a_filter_subscribes_with_a_later_call(cpp):
    """T23: without a quality of service, message_filters takes the default of rmw."""
    found = cpp(
        'sub_.subscribe(this, "a"); rclcpp::QoS qos(3); other_.subscribe(this, "b", qos.get_rmw_qos_profile());',
        "message_filters::Subscriber<sensor_msgs::msg::Image> sub_; message_filters::Subscriber<sensor_msgs::msg::Image> other_;",
    )
    image = {"type": "sensor_msgs/msg/Image", "at": "src/driver.cpp:5"}
    assert found["subscribes"] == {"a": {**image, "qos": "default"}, "b": {**image, "qos": {"depth": 3}}}


def test_a_parameter_chooses_the_transport(cpp):
    found = cpp(
        'image_transport::TransportHints hints(this); sub_.subscribe(this, "image", hints.getTransport());',
        "image_transport::SubscriberFilter sub_;",
    )
    assert found["parameters"] == {"image_transport": {"default": "raw"}}
    assert found["subscribes"]["image"]["when"] == {"image_transport": "raw"}
    assert found["subscribes"]["image"]["type"] == "sensor_msgs/msg/Image"
    assert found["subscribes"]["image/${image_transport}"]["when"] == {"image_transport": {"not": "raw"}}
    assert "type" not in found["subscribes"]["image/${image_transport}"]


def test_a_parameter_chooses_a_policy_by_its_number(cpp):
    found = cpp(
        f'int kind = RMW_QOS_POLICY_RELIABILITY_RELIABLE; kind = declare_parameter("kind", kind); {PUB}("a", rclcpp::QoS(1).reliability((rmw_qos_reliability_policy_t)kind));'
    )
    assert found["parameters"] == {"kind": {"default": 1}}
    assert {"when": {"kind": "2"}, "depth": 1, "reliability": "best_effort"} in found["publishes"]["a"]["qos"]


def test_one_of_two_texts_by_a_parameter_goes_into_names(cpp):
    found = cpp(f'auto p = declare_parameter("p", "x"); std::string t = p.empty() ? "" : p + "/"; {PUB}(t + "a", 1);')
    assert found["publishes"]["a"]["when"] == {"p": ""}
    assert found["publishes"]["${p}/a"]["when"] == {"p": {"not": ""}}


def test_a_constant_of_a_class_is_defined_outside(cpp):
    found = cpp(
        f"{PUB}(Names::TOPIC, 1); {PUB}(OWN, 1);",
        "static const std::string OWN;",
        'struct Names { static const std::string TOPIC; }; const std::string Names::TOPIC = "a"; const std::string Driver::OWN = "b";',
    )
    assert set(found["publishes"]) == {"a", "b"}


def test_methods_of_classes_that_are_not_known_make_nothing(cpp):
    found = cpp('redis_->subscribe("a", 1); bus().advertise("b", 1);', "Redis * redis_;")
    assert not {"publishes", "subscribes", "unread"} & set(found)


def test_a_class_that_nothing_makes_is_learned_by_itself(learned, parser):
    source = f"""
class Part {{
public:
  explicit Part(const rclcpp::Node::SharedPtr & node) : node_(node) {{}}
  void start(const std::string & topic) {{ {PUB.replace("create", "pub_ = node_->create")}("status", 2); node_->{PUB}(topic, 1); }}
  rclcpp::Node::SharedPtr node_;
}};
"""
    found = learned({"src/part.cpp": source}).document["fragments"]["Part"]["publishes"]
    assert found["status"]["qos"] == {"depth": 2}
    assert found["status"]["perhaps"] == "C-QoS found nothing that calls `start`"
    assert found["(unknown 1)"]["unknown"] == "what it is given"


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


@pytest.mark.parametrize(
    "cmake",
    [
        "add_executable(left src/left.cpp)\nadd_executable(right src/right.cpp)",
        "add_executable(left)\ntarget_sources(left PRIVATE src/left.cpp)\nadd_executable(right)\ntarget_sources(right PUBLIC src/right.cpp)",
    ],
)
def test_programs_of_a_package_may_have_classes_of_one_name(learned, parser, cmake):
    one = f'class Driver : public rclcpp::Node {{ public: Driver() : Node("NAME") {{ make(); }} void make() {{ {PUB}("NAME", 1); }} }}; int main() {{ rclcpp::spin(std::make_shared<Driver>()); }}'
    files = {f"src/{name}.cpp": one.replace("NAME", name) for name in ("left", "right")}
    nodes = learned({"CMakeLists.txt": cmake, **files}).document["nodes"]
    assert {name: list(each["publishes"]) for name, each in nodes.items()} == {"left": ["left"], "right": ["right"]}


def test_a_profile_with_another_depth(cpp):
    found = cpp(
        f'auto p = rmw_qos_profile_sensor_data; {PUB}("a", rclcpp::QoS(rclcpp::QoSInitialization(p.history, 7), p));'
    )
    assert found["publishes"]["a"]["qos"] == {"profile": "sensor_data", "depth": 7}


def test_a_member_that_another_method_reads_a_parameter_into_is_unknown(cpp):
    members = f'std::string t_ = "a"; void configure() {{ get_parameter("t", t_); }} void tick() {{ {PUB}(t_, 1); }}'
    found = cpp("timer_ = create_wall_timer(std::chrono::seconds(1), [this]() { tick(); });", members)
    assert all("unknown" in each for each in found["publishes"].values())


def test_a_member_that_a_callback_changes(cpp):
    """What the callback makes itself is known, and perhaps; what it makes of the value before is not."""
    members = f'std::string t_; void select() {{ {PUB}(t_ + "/a", 1); t_ = "none"; {PUB}(t_, 1); }}'
    body = (
        't_ = declare_parameter("t", "a"); timer_ = create_wall_timer(std::chrono::seconds(1), [this]() { select(); });'
    )
    found = cpp(body, members)["publishes"]
    assert set(found) == {"none", "(unknown 1)"}
    assert all("callback" in each["perhaps"] for each in found.values())


@pytest.mark.parametrize(
    "body",
    [
        f'std::string t = "a"; later([&]() {{ t = "b"; }}); {PUB}(t, 1);',
        f'topic_ = "a"; watch("topic", [this](const auto & p) {{ topic_ = p.as_string(); }}); {PUB}(topic_, 1);',
        f'topic_ = "a"; keep([this](const auto & p) {{ topic_ = p.as_string(); }}); {PUB}(topic_, 1);',
        f'std::string t = "A"; std::transform(t.begin(), t.end(), t.begin(), ::tolower); {PUB}(t, 1);',
        f'std::vector<std::string> n{{"a"}}; std::sort(n.begin(), n.end()); {PUB}(n[0], 1);',
        f"std::vector<std::string> n; std::copy_if(all.begin(), all.end(), std::back_inserter(n), ok); for (auto & t : n) {{ {PUB}(t, 1); }}",
        f'std::stringstream s("x"); s << "a"; {PUB}(s.str(), 1);',
        f'{PUB}("a" + std::to_string(1.5), 1);',
    ],
)  # fmt: skip
def test_a_name_that_a_lambda_or_a_layout_decides_is_unknown(cpp, body):
    members = "template<typename F> void keep(F f) { kept_ = f; } std::function<void()> kept_; std::string topic_;"
    found = cpp(body, members)
    assert all("unknown" in each for each in found["publishes"].values())


def test_a_flag_that_a_kept_lambda_sets_decides_nothing(cpp):
    body = f'keep([this](const auto & p) {{ on_ = p.as_bool(); }}); if (on_) {{ {PUB}("a", 1); }} else {{ {PUB}("b", 1); }}'
    found = cpp(
        body, "template<typename F> void keep(F f) { kept_ = f; } std::function<void()> kept_; bool on_ = true;"
    )
    assert all("perhaps" in found["publishes"][name] for name in ("a", "b"))


def test_what_a_kept_lambda_makes_may_be_made(cpp):
    members = "template<typename F> void keep(F f) { kept_ = f; } std::function<void()> kept_;"
    found = cpp(f'keep([this](const auto &) {{ {PUB}("late", 1); }});', members)
    assert "perhaps" in found["publishes"]["late"]


@pytest.mark.parametrize(
    ("body", "names"),
    [
        ('for (int i = 1; i <= 2; i++) { %s("a" + std::to_string(i), 1); }', ["a1", "a2"]),
        ('std::vector<std::string> n{"x", "y"}; for (size_t i = 0; i < n.size(); ++i) { if (n[i] == "x") { continue; } %s(n[i], 1); }', ["y"]),
        ('for (int i = 0; i < 2; ++i) { i++; %s("a" + std::to_string(i), 1); }', ["(unknown 1)"]),
    ],
)  # fmt: skip
def test_a_loop_that_counts_is_followed(cpp, body, names):
    assert list(cpp(body % PUB)["publishes"]) == names


def test_parameters_of_generate_parameter_library_are_known(learned, parser):
    source = f"""namespace bot {{ class Driver : public rclcpp::Node {{ public: Driver() : Node("driver") {{
        listener_ = std::make_shared<ParamListener>(get_node_parameters_interface()); params_ = listener_->get_params();
        {PUB}(params_.out.topic, params_.depth); for (auto & name : params_.names) {{ {PUB}(name + "/x", 1); }} }}
        std::shared_ptr<ParamListener> listener_; Params params_; }}; }}
        int main() {{ rclcpp::spin(std::make_shared<bot::Driver>()); }}"""
    tree = "bot:\n  depth: {type: int, default_value: 3}\n  names: {type: string_array}\n  out:\n    topic: {type: string, default_value: status}\n"
    found = learned(
        {
            "CMakeLists.txt": "generate_parameter_library(bot_parameters\n  src/bot.yaml\n)\nadd_executable(driver src/driver.cpp)\n",
            "src/bot.yaml": tree,
            "src/driver.cpp": source,
        }
    ).document["nodes"]["driver"]
    assert found["publishes"]["${out.topic}"]["qos"] == {"depth": "${depth}"}
    assert found["publishes"]["${each_name}/x"]["for_each"] == {"each_name": "${names}"}
    assert found["parameters"] == {"depth": {"default": 3}, "names": {}, "out.topic": {"default": "status"}}


def test_a_method_whose_definition_was_not_read_may_set_every_member(cpp):
    body = f'setup(); if (on_) {{ {PUB}("a", 1); }} {PUB}(topic_, 1); {PUB}(kName, 1);'
    found = cpp(
        body, 'void setup(); bool on_ = false; std::string topic_ = "x"; static constexpr const char * kName = "n";'
    )
    assert "perhaps" in found["publishes"]["a"]
    assert set(found["publishes"]) == {"a", "n", "(unknown 1)"}


def test_branches_that_divide_a_block_are_read_with_a_note(learned, parser):
    source = f"""class Driver : public rclcpp::Node {{ public: Driver() : Node("driver") {{ make(); }} void make(); }};
#if NEW
void Driver::make() {{ if (true) {{
#else
void Driver::make() {{ if (false) {{
#endif
  {PUB}("a", 1); }} }}
int main() {{ rclcpp::spin(std::make_shared<Driver>()); }}"""
    found = learned({"CMakeLists.txt": "add_executable(driver src/driver.cpp)\n", "src/driver.cpp": source})
    assert "a" in found.document["nodes"]["driver"]["publishes"]
    assert any("divides a block" in cause for _, cause, _ in found.gaps)


def test_a_block_that_one_branch_opens_and_another_closes(learned, parser):
    source = f"""class Driver : public rclcpp::Node {{ public: Driver() : Node("driver") {{ make(); {PUB}(t_, 1); }} void make(); std::string t_ = "b"; }};
void Driver::make() {{
  if (live_) {{
#ifndef NEW
    if (other_) {{
#endif
    {PUB}("a", 1);
#ifndef NEW
  }}
#endif
  }}
}}
int main() {{ rclcpp::spin(std::make_shared<Driver>()); }}"""
    found = learned({"CMakeLists.txt": "add_executable(driver src/driver.cpp)\n", "src/driver.cpp": source})
    made = found.document["nodes"]["driver"]["publishes"]
    assert set(made) == {"a", "b"}
    assert "perhaps" in made["a"]
    assert any("divides a block" in cause for _, cause, _ in found.gaps)


def test_a_constant_of_the_same_file_is_meant(learned, parser):
    one = "namespace {{ constexpr auto kDepth = {}; }}\n"
    source = f"""class Driver : public rclcpp::Node {{ public: Driver() : Node("driver") {{ {PUB}("a", kDepth); }} }};
        int main() {{ rclcpp::spin(std::make_shared<Driver>()); }}"""
    found = learned(
        {
            "CMakeLists.txt": "add_executable(driver src/driver.cpp src/other.cpp)\n",
            "src/driver.cpp": one.format(3) + source,
            "src/other.cpp": one.format(9),
        }
    ).document["nodes"]["driver"]
    assert found["publishes"]["a"]["qos"] == {"depth": 3}


def test_a_constant_is_made_from_those_of_its_own_file(learned, parser):
    header = 'namespace {0} {{ const std::string kPrefix = "{0}/"; const std::string kTopic = kPrefix + "x"; }}\n'
    source = f"""class Driver : public rclcpp::Node {{ public: Driver() : Node("driver") {{ {PUB}(one::kTopic, 1); {PUB}(two::kTopic, 1); }} }};
        int main() {{ rclcpp::spin(std::make_shared<Driver>()); }}"""
    found = learned(
        {
            "CMakeLists.txt": "add_executable(driver src/driver.cpp)\n",
            "include/one.hpp": header.format("one"),
            "include/two.hpp": header.format("two"),
            "src/driver.cpp": source,
        }
    ).document["nodes"]["driver"]
    assert set(found["publishes"]) == {"one/x", "two/x"}


def test_an_executable_whose_source_is_a_test_makes_nothing(learned, parser):
    """The one `main` that was read is that of another executable."""
    main = f'int main() {{ auto node = std::make_shared<rclcpp::Node>("n"); node->{PUB}("a", 1); }}'
    files = {
        "CMakeLists.txt": "add_executable(driver src/driver.cpp)\nadd_executable(tried test/tried.cpp)\nadd_executable(other ${OTHERS})\nadd_executable(more ${OTHERS})\n",
        "src/driver.cpp": main,
        "test/tried.cpp": "int main() {}",
    }
    assert list(learned(files).document["nodes"]) == ["driver"]


def test_the_only_main_is_that_of_the_only_executable(learned, parser):
    main = f'int main() {{ auto node = std::make_shared<rclcpp::Node>("n"); node->{PUB}("a", 1); }}'
    files = {"CMakeLists.txt": "file(GLOB ALL src/*.cpp)\nadd_executable(driver ${ALL})\n", "src/start.cpp": main}
    assert list(learned(files).document["nodes"]) == ["driver"]


@pytest.mark.parametrize(
    ("body", "unknown"),
    [
        ('set_parameter(rclcpp::Parameter("t", read()));', True),
        ('this->set_parameters({rclcpp::Parameter("u", 1), rclcpp::Parameter("t", read())});', True),
        ("set_parameters(all_of_them());", True),
        ('set_parameter({"t", read()});', True),
        ("set_parameter(rclcpp::Parameter(bond::NAME, true));", True),
        ("declare_parameter(bond::NAME, true); set_parameter(rclcpp::Parameter(bond::NAME, true));", False),
        ('set_parameter(rclcpp::Parameter("use_sim_time", true));', False),
        ('set_parameter({"use_sim_time", true});', False),
        ('create_wall_timer(1s, [this]() { set_parameter(rclcpp::Parameter("t", read())); });', False),
        ('other_->set_parameters({rclcpp::Parameter("t", "b")});', False),
    ],
)
def test_a_parameter_that_the_program_sets(cpp, body, unknown):
    before = 'declare_parameter("t", "a"); other_ = std::make_shared<rclcpp::SyncParametersClient>(this, "other"); '
    found = cpp(
        f'{before}{body} {PUB}(get_parameter("t").as_string(), 1);',
        "std::shared_ptr<rclcpp::SyncParametersClient> other_;",
    )["publishes"]
    assert list(found) == (["(unknown 1)"] if unknown else ["${t}"])


def test_branches_that_divide_a_list_of_parameters(learned, parser):
    source = f"""class Driver : public rclcpp::Node {{ public: Driver() : Node("driver") {{ make("a", true, 1); }}
  void make(const std::string & topic, bool on, int depth); }};
void Driver::make(
  const std::string & topic,
#ifdef WITH_SWITCH
  bool on,
#else
  bool,
#endif
  int depth)
{{
#ifdef WITH_SWITCH
  log(on);
#endif
  {PUB}(topic, depth);
}}
int main() {{ rclcpp::spin(std::make_shared<Driver>()); }}"""
    found = learned({"CMakeLists.txt": "add_executable(driver src/driver.cpp)\n", "src/driver.cpp": source})
    assert found.document["nodes"]["driver"]["publishes"]["a"]["qos"] == {"depth": 1}
    assert any("list of parameters" in cause for _, cause, _ in found.gaps)
