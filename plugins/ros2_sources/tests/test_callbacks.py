"""What callbacks set: a value that one of them may change is not known in any of them."""

from __future__ import annotations

import pytest

PUB = "create_publisher<std_msgs::msg::String>"
TAKES = "const std_msgs::msg::String &"


def names(found):
    return {name for name, each in found.get("publishes", {}).items() if "unknown" not in each}


def timer(method):
    return f"create_wall_timer(1s, std::bind(&Driver::{method}, this));"


MAKE = f"void make() {{ {PUB}(t_, 1); }}"
METHODS = ["tick", "on_error", "on_shutdown", "on_cleanup", "on_deactivate", "on_configure", "on_activate"]


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("first", ["make", "method"])
def test_a_callback_that_sets_a_member(cpp, method, first):
    order = timer("make") + timer(method) if first == "make" else timer(method) + timer("make")
    found = cpp(order, f'std::string t_ = "a"; {MAKE} void {method}() {{ t_ = "b"; }}')
    assert not names(found)
    assert len(found["publishes"]) == 1


@pytest.mark.parametrize("method", METHODS)
def test_a_callback_of_python_that_sets_a_member(python, method):
    found = python(
        f"self.t = 'a'\nself.create_timer(1.0, self.make)\nself.create_timer(1.0, self.{method})",
        f"    def make(self):\n        self.create_publisher(String, self.t, 1)\n    def {method}(self):\n        self.t = 'b'\n",
    )
    assert not names(found)
    assert len(found["publishes"]) == 1


@pytest.mark.parametrize(
    ("body", "members"),
    [
        pytest.param(f'update(); t_ = "a"; {timer("update")} {timer("make")}', 'void update() { t_ = "b"; }', id="called at the start, too"),
        pytest.param(f'choose(true); create_subscription<std_msgs::msg::Bool>("in", 1, std::bind(&Driver::choose, this, _1)); {timer("make")}', 'void choose(bool on) { t_ = on ? "a" : "b"; }', id="called at the start with one value"),
        pytest.param(f'choose("a"); {timer("make")} {timer("tick")}', 'void tick() { choose("b"); } void choose(const std::string & t) { t_ = t; }', id="called by a callback"),
        pytest.param(f'{timer("make")} {timer("tick")} choose("a");', "void tick() { choose(next()); } void choose(const std::string & t) { t_ = t; }", id="called by a callback with what is not known"),
        pytest.param(f't_ = read(); {timer("tick")} {timer("make")}', 'void tick() { t_ = "b"; }', id="not known before"),
        pytest.param(f't_ = "a"; {timer("make")} {timer("one")} {timer("two")}', 'std::string s_ = "a"; void one() { s_ = "b"; } void two() { t_ = s_; }', id="over another member"),
    ],
)  # fmt: skip
def test_a_member_that_callbacks_change(cpp, body, members):
    found = cpp(body, f"std::string t_; {members} {MAKE}")
    assert not names(found)
    assert len(found["publishes"]) == 1


def test_a_callback_that_counts_and_is_called_at_the_start(cpp):
    found = cpp(
        f"update(); {timer('update')}",
        f'int n_ = 0; void update() {{ n_ = n_ + 1; {PUB}("m" + std::to_string(n_), 1); }}',
    )
    assert set(found["publishes"]) == {"m1", "(unknown 1)"}


@pytest.mark.parametrize(
    ("body", "members", "expected"),
    [
        pytest.param(f"{timer('begin')}", f'std::string t_; void begin() {{ t_ = "b"; {PUB}(t_, 1); }}', {"b"}, id="one callback sets and uses it"),
        pytest.param(f't_ = "a"; {timer("make")} {timer("same")}', f'std::string t_; {MAKE} void same() {{ t_ = "a"; }}', {"a"}, id="set to the same value"),
        pytest.param(f't_ = "a"; {timer("make")}', f'std::string t_; {MAKE} void helper() {{ other_ = "b"; }} std::string other_;', {"a"}, id="another member"),
        pytest.param(f'choose("a"); {timer("make")}', f"std::string t_; {MAKE} void choose(const std::string & t) {{ t_ = t; }}", {"a"}, id="set at the start only"),
    ],
)  # fmt: skip
def test_a_member_that_no_callback_changes(cpp, body, members, expected):
    assert names(cpp(body, members)) == expected


def test_what_a_callback_sets_before_the_program_goes_on(learned, parser):
    source = f"""
class Driver : public rclcpp::Node {{
public:
  Driver() : Node("driver") {{ choose("a"); {timer("tick")} }}
  void tick() {{ choose("b"); }}
  void choose(const std::string & t) {{ t_ = t; }}
  {MAKE}
  std::string t_;
}};
int main() {{ auto d = std::make_shared<Driver>(); rclcpp::spin_some(d); d->make(); }}
"""
    cmake = "project(bot)\nadd_executable(driver src/driver.cpp)\n"
    found = learned({"CMakeLists.txt": cmake, "src/driver.cpp": source}).document["nodes"]["driver"]
    assert not names(found)


LIFE_CYCLE = """
class Driver : public rclcpp_lifecycle::LifecycleNode {
public:
  explicit Driver(const rclcpp::NodeOptions & o) : rclcpp_lifecycle::LifecycleNode("driver", o) {}
  CallbackReturn on_configure(const rclcpp_lifecycle::State &) {
    t_ = "a";
    if (!done_) { create_publisher<std_msgs::msg::String>(t_, 1); }
    TIMER
    return CallbackReturn::SUCCESS;
  }
  CallbackReturn on_cleanup(const rclcpp_lifecycle::State &) { t_ = ""; done_ = true; return CallbackReturn::SUCCESS; }
  void make() { create_publisher<std_msgs::msg::String>(t_ + "/later", 1); }
  std::string t_;
  bool done_ = false;
};
RCLCPP_COMPONENTS_REGISTER_NODE(Driver)
"""


def test_what_the_end_of_a_life_cycle_sets(learned, parser):
    """The start of a node does not see it, a callback may."""
    files = {"CMakeLists.txt": "project(bot)\n", "src/driver.cpp": LIFE_CYCLE.replace("TIMER", timer("make"))}
    found = learned(files).document["nodes"]["Driver"]["publishes"]
    assert set(found) == {"a", "(unknown 1)"}
    assert "perhaps" not in found["a"]
