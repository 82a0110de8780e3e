"""What callbacks set while a program goes on: whatever lets them come, a call or a function that is handed to a thread."""

from __future__ import annotations

import pytest

SETUP = "from setuptools import setup\nsetup(entry_points={'console_scripts': ['driver = bot.driver:main']})\n"
OPEN = ["it is an element of a list that is not known"]
IN_CPP = """
#include "rclcpp/rclcpp.hpp"
class Driver : public rclcpp::Node {
public:
  Driver() : Node("driver") {
    taken_ = create_subscription<std_msgs::msg::String>("in", 1, std::bind(&Driver::take, this, std::placeholders::_1));
  }
  void make() { for (const auto & topic : topics_) { create_publisher<std_msgs::msg::String>(topic, 1); } }
  void take(const std_msgs::msg::String & message) { topics_.push_back(message.data); }
  void turn() { turn_on(); }
  void turn_on() { while (rclcpp::ok()) { rclcpp::spin_some(shared_from_this()); } }
  void beep() { std::cout << "beep"; }
  std::vector<std::string> topics_ = {"a"};
};
struct Other { void beep() { rclcpp::spin(node_); } };
struct Turner { void operator()() { executor_.spin(); } rclcpp::executors::SingleThreadedExecutor executor_; };
void in_background(rclcpp::executors::SingleThreadedExecutor & executor) { executor.spin(); }
int main(int argc, char ** argv) {
  rclcpp::init(argc, argv);
  auto driver = std::make_shared<Driver>();
  rclcpp::executors::SingleThreadedExecutor executor;
  executor.add_node(driver);
  SPINS
  driver->make();
}
"""
IN_PYTHON = """import asyncio, rclpy, threading
from functools import partial
from rclpy import spin
from rclpy.executors import SingleThreadedExecutor
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

    def turn(self):
        self.turn_on()

    def turn_on(self):
        rclpy.spin(self)

    def beep(self):
        print('beep')

class Turner(threading.Thread):
    def run(self):
        rclpy.spin(self.node)

def turn_it(node):
    rclpy.spin(node)

def main():
    rclpy.init()
    driver = Driver()
    executor = SingleThreadedExecutor()
    executor.add_node(driver)
    SPINS
    driver.make()
"""


def made(document):
    return [each.get("unknown", name) for name, each in document["nodes"]["driver"]["publishes"].items()]


@pytest.fixture
def in_cpp(learned, parser):
    """Return the function that learns what a program in C++ publishes that calls something before it makes publishers."""
    cmake = "project(bot)\nadd_executable(driver src/driver.cpp)\n"
    return lambda calls: made(
        learned({"CMakeLists.txt": cmake, "src/driver.cpp": IN_CPP.replace("SPINS", calls)}).document
    )


@pytest.fixture
def in_python(learned):
    """Return the function that learns what a program in Python publishes that calls something before it makes publishers."""
    return lambda calls: made(
        learned(
            {"setup.py": SETUP, "bot/driver.py": IN_PYTHON.replace("SPINS", calls.replace("\n", "\n    "))}
        ).document
    )


@pytest.mark.parametrize(
    "spins",
    [
        "executor.spin_some();",
        "std::thread thread([&] { executor.spin(); });",
        "std::thread thread{[&]() { executor.spin(); }};",
        "std::jthread thread([&] { executor.spin(); });",
        "auto done = std::async(std::launch::async, [&] { executor.spin(); });",
        "auto turn = [&] { executor.spin(); }; std::thread thread(turn);",
        "auto turn = [&] { executor.spin(); }; std::thread thread(std::ref(turn));",
        "auto thread = std::make_unique<std::thread>([&] { executor.spin(); });",
        "std::vector<std::thread> all; all.emplace_back([&] { executor.spin(); });",
        "std::thread thread(&Driver::turn, driver);",
        "std::thread thread([driver] { driver->turn(); });",
        "std::thread thread(std::bind(&Driver::turn, driver));",
        "std::thread thread(&rclcpp::executors::SingleThreadedExecutor::spin, &executor);",
        "std::thread thread(std::bind(&rclcpp::executors::SingleThreadedExecutor::spin, &executor));",
        "std::thread thread(in_background, std::ref(executor));",
        "std::thread thread([&] { in_background(executor); });",
        "std::thread thread([&] { std::thread inner([&] { executor.spin(); }); inner.join(); });",
        "std::function<void()> turn = [&] { executor.spin(); }; pool.post(turn);",
        "std::thread thread(Turner{});",
    ],
)
def test_a_program_in_cpp_that_lets_callbacks_come(in_cpp, spins):
    assert in_cpp(spins) == OPEN


@pytest.mark.parametrize(
    "calls",
    [
        "",
        "std::thread thread([&] { read(); });",
        "std::thread thread(&Driver::beep, driver);",
        "std::thread thread([driver] { driver->beep(); });",
        "auto timer = driver->create_wall_timer(1s, [&] { executor.spin_some(); });",
        "auto turn = [&] { executor.spin(); };",
    ],
)
def test_a_program_in_cpp_that_lets_no_callback_come(in_cpp, calls):
    assert in_cpp(calls) == ["a"]


@pytest.mark.parametrize(
    "spins",
    [
        "rclpy.spin_once(driver)",
        "threading.Thread(target=executor.spin, daemon=True).start()",
        "threading.Thread(None, executor.spin).start()",
        "turn = executor.spin\nthreading.Thread(target=turn).start()",
        "threading.Thread(target=spin, args=(driver,)).start()",
        "threading.Thread(target=rclpy.spin, args=(driver,)).start()",
        "threading.Thread(target=partial(rclpy.spin, driver)).start()",
        "threading.Thread(target=lambda: rclpy.spin(driver)).start()",
        "turn = lambda: rclpy.spin(driver)\nthreading.Thread(target=turn).start()",
        "def turn():\n    rclpy.spin(driver)\nthreading.Thread(target=turn).start()",
        "threading.Thread(target=turn_it, args=(driver,)).start()",
        "threading.Thread(target=lambda: turn_it(driver)).start()",
        "threading.Thread(target=driver.turn).start()",
        "threading.Thread(target=lambda: driver.turn()).start()",
        "asyncio.get_event_loop().run_in_executor(None, rclpy.spin, driver)",
        "threading.Thread(target=run_all, args=([executor.spin],)).start()",
        "threading.Thread(target=run_all, args=(driver.turn,)).start()",
        "Turner().start()",
    ],
)
def test_a_program_in_python_that_lets_callbacks_come(in_python, spins):
    assert in_python(spins) == OPEN


@pytest.mark.parametrize(
    "calls",
    [
        "pass",
        "threading.Thread(target=driver.beep).start()",
        "threading.Thread(target=lambda: driver.beep()).start()",
        "driver.create_timer(1.0, lambda: rclpy.spin_once(driver))",
        "def turn():\n    rclpy.spin(driver)",
    ],
)
def test_a_program_in_python_that_lets_no_callback_come(in_python, calls):
    assert in_python(calls) == ["a"]


def test_a_callback_that_is_named_as_a_transition(learned):
    source = IN_PYTHON.replace("take", "on_message").replace("SPINS", "rclpy.spin_once(driver)")
    assert made(learned({"setup.py": SETUP, "bot/driver.py": source}).document) == OPEN
