"""Which policies `qos_overrides` may set: options are followed like other values; what is not followed is named as not known."""

from __future__ import annotations

import pytest

PUB = "create_publisher<std_msgs::msg::String>"
SUB = "create_subscription<std_msgs::msg::String>"
ALL = "rclcpp::QosOverridingOptions::with_default_policies()"
SET = f".qos_overriding_options = {ALL};"
DEFAULT = ["history", "depth", "reliability"]
MAKER = f"rclcpp::PublisherOptions make(bool on) {{ rclcpp::PublisherOptions o; if (on) {{ o{SET} }} return o; }}"
MAKES_ALL = f"rclcpp::PublisherOptions make() {{ rclcpp::PublisherOptions o; o{SET} return o; }}"


@pytest.mark.parametrize(
    ("body", "members", "before", "policies"),
    [
        (f'options_{SET} {PUB}("a", 1, options_);', "rclcpp::PublisherOptions options_;", "", DEFAULT),
        (f'this->options_{SET} {PUB}("a", 1, this->options_);', "rclcpp::PublisherOptionsWithAllocator<std::allocator<void>> options_;", "", DEFAULT),
        (f'auto o = make(); {PUB}("a", 1, o);', "", MAKES_ALL, DEFAULT),
        (f'{PUB}("a", 1, make());', MAKES_ALL, "", DEFAULT),
        (f'rclcpp::PublisherOptions o; o{SET} helper("a", o);', f"void helper(const std::string & t, const rclcpp::PublisherOptions & o) {{ {PUB}(t, 1, o); }}", "", DEFAULT),
        (f'rclcpp::PublisherOptions o; fill(o); {PUB}("a", 1, o);', f"void fill(rclcpp::PublisherOptions & o) {{ o{SET} }}", "", DEFAULT),
        (f'rclcpp::PublisherOptions o; o{SET} auto p = o; p.qos_overriding_options = {{}}; {PUB}("a", 1, o);', "", "", DEFAULT),
        (f'rclcpp::PublisherOptions o; auto p = o; p{SET} {PUB}("a", 1, o);', "", "", None),
        (f'rclcpp::PublisherOptions o; copy(o); {PUB}("a", 1, o);', f"void copy(rclcpp::PublisherOptions o) {{ o{SET} }}", "", None),
        (f'rclcpp::PublisherOptions o; o.qos_overriding_options = {{rclcpp::QosPolicyKind::Depth, rclcpp::QosPolicyKind::LivelinessLeaseDuration}}; {PUB}("a", 1, o);', "", "", ["depth", "liveliness_lease_duration"]),
        (f'rclcpp::PublisherOptions o; o.qos_overriding_options = rclcpp::QosOverridingOptions{{rclcpp::QosPolicyKind::Durability}}; {PUB}("a", 1, o);', "", "", ["durability"]),
        (f'rclcpp::PublisherOptions o; o.qos_overriding_options = rclcpp::QosOverridingOptions({{rclcpp::QosPolicyKind::Durability}}, [](const rclcpp::QoS &) {{ return check(); }}); {PUB}("a", 1, o);', "", "", ["durability"]),
        (f'{PUB}("a", 1, rclcpp::PublisherOptions());', "", "", None),
        (f'{PUB}("a", 1, {{}});', "", "", None),
        (f'{PUB}("a", 1, options_);', "rclcpp::PublisherOptions options_;", "", None),
    ],
)  # fmt: skip
def test_options_are_followed(cpp, body, members, before, policies):
    entry = cpp(body, members, before)["publishes"]["a"]
    assert entry.get("overridable") == policies
    assert "overridable_unknown" not in entry


def test_options_of_a_subscription(cpp):
    members = f'rclcpp::SubscriptionOptions options_; void on(const std_msgs::msg::String &) {{}} void make() {{ {SUB}("a", 1, [this](const std_msgs::msg::String & m) {{ on(m); }}, options_); }}'
    assert cpp(f"options_{SET} make();", members)["subscribes"]["a"]["overridable"] == DEFAULT


@pytest.mark.parametrize(
    ("body", "members", "before", "cause"),
    [
        (f'{PUB}("a", 1, library::options());', "", "", "`options` is not followed"),
        (f'{PUB}("a", 1, make(rclcpp::ok()));', "", MAKER, "condition in line"),
        (f'rclcpp::PublisherOptions o; if (rclcpp::ok()) {{ o{SET} }} {PUB}("a", 1, o);', "", "", "condition in line"),
        (f'rclcpp::PublisherOptions o; library_sets(o); {PUB}("a", 1, o);', "", "", "`library_sets` may change it"),
        (f'rclcpp::PublisherOptions o; o.qos_overriding_options = library::overriding(); {PUB}("a", 1, o);', "", "", "`overriding` is not followed"),
        (f'rclcpp::PublisherOptions o; o.qos_overriding_options = rclcpp::QosOverridingOptions::with_default_policies(nullptr, "front"); {PUB}("a", 1, o);', "", "", "id"),
        (f'if (declare_parameter("on", true)) {{ options_{SET} }} {PUB}("a", 1, options_);', "rclcpp::PublisherOptions options_;", "", "condition in line"),
        (f'rclcpp::PublisherOptions o; {PUB}("a", 1); o{SET} {PUB}("a", 1, o);', "", "", "several places"),
        ("timer_ = create_wall_timer(std::chrono::seconds(1), [this]() { tick(); });", f'rclcpp::PublisherOptions options_; void open() {{ options_{SET} }} void tick() {{ {PUB}("a", 1, options_); }}', "", "`options_.qos_overriding_options` is also set in `open`"),
    ],
)  # fmt: skip
def test_options_that_are_not_followed_are_named(cpp, body, members, before, cause):
    entry = cpp(body, members, before)["publishes"]["a"]
    assert "overridable" not in entry
    assert cause in entry["overridable_unknown"]


PYTHON = "from rclpy.qos_overriding_options import QoSOverridingOptions\nfrom rclpy.qos import QoSPolicyKind\n"


@pytest.mark.parametrize(
    ("body", "policies", "cause"),
    [
        ("o = QoSOverridingOptions.with_default_policies()\nself.create_publisher(String, 'a', 1, qos_overriding_options=o)", DEFAULT, ""),
        ("self.o = QoSOverridingOptions.with_default_policies()\nself.create_publisher(String, 'a', 1, qos_overriding_options=self.o)", DEFAULT, ""),
        ("self.o = QoSOverridingOptions((QoSPolicyKind.DEPTH, QoSPolicyKind.DEADLINE))\nself.create_publisher(String, 'a', 1, qos_overriding_options=self.o)", ["depth", "deadline"], ""),
        ("self.create_publisher(String, 'a', 1, qos_overriding_options=None)", None, ""),
        ("self.create_publisher(String, 'a', 1, qos_overriding_options=self.options())", DEFAULT, ""),
        ("self.create_publisher(String, 'a', 1, qos_overriding_options=unknown())", None, "`unknown` is not followed"),
        ("o = None\nif unknown():\n    o = QoSOverridingOptions.with_default_policies()\nself.create_publisher(String, 'a', 1, qos_overriding_options=o)", None, "condition in line"),
        ("self.create_publisher(String, 'a', 1, qos_overriding_options=QoSOverridingOptions.with_default_policies(entity_id='x'))", None, "id"),
        ("rest = unknown()\nself.create_publisher(String, 'a', 1, **rest)", None, "rest of the arguments"),
    ],
)  # fmt: skip
def test_options_in_python(python, body, policies, cause):
    methods = "    def options(self):\n        return QoSOverridingOptions.with_default_policies()\n"
    entry = python(body, methods, PYTHON)["publishes"]["a"]
    assert entry.get("overridable") == policies
    assert cause in entry.get("overridable_unknown", "")
    assert bool(cause) is ("overridable_unknown" in entry)
