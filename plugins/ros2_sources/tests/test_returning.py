"""What a function sets before it returns early: each way out of it counts."""

from __future__ import annotations

import pytest

PUB = "create_publisher<std_msgs::msg::String>"


def names(found):
    return {name for name, each in found.get("publishes", {}).items() if "unknown" not in each}


@pytest.mark.parametrize(
    "body",
    [
        pytest.param('if (read()) { t_ = "b"; return; } other();', id="set before a return"),
        pytest.param('if (!read()) { return; } t_ = "b";', id="set behind a return"),
        pytest.param('if (read()) { t_ = "b"; return; } t_ = "c";', id="set before and behind"),
        pytest.param('switch (read()) { case 1: t_ = "b"; return; default: break; }', id="a case that returns"),
        pytest.param('if (read()) { if (more()) { t_ = "b"; return; } } other();', id="two decisions"),
        pytest.param('if (read()) { t_ = "b"; return; } else { return; }', id="both sides return"),
        pytest.param('for (int i = 0; i < 2; i++) { if (read(i)) { t_ = "b"; return; } }', id="in a loop that is followed"),
        pytest.param("while (true) { if (read()) { set(); return; } }", id="in a loop that is not followed"),
        pytest.param('auto inner = [this]() { if (read()) { t_ = "b"; return; } }; inner();', id="in a lambda"),
        pytest.param("if (read()) { set(); return; } other();", id="set in a call"),
    ],
)  # fmt: skip
def test_a_value_that_only_some_ways_out_set(cpp, body):
    found = cpp(
        f't_ = "a"; choose(); {PUB}(t_, 1);',
        f'std::string t_; void set() {{ t_ = "b"; }} void choose() {{ {body} }}',
    )
    assert not names(found)
    assert len(found["publishes"]) == 1


@pytest.mark.parametrize(
    ("body", "name"),
    [
        ('if (read()) { t_ = "b"; return; } t_ = "b";', "b"),
        ("if (read()) { log(); return; } other();", "a"),
        ('if (read()) { t_ = "b"; return; } else { throw 1; }', "b"),
        ('if (read()) { t_ = "b"; throw 1; } other();', "a"),
        ('for (int i = 0; i < 2; i++) { if (i == 1) { t_ = "b"; return; } } t_ = "c";', "b"),
        ('for (int i = 0; i < 2; i++) { if (i == 1) { t_ = "b"; break; } } t_ = "c";', "c"),
    ],
)
def test_a_value_that_all_ways_out_leave(cpp, body, name):
    found = cpp(f't_ = "a"; choose(); {PUB}(t_, 1);', f"std::string t_; void choose() {{ {body} }}")
    assert names(found) == {name}


def test_a_parameter_decides_about_the_way_out(cpp):
    body = 'if (declare_parameter("x", true)) { t_ = "b"; return true; } t_ = "c"; return false;'
    found = cpp(f't_ = "a"; choose(); {PUB}(t_, 1);', f"std::string t_; bool choose() {{ {body} }}")["publishes"]
    assert {name: each["when"] for name, each in found.items()} == {"b": {"x": "true"}, "c": {"x": {"not": "true"}}}


def test_a_constructor_that_returns_early(cpp):
    part = 'struct Part { Part() { if (read()) { t_ = "b"; return; } t_ = "a"; } std::string t_; };'
    found = cpp(f"Part part; {PUB}(part.t_, 1);", before=part)
    assert not names(found)


def test_what_is_handed_back_by_reference(cpp):
    found = cpp(
        f'std::string t = "a"; choose(t); {PUB}(t, 1);',
        'void choose(std::string & t) { if (read()) { t = "b"; return; } t = "c"; }',
    )
    assert not names(found)


@pytest.mark.parametrize(
    ("body", "entry"),
    [
        ('if (x) { if (y) { return; } } PUB("a", 1);', "perhaps"),
        ('if (x) { return; } PUB("a", 1);', {"x": {"not": "true"}}),
        ('for (const std::string & t : {"b", "c"}) { if (x) { return; } use(t); } PUB("a", 1);', {"x": {"not": "true"}}),
    ],
)  # fmt: skip
def test_an_endpoint_behind_a_return_that_parameters_decide(cpp, body, entry):
    declared = 'bool x = declare_parameter("x", false); bool y = declare_parameter("y", false); '
    found = cpp(declared + body.replace("PUB", PUB))["publishes"]["a"]
    assert "perhaps" in found if entry == "perhaps" else found["when"] == entry


CHOOSE = """
    def choose(self):
        if read():
            self.topic = 'b'
            return True
        return False
"""


def test_a_method_of_python_that_returns_early(python):
    found = python("self.topic = 'a'\nself.choose()\nself.create_publisher(String, self.topic, 1)", CHOOSE)
    assert not names(found)
    assert len(found["publishes"]) == 1


@pytest.mark.parametrize(
    ("body", "members", "expected"),
    [
        ("choose();", f'void choose() {{ if (read()) {{ return; }} {PUB}(t_ + "/b", 1); }}', {"a", "a/b"}),
        ('if (declare_parameter("x", true)) { t_ = "b"; }', "", {"a", "b"}),
        ('if (read()) { t_ = "b"; }', "", set()),
        ('if (read()) { t_ = "a"; }', "", {"a"}),
    ],
)
def test_a_value_that_the_class_gives_and_nothing_asked_for_before(cpp, body, members, expected):
    assert names(cpp(f"{body} {PUB}(t_, 1);", f'std::string t_ = "a"; {members}')) == expected
