"""What is copied and what is shared: structures of C++ are values, what pointers and references mean is one object."""

from __future__ import annotations

import pytest

PUB = "create_publisher<std_msgs::msg::String>"
CONFIG = 'struct Inner { std::string s = "i"; };\nstruct Config { std::string t = "a"; Inner inner; };'


def names(found):
    return {name for name, each in found.get("publishes", {}).items() if "unknown" not in each}


@pytest.mark.parametrize(
    ("body", "members", "expected"),
    [
        pytest.param(f'Config one; Config two = one; two.t = "b"; {PUB}(one.t, 1);', "", {"a"}, id="a copy"),
        pytest.param(f'Config one; Config two = one; two.inner.s = "j"; {PUB}(one.inner.s, 1);', "", {"i"}, id="a copy of what is inside"),
        pytest.param(f'Config one; Config & two = one; two.t = "b"; {PUB}(one.t, 1);', "", {"b"}, id="a reference"),
        pytest.param(f'Config one; Config * two = &one; two->t = "b"; {PUB}(one.t, 1);', "", {"b"}, id="a pointer"),
        pytest.param(f"Config one; change(one); {PUB}(one.t, 1);", 'void change(Config c) { c.t = "b"; }', {"a"}, id="handed on as a copy"),
        pytest.param(f"Config one; change(one); {PUB}(one.t, 1);", 'void change(Config & c) { c.t = "b"; }', {"b"}, id="handed on by reference"),
        pytest.param(f"Config one; change(&one); {PUB}(one.t, 1);", 'void change(Config * c) { c->t = "b"; }', {"b"}, id="handed on by pointer"),
        pytest.param(f'Config c = make(); Config d = make(); d.t = "b"; {PUB}(c.t, 1);', "Config base_; Config make() { return base_; }", {"a"}, id="returned"),
        pytest.param(f'two_ = one_; two_.t = "b"; {PUB}(one_.t, 1);', "Config one_; Config two_;", {"a"}, id="members"),
        pytest.param(f'Config two; two = one_; two.t = "b"; {PUB}(one_.t, 1);', "Config one_;", {"a"}, id="set later"),
        pytest.param(f'std::vector<Config> all; Config c; all.push_back(c); c.t = "b"; all.push_back(c); for (auto & e : all) {{ {PUB}(e.t, 1); }}', "", {"a", "b"}, id="elements of a list"),
        pytest.param(f'auto p = std::make_shared<Config>(); auto q = p; q->t = "b"; {PUB}(p->t, 1);', "", {"b"}, id="a shared pointer"),
        pytest.param(f'std::shared_ptr<Config> p = p_; p->t = "b"; {PUB}(p_->t, 1);', "std::shared_ptr<Config> p_ = std::make_shared<Config>();", {"b"}, id="a shared pointer with its type"),
    ],
)  # fmt: skip
def test_structures(cpp, body, members, expected):
    assert names(cpp(body, members, CONFIG)) == expected


@pytest.mark.parametrize(
    "body",
    [
        pytest.param('std::vector<std::string> all = {"a"}; for (auto & e : all) { e = "b"; }', id="elements by reference"),
        pytest.param('std::vector<std::string> all = {"a"}; for (auto & e : all) { e.append("b"); }', id="changed elements"),
        pytest.param('std::vector<std::string> all = {"a"}; all.at(0) = "b";', id="what a call returns"),
        pytest.param('std::vector<std::string> all = {"a"}; all.front() = "b";', id="the first"),
        pytest.param('std::vector<std::string> all = {"a"}; std::tie(all, ok_) = pick();', id="a tuple"),
        pytest.param('std::string t = "a"; std::cin >> t; std::vector<std::string> all = {t};', id="a stream"),
    ],
)  # fmt: skip
def test_what_changes_a_list_or_text(cpp, body):
    found = cpp(f"{body} for (const auto & t : all) {{ {PUB}(t, 1); }}", "bool ok_ = false;")
    assert found["publishes"]
    assert not names(found)


def test_elements_by_constant_reference(cpp):
    assert names(
        cpp(f'std::vector<std::string> all = {{"a"}}; for (const auto & e : all) {{ std::cout << e; {PUB}(e, 1); }}')
    ) == {"a"}


@pytest.mark.parametrize(
    ("body", "expected"),
    [("load(topics)", set()), ("print(topics)", {"a"}), ("len(topics)", {"a"}), ("sorted(topics)", {"a"})],
)
def test_a_list_that_a_function_of_python_is_handed(python, body, expected):
    made = f"topics = ['a']\n{body}\nfor topic in topics:\n    self.create_publisher(String, topic, 1)"
    assert names(python(made)) == expected


@pytest.mark.parametrize(
    ("body", "members", "expected"),
    [
        pytest.param(f'std::string t = "a"; auto f = [this, t]() {{ {PUB}(t, 1); }}; t = "b"; f();', "", {"a"}, id="by value"),
        pytest.param(f'std::string t = "a"; auto f = [=]() {{ {PUB}(t, 1); }}; t = "b"; f();', "", {"a"}, id="all by value"),
        pytest.param(f'std::string t = "a"; auto f = [&]() {{ {PUB}(t, 1); }}; t = "b"; f();', "", {"b"}, id="all by reference"),
        pytest.param(f'std::string t = "a", u = "c"; auto f = [&, u]() {{ {PUB}(t + u, 1); }}; t = "b"; u = "d"; f();', "", {"bc"}, id="all but one by reference"),
        pytest.param(f'std::string t = "a"; auto f = [=, &t]() {{ {PUB}(t, 1); }}; t = "b"; f();', "", {"b"}, id="all but one by value"),
        pytest.param(f'std::string t = "a"; auto f = [this, u = t + "/x"]() {{ {PUB}(u, 1); }}; t = "b"; f();', "", {"a/x"}, id="with a value of its own"),
        pytest.param(f'std::string t = "a"; auto f = [t]() mutable {{ t = "b"; }}; f(); {PUB}(t, 1);', "", {"a"}, id="its own copy is changed"),
        pytest.param(f'std::string t = "a"; auto f = [&t]() {{ t = "b"; }}; f(); {PUB}(t, 1);', "", {"b"}, id="what is referred to is changed"),
        pytest.param(f'std::string t = "a"; int n = 1; later([&t, n]() {{ t = "b"; }}); {PUB}(t, 1);', "", set(), id="what is referred to may be changed later"),
        pytest.param(f'std::string t = "a"; later([t]() mutable {{ t = "b"; }}); {PUB}(t, 1);', "", {"a"}, id="its own copy may be changed later"),
        pytest.param(f'for (const std::string & t : {{std::string("a"), std::string("b")}}) {{ create_wall_timer(1s, [this, t]() {{ {PUB}(t, 1); }}); }}', "", {"a", "b"}, id="callbacks of a loop"),
        pytest.param('start("a"); start("b");', f"void start(const std::string & t) {{ create_wall_timer(1s, [this, t]() {{ {PUB}(t, 1); }}); }}", {"a", "b"}, id="callbacks of a method"),
        pytest.param('start("a");', f"void start(const std::string & t) {{ create_wall_timer(1s, [this, t]() {{ {PUB}(t, 1); start(t); }}); }}", {"a"}, id="a callback that starts itself again"),
    ],
)  # fmt: skip
def test_what_lambdas_hold(cpp, body, members, expected):
    assert names(cpp(body, members)) == expected
