"""What was not read and is handed a node may create endpoints there: the node file says so, apart from libraries that are known."""

from __future__ import annotations

import pytest

CAUSE = "it is handed the node, and its definition was not read"
HELPER = "class Helper { public: Helper(rclcpp::Node * node) : node_(node) { library::attach(node_); } rclcpp::Node * node_; };"


def unread(found):
    return [each["what"] for each in found.get("unread", []) if each["cause"] == CAUSE]


@pytest.mark.parametrize(
    ("body", "members", "before", "name"),
    [
        ("library::Monitor monitor(this);", "", "", "library::Monitor"),
        ("monitor_ = std::make_unique<library::Monitor>(shared_from_this(), 1);", "", "", "library::Monitor"),
        ("monitor_ = new library::Monitor<int>(*this);", "", "", "library::Monitor"),
        ("monitor_.start(this);", "library::Monitor monitor_;", "", "start"),
        ("library::attach(get_node_topics_interface());", "", "", "library::attach"),
        ("library::attach(get_node_services_interface());", "", "", "library::attach"),
        ("library::attach(this->shared_from_this(), [this]() { tick(); });", "void tick() {}", "", "library::attach"),
        ("library::attach(rclcpp::node_interfaces::NodeInterfaces<rclcpp::node_interfaces::NodeTopicsInterface>(*this));", "", "", "library::attach"),
        ("image_transport::ImageTransport it(shared_from_this()); library::attach(it);", "", "", "library::attach"),
        ("helper_ = std::make_unique<Helper>(this);", "", HELPER, "library::attach"),
    ],
)  # fmt: skip
def test_what_is_not_read_may_create_something(cpp, body, members, before, name):
    assert unread(cpp(body, members, before)) == [f"what `{name}` creates"]


@pytest.mark.parametrize(
    "body",
    [
        "rclcpp::spin_some(shared_from_this());",
        "executor_.add_node(get_node_base_interface());",
        "rclcpp::create_timer(this, get_clock(), period, [this]() {});",
        "buffer_->setCreateTimerInterface(std::make_shared<tf2_ros::CreateTimerROS>(get_node_base_interface(), get_node_timers_interface()));",
        "library::Slot slot(&Driver::tick, *this);",
        "std::thread t(&Driver::tick, this); std::vector<rclcpp::Node *> all; all.push_back(this);",
        "auto logged = library::Logger(get_node_logging_interface(), get_node_clock_interface());",
        "parameters_ = std::make_shared<rclcpp::SyncParametersClient>(this, std::string());",
        'sub_ = std::make_shared<message_filters::Subscriber<sensor_msgs::msg::Image>>(this, "a"); sync_ = std::make_shared<message_filters::TimeSynchronizer<A, B>>(*sub_, *sub_, 1);',
        'RCLCPP_INFO(get_logger(), "%p", this);',
    ],
)  # fmt: skip
def test_what_creates_nothing_is_known(cpp, body):
    assert unread(cpp(body, "void tick() {}")) == []


@pytest.mark.parametrize(
    ("body", "direction", "entries"),
    [
        ('bond_ = std::make_unique<bond::Bond>("bond", "id", shared_from_this());', "publishes", {"bond": ("bond/msg/Status", {"depth": 5})}),
        ('bond_ = std::make_unique<bond::Bond>("bond", "id", shared_from_this(), [this]() {});', "subscribes", {"bond": ("bond/msg/Status", {"depth": 100})}),
        ('server_ = std::make_unique<interactive_markers::InteractiveMarkerServer>("marks", this);', "publishes", {"marks/update": ("visualization_msgs/msg/InteractiveMarkerUpdate", {"depth": 100})}),
        ('server_ = std::make_unique<interactive_markers::InteractiveMarkerServer>("marks", this, rclcpp::QoS(2), rclcpp::QoS(3));', "subscribes", {"marks/feedback": ("visualization_msgs/msg/InteractiveMarkerFeedback", {"depth": 3})}),
        ('server_ = std::make_unique<interactive_markers::InteractiveMarkerServer>("marks", this);', "serves", {"marks/get_interactive_markers": ("visualization_msgs/srv/GetInteractiveMarkers", "services_default")}),
        ('camera_ = std::make_shared<camera_info_manager::CameraInfoManager>(this, "left");', "serves", {"~/set_camera_info": ("sensor_msgs/srv/SetCameraInfo", "default")}),
        ("buffer_ = std::make_shared<tf2_ros::Buffer>(get_clock(), tf2::Duration(1), shared_from_this());", "serves", {"tf2_frames": ("tf2_msgs/srv/FrameGraph", "services_default")}),
        ("buffer_ = std::make_shared<tf2_ros::Buffer>(get_clock());", "serves", {}),
        ("events_ = std::make_shared<rclcpp::ParameterEventHandler>(this);", "subscribes", {"/parameter_events": ("rcl_interfaces/msg/ParameterEvent", "parameter_events")}),
    ],
)  # fmt: skip
def test_libraries_that_are_known(cpp, body, direction, entries):
    found = cpp(body)
    assert unread(found) == []
    made = found.get(direction, {})
    assert {name: (each["type"], each.get("qos", "default")) for name, each in made.items()} == entries


@pytest.mark.parametrize(
    ("body", "names"),
    [
        ("Monitor(self)", ["library.Monitor"]),
        ("library.attach(node=self)", ["library.attach"]),
        ("rclpy.spin_once(self)\nprint(self)\nisinstance(self, Node)", []),
        ("tf2_ros.Buffer(node=self)", []),
        ("tf2_ros.Buffer()", []),
        ("diagnostic_updater.Updater(self)", []),
    ],
)
def test_python(python, body, names):
    found = python(body, "", "import library, tf2_ros, diagnostic_updater\nfrom library import Monitor")
    assert unread(found) == [f"what `{each}` creates" for each in names]
    assert ("tf2_frames" in found.get("serves", {})) is ("node=self" in body and "tf2" in body)
    assert ("/diagnostics" in found.get("publishes", {})) is ("Updater" in body)


def test_a_base_class_that_is_handed_the_node(learned, parser):
    source = 'class Driver : public rclcpp::Node, public library::Mixin { public: Driver() : Node("driver"), library::Mixin(this) {} };\nint main() { rclcpp::spin(std::make_shared<Driver>()); }'
    files = {"CMakeLists.txt": "add_executable(driver src/driver.cpp)\n", "src/driver.cpp": source}
    assert unread(learned(files).document["nodes"]["driver"]) == ["what `library::Mixin` creates"]


def test_a_class_that_nothing_makes(learned, parser):
    makes = 'library::attach(node_); node_->create_publisher<std_msgs::msg::String>("a", 1);'
    source = HELPER.replace("library::attach(node_);", makes) + "\nint main() {}"
    files = {"CMakeLists.txt": "add_executable(driver src/driver.cpp)\n", "src/driver.cpp": source}
    assert unread(learned(files).document["fragments"]["Helper"]) == ["what `library::attach` creates"]
