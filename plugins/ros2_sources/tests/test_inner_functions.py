"""Functions and classes inside functions of Python: what stands at the top of the file is the same object in them."""

from __future__ import annotations

import pytest

FIVE = {"depth": 5}
SEVEN = {"depth": 7}
UNKNOWN = "unknown"
P = "q = QoSProfile(depth=5)\n"
M = "self.qos = QoSProfile(depth=5)\n"
BEFORE = """
from other_package import elsewhere, Base

SHARED = QoSProfile(depth=5)

def tune(q):
    q.depth = 7

class Holder:
    def __init__(self, qos):
        self.qos = qos
"""
METHODS = "    def change(self):\n        self.qos.depth = 7\n"


def policies(python, body, qos):
    found = python(f"{body}\nself.create_publisher(String, 'x', {qos})", METHODS, BEFORE)["publishes"]["x"]["qos"]
    return UNKNOWN if isinstance(found, dict) and ("unknown" in found or "unread" in found) else found


@pytest.mark.parametrize(
    ("body", "qos", "expected"),
    [
        ("def make():\n    return SHARED", "make()", FIVE),
        ("make = lambda: SHARED", "make()", FIVE),
        ("def make():\n    def deeper():\n        return SHARED\n    return deeper()", "make()", FIVE),
        ("def make():\n    SHARED.depth = 7\nmake()", "SHARED", SEVEN),
        ("def make():\n    q = SHARED\n    q.depth = 7\nmake()", "SHARED", SEVEN),
        ("def make():\n    tune(SHARED)\nmake()", "SHARED", SEVEN),
        ("f = lambda: setattr(SHARED, 'depth', 7)\nf()", "SHARED", SEVEN),
        ("def make():\n    elsewhere(SHARED)\nmake()", "SHARED", UNKNOWN),
        ("def make():\n    SHARED = QoSProfile(depth=3)\n    SHARED.depth = 7\nmake()", "SHARED", FIVE),
        ("def make(SHARED):\n    SHARED.depth = 7\nmake(QoSProfile(depth=3))", "SHARED", FIVE),
        ("def make():\n    print(SHARED.depth)\nmake()", "SHARED", FIVE),
    ],
)
def test_inner_functions_see_what_stands_at_the_top_of_their_file(python, body, qos, expected):
    assert policies(python, body, qos) == expected


@pytest.mark.parametrize(
    ("body", "qos"),
    [
        (f"{M}class Inner:\n    def run(this):\n        self.qos.depth = 7\nInner().run()", "self.qos"),
        (f"{M}outer = self\nclass Inner:\n    def run(self):\n        outer.qos.depth = 7\nInner().run()", "self.qos"),
        (f"{M}class Inner:\n    x = self.change()", "self.qos"),
        (f"{M}class Inner:\n    def run(this):\n        self.change()\nInner().run()", "self.qos"),
        (f"{P}class Inner:\n    def __init__(self, r):\n        r.depth = 7\nInner(q)", "q"),
        (f"{P}class Inner:\n    def __init__(self, r):\n        self.r = r\n    def run(self):\n        self.r.depth = 7\nInner(q).run()", "q"),
        (f"{P}class Inner:\n    def run(self):\n        q.depth = 7\nelsewhere(Inner)", "q"),
        (f"{P}class Inner:\n    def run(self):\n        tune(q)\ni = Inner()\ni.run()", "q"),
        (f"{P}class Inner:\n    @property\n    def x(self):\n        q.depth = 7\nInner().x", "q"),
        (f"{P}class Inner:\n    class Deeper:\n        def run(self):\n            q.depth = 7\nInner.Deeper().run()", "q"),
        (f"{P}class Inner(elsewhere(q)):\n    pass", "q"),
        (f"{P}class Inner(Base, metaclass=elsewhere(q)):\n    pass", "q"),
        (f"{P}@elsewhere(q)\nclass Inner:\n    pass", "q"),
        (f"{P}class Inner:\n    def run(self, r=q):\n        r.depth = 7\nInner().run()", "q"),
        (f"{P}def make():\n    class Inner:\n        def run(self):\n            q.depth = 7\n    return Inner\nmake()().run()", "q"),
        ("class Inner:\n    def run(self):\n        SHARED.depth = 7\nInner().run()", "SHARED"),
        ("class Inner:\n    def run(self):\n        r = SHARED\n        r.depth = 7\nInner().run()", "SHARED"),
        ("class Inner:\n    qos = SHARED\nInner.qos.depth = 7", "SHARED"),
        ("class Inner(Holder):\n    def change(self):\n        self.qos.depth = 7\ni = Inner(SHARED)\ni.change()", "SHARED"),
        ("class Inner(Holder):\n    pass\ni = Inner(SHARED)\ni.qos.depth = 7", "SHARED"),
        ("def make():\n    class Inner:\n        def run(self):\n            SHARED.depth = 7\n    return Inner\nmake()().run()", "SHARED"),
        ("class Inner:\n    qos = QoSProfile(depth=5)\nInner.qos.depth = 7", "Inner.qos"),
        ("class Inner:\n    qos = QoSProfile(depth=5)\ni = Inner()\ni.qos.depth = 7", "i.qos"),
        ("class Inner:\n    def __init__(self):\n        self.qos = QoSProfile(depth=7)\ni = Inner()", "i.qos"),
    ],
)  # fmt: skip
def test_a_change_in_an_inner_class_is_seen_or_makes_it_unknown(python, body, qos):
    assert policies(python, body, qos) in (UNKNOWN, SEVEN)


@pytest.mark.parametrize(
    ("body", "qos"),
    [
        (f"{P}class Inner:\n    x = 1", "q"),
        (
            f"{P}class Inner:\n    def run(self):\n        r = QoSProfile(depth=3)\n        r.depth = 7\nInner().run()",
            "q",
        ),
        (f"{M}class Inner:\n    def run(self):\n        self.qos = QoSProfile(depth=3)", "self.qos"),
        (f"{M}class Inner:\n    def run(self):\n        return 1\nself.inner = Inner()\nself.inner.run()", "self.qos"),
        ("class Inner:\n    def run(self):\n        return 1\nInner().run()", "SHARED"),
    ],
)
def test_an_inner_class_that_names_nothing_of_it_keeps_it_known(python, body, qos):
    assert policies(python, body, qos) == FIVE
