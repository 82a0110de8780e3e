"""What sets a value in other ways than by an assignment that stands alone: exceptions, expressions, references, macros."""

from __future__ import annotations

import pytest

PUB = "create_publisher<std_msgs::msg::String>"


def names(found):
    return {name for name, each in found.get("publishes", {}).items() if "unknown" not in each}


@pytest.mark.parametrize(
    ("body", "members", "expected"),
    [
        pytest.param('try { load(); t_ = "b"; } catch (const std::exception & e) { warn(); }', "", set(), id="an exception before it"),
        pytest.param('try { load(); t_ = "b"; } catch (const std::exception & e) { throw; }', "", {"b"}, id="an exception that is passed on"),
        pytest.param('try { load(); t_ = "b"; } catch (const std::exception & e) { t_ = "b"; }', "", {"b"}, id="the same in both"),
        pytest.param("try { load(); } catch (const std::exception & e) { warn(); }", "", {"a"}, id="nothing is set"),
        pytest.param("try { choose(); } catch (...) {}", 'void choose() { if (read()) { t_ = "b"; throw 1; } }', set(), id="set before it is thrown"),
        pytest.param("try { try { choose(); } catch (int) { throw; } } catch (...) {}", 'void choose() { if (read()) { t_ = "b"; throw 1; } }', set(), id="thrown again"),
        pytest.param('if ((t_ = pick()) != "") { go(); }', 'std::string pick() { return "b"; }', {"b"}, id="in a condition"),
        pytest.param('ok() ? t_ = "b" : t_ = "c";', "", set(), id="in one of two"),
        pytest.param('std::string s; t_ = s = "b";', "", {"b"}, id="in an assignment"),
        pytest.param('t_ += t_ = "b";', "", {"bb"}, id="in its own assignment"),
        pytest.param('std::string & r = t_; r = "b";', "", {"b"}, id="over a reference"),
        pytest.param('auto & r = t_; r += "b";', "", {"ab"}, id="over a reference without a type"),
        pytest.param('std::string * r = &t_; *r = "b";', "", set(), id="over a pointer"),
        pytest.param("const std::string & r = t_; use(r);", "", {"a"}, id="over a constant reference"),
        pytest.param('std::string r = t_; r = "b";', "", {"a"}, id="over a copy"),
    ],
)  # fmt: skip
def test_ways_to_set_a_member(cpp, body, members, expected):
    found = cpp(f't_ = "a"; {body} {PUB}(t_, 1);', f"std::string t_; {members}")
    assert names(found) == expected
    assert len(found["publishes"]) == 1


@pytest.mark.parametrize(
    "body",
    ["use(n++);", "use(++n);", "while (n++ < 3) { log(); }", "for (int i = 0; i < 3; i++, n++) { log(); }"],
)
def test_a_number_that_an_expression_changes(cpp, body):
    assert not names(cpp(f'int n = 0; {body} {PUB}("m" + std::to_string(n), 1);'))


@pytest.mark.parametrize(
    ("body", "expected"),
    [
        pytest.param("def set_it():\n    nonlocal t\n    t = 'b'\nset_it()", set(), id="nonlocal"),
        pytest.param("match read():\n    case 1:\n        t = 'b'", set(), id="match"),
        pytest.param("match read():\n    case 1:\n        t = 'b'\n    case _:\n        t = 'b'", {"b"}, id="all cases"),
        pytest.param("match read():\n    case [t, _]:\n        pass", set(), id="a case binds it"),
        pytest.param("for x in read():\n    pass\nelse:\n    t = 'b'", set(), id="the end of a loop"),
        pytest.param("try:\n    load()\n    t = 'b'\nexcept Exception:\n    pass", set(), id="an exception before it"),
        pytest.param("try:\n    load()\n    t = 'b'\nexcept Exception:\n    return", {"b"}, id="an exception that ends it"),
        pytest.param("try:\n    load()\nfinally:\n    t = 'b'", {"b"}, id="finally"),
        pytest.param("if t := read():\n    pass", set(), id="in a condition"),
        pytest.param("self.u = 'a'\nsetattr(self, 'u', 'b')\nt = self.u", {"b"}, id="setattr"),
        pytest.param("self.u = 'a'\nsetattr(self, read(), 'b')\nt = self.u", set(), id="setattr with any name"),
        pytest.param("try:\n    load()\n    self.u = 'b'\nexcept Exception:\n    pass\nt = self.u", {"b"}, id="not set before"),
    ],
)  # fmt: skip
def test_ways_to_set_a_name_in_python(python, body, expected):
    assert names(python(f"t = 'a'\n{body}\nself.create_publisher(String, t, 1)")) == expected


def test_a_list_that_has_two_names(python):
    body = "one = ['a']\nother = one\nother.append('b')\nfor t in one:\n    self.create_publisher(String, t, 1)"
    assert names(python(body)) == {"a", "b"}


def test_what_a_macro_makes_stands_where_it_is_used(cpp):
    macros = f"#include <string>\n#define ADVERTISE(TYPE, TOPIC) {PUB.replace('std_msgs::msg::String', 'TYPE')}(TOPIC, 1)\n#define LATER(TOPIC) ADVERTISE(std_msgs::msg::String, TOPIC)\n"
    found = cpp('a_ = ADVERTISE(std_msgs::msg::Empty, "a");\nb_ = LATER("b");', "", macros)
    assert {name: (each["type"], each["at"]) for name, each in found["publishes"].items()} == {
        "a": ("std_msgs/msg/Empty", "src/driver.cpp:8"),
        "b": ("std_msgs/msg/String", "src/driver.cpp:9"),
    }
    assert "unread" not in found


def test_a_macro_that_nothing_uses_stands_where_it_is(learned, parser):
    source = "#include <string>\n\n#define ADVERTISE(TOPIC) node->create_publisher<std_msgs::msg::String>(TOPIC, 1)\nint main() {}\n"
    found = learned({"CMakeLists.txt": "add_executable(driver src/driver.cpp)\n", "src/driver.cpp": source})
    assert "src/driver.cpp:3" in str(found.document) + str(found.gaps)


@pytest.mark.parametrize(("otherwise", "expected"), [("", set()), ('cfg_.topic = "b";', {"b"})])
def test_a_structure_that_a_branch_changes_first_began_before_it(cpp, otherwise, expected):
    """A walk makes a member that is a structure when something asks for it: what one branch sets is not set in the other."""
    body = f'if (rclcpp::ok()) {{ cfg_.topic = "b"; }} else {{ {otherwise} }} {PUB}(cfg_.topic, 1);'
    assert names(cpp(body, 'struct Cfg { std::string topic = "a"; }; Cfg cfg_;')) == expected


def test_a_constant_of_the_class_that_a_branch_uses_first(cpp):
    """A walk reads a constant that is defined outside of its class when something asks for it: a branch changes nothing of it."""
    body = f'if (read()) {{ {PUB}("a", kLatched); }} {PUB}("b", kLatched);'
    found = cpp(
        body, "static const rclcpp::QoS kLatched;", "const rclcpp::QoS Driver::kLatched{rclcpp::QoS(3).reliable()};"
    )
    assert found["publishes"]["b"]["qos"] == found["publishes"]["a"]["qos"] == {"depth": 3, "reliability": "reliable"}
