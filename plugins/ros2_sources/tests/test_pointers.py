"""Whether a pointer is set: a test of it holds where what set it was done, and no further."""

from __future__ import annotations

import pytest

PUB = "create_publisher<std_msgs::msg::String>"
ON = 'declare_parameter<bool>("on", false)'
MAKE = f'p_ = {PUB}("a", 1);'
THEN = f'b_ = {PUB}("b", 1);'
SET = f"if ({ON}) {{ {MAKE} }}"
MEMBER = "rclcpp::Publisher<std_msgs::msg::String>::SharedPtr p_{};"
WHEN = {"when": {"on": "true"}}
CERTAIN: dict[str, object] = {}


def decides(found):
    entry = found["publishes"]["b"]
    return {"perhaps": True} if "perhaps" in entry else {"when": entry["when"]} if "when" in entry else {}


@pytest.mark.parametrize("start", ["", "{}", "{nullptr}", " = nullptr"])
@pytest.mark.parametrize(
    ("body", "expected"),
    [
        pytest.param(f"{SET} if (p_) {{ {THEN} }}", WHEN, id="a condition"),
        pytest.param(f"{SET} if (p_ != nullptr) {{ {THEN} }}", WHEN, id="compared"),
        pytest.param(f"{SET} if (nullptr != p_) {{ {THEN} }}", WHEN, id="compared the other way round"),
        pytest.param(f"{SET} if (p_.get()) {{ {THEN} }}", WHEN, id="its pointer"),
        pytest.param(f"{SET} if (!p_) {{ return; }} {THEN}", WHEN, id="a return"),
        pytest.param(f"{SET} if (p_ == nullptr) {{ return; }} {THEN}", WHEN, id="a return, compared"),
        pytest.param(f"{SET} if (!p_) {{ {THEN} }}", {"when": {"on": {"not": "true"}}}, id="not set"),
        pytest.param(f"{SET} auto q = p_; if (q) {{ {THEN} }}", WHEN, id="a copy"),
        pytest.param(f"{SET} const bool has = p_ != nullptr; if (has) {{ {THEN} }}", WHEN, id="a flag"),
        pytest.param(f"if ({ON}) {{}} else {{ {MAKE} }} if (p_) {{ {THEN} }}", {"when": {"on": {"not": "true"}}}, id="the other branch"),
        pytest.param(f'if ({ON}) {{ if (declare_parameter<bool>("two", true)) {{ {MAKE} }} }} if (p_) {{ {THEN} }}', {"when": {"on": "true", "two": "true"}}, id="two conditions"),
        pytest.param(f'p_ = {ON} ? {PUB}("a", 1) : nullptr; if (p_) {{ {THEN} }}', WHEN, id="one of two"),
        pytest.param(f"if (read()) {{ {MAKE} }} if (p_) {{ {THEN} }}", {"perhaps": True}, id="not known"),
        pytest.param(f"for (auto x : read()) {{ {MAKE} }} if (p_) {{ {THEN} }}", {"perhaps": True}, id="a loop"),
        pytest.param(f"for (auto x : read()) {{ switch (x.id) {{ case 1: {MAKE} break; }} }} if (p_) {{ {THEN} }}", {"perhaps": True}, id="a case in a loop"),
        pytest.param(f"{SET} if (read()) {{ p_ = nullptr; }} if (p_) {{ {THEN} }}", {"perhaps": True}, id="taken back"),
        pytest.param(f"if (read()) {{ {SET} }} if (p_) {{ {THEN} }}", {"perhaps": True}, id="set in what is not known"),
        pytest.param(f"{MAKE} if (p_) {{ {THEN} }}", CERTAIN, id="set"),
        pytest.param(f"if (read()) {{ {MAKE} }} else {{ {MAKE} }} if (p_) {{ {THEN} }}", CERTAIN, id="set in both"),
        pytest.param(f"{SET} {MAKE} if (p_) {{ {THEN} }}", CERTAIN, id="set again"),
    ],
)  # fmt: skip
def test_whether_a_member_is_set(cpp, start, body, expected):
    assert decides(cpp(body, MEMBER.replace("{}", start))) == expected


@pytest.mark.parametrize(
    ("body", "members", "expected"),
    [
        pytest.param(f"make(); if (p_) {{ {THEN} }}", f"void make() {{ if (!{ON}) {{ return; }} {MAKE} }}", WHEN, id="a method that may return before"),
        pytest.param(f"p_ = make(); if (p_) {{ {THEN} }}", f'auto make() {{ if ({ON}) {{ return {PUB}("a", 1); }} return nullptr; }}', WHEN, id="a method that may return nothing"),
        pytest.param(f"p_ = make(); if (p_) {{ {THEN} }}", f'auto make() {{ if (!{ON}) {{ return nullptr; }} return {PUB}("a", 1); }}', WHEN, id="a method that returns nothing first"),
        pytest.param(f"p_ = make(); if (p_) {{ {THEN} }}", f'auto make() {{ if (read()) {{ return nullptr; }} return {PUB}("a", 1); }}', {"perhaps": True}, id="not known what it returns"),
        pytest.param(f"create_wall_timer(1s, [this]() {{ {MAKE} }}); create_wall_timer(1s, [this]() {{ if (p_) {{ {THEN} }} }});", "", {"perhaps": True}, id="a callback"),
        pytest.param(f"{SET} go(p_);", f"void go(rclcpp::PublisherBase::SharedPtr p) {{ if (p) {{ {THEN} }} }}", WHEN, id="handed over"),
        pytest.param(f"{SET} go(); if (p_) {{ {THEN} }}", "struct Cfg { int n = 1; }; Cfg cfg_; void go() { if (read()) { cfg_.n = 2; } }", WHEN, id="beside a structure"),
    ],
)  # fmt: skip
def test_whether_a_method_sets_a_member(cpp, body, members, expected):
    assert decides(cpp(body, f"{MEMBER} {members}")) == expected


@pytest.mark.parametrize(
    ("body", "expected"),
    [
        pytest.param("if self.p:\n    make()", WHEN, id="a condition"),
        pytest.param("def go(p):\n    if p:\n        make()\ngo(self.p)", WHEN, id="handed over"),
        pytest.param("if self.p is not None:\n    make()", WHEN, id="compared"),
        pytest.param("if self.p is None:\n    return\nmake()", WHEN, id="a return"),
        pytest.param("if not self.p:\n    return\nmake()", WHEN, id="a return of a flag"),
        pytest.param("has = self.p is not None\nif has:\n    make()", WHEN, id="a flag"),
        pytest.param("if read():\n    self.p = None\nif self.p:\n    make()", {"perhaps": True}, id="taken back"),
        pytest.param("for x in read():\n    self.p = self.create_publisher(String, 'c', 1)\nif self.p:\n    make()", {"perhaps": True}, id="a loop"),
        pytest.param("self.p = self.create_publisher(String, 'c', 1)\nif self.p:\n    make()", CERTAIN, id="set"),
    ],
)  # fmt: skip
def test_whether_a_member_is_set_in_python(python, body, expected):
    start = "self.p = None\nif self.declare_parameter('on', False).value:\n    self.p = self.create_publisher(String, 'a', 1)\n"
    assert decides(python(start + body.replace("make()", "self.create_publisher(String, 'b', 1)"))) == expected
