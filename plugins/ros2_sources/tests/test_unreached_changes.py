"""Functions that C-QoS sees nothing call, and what they may do to a quality of service at the top of their file over another name of it."""

from __future__ import annotations

import pytest

FIVE = {"depth": 5}
UNKNOWN = "unknown"
HELPERS = """
import copy
import functools
import lib
from other_package import elsewhere, flag

SHARED = QoSProfile(depth=5)
BY_NAME = {{'a': SHARED}}

def tune(q):
    q.depth = 7

def read(q):
    print(q.depth)

def tune_later(q):
    r = q
    tune(r)

class Holder:
    def __init__(self, qos):
        self.qos = qos

    def change(self):
        self.qos.depth = 7

class Keeper:
    def __init__(self, node, qos):
        self.qos = qos
        self.publisher = node.create_publisher(String, 'kept', qos)

    def show(self):
        print(self.qos)

    def take(self, q):
        tune(q)

class Lower(Keeper):
    def tune(self):
        self.qos.depth = 7

def rest(*args):
    args[0].depth = 7

def named(**kwargs):
    kwargs['q'].depth = 7

def {head}:
{body}
"""


def policies(found):
    qos = found["publishes"]["x"]["qos"]
    return UNKNOWN if isinstance(qos, dict) and ("unknown" in qos or "unread" in qos) else qos


def learned_of(python, body, head="never(node)"):
    lines = "".join(f"    {line}\n" for line in body.splitlines())
    return policies(python("self.create_publisher(String, 'x', SHARED)", "", HELPERS.format(head=head, body=lines)))


@pytest.mark.parametrize(
    "body",
    [
        "SHARED.depth = 7",
        "q = SHARED\nq.depth = 7",
        "q = SHARED\nsetattr(q, 'depth', 7)",
        "q = SHARED\nr = q\nr.depth = 7",
        "q = r = SHARED\nr.depth = 7",
        "q, n = SHARED, 1\nq.depth = 7",
        "q: QoSProfile = SHARED\nq.depth = 7",
        "q = SHARED if flag else None\nq.depth = 7",
        "q = None or SHARED\nq.depth = 7",
        "if (q := SHARED):\n    q.depth = 7",
        "q = [SHARED]\nq[0].depth = 7",
        "q = {'a': SHARED}\nq['a'].depth = 7",
        "q = {'a': [SHARED]}\nfor r in q['a']:\n    r.depth = 7",
        "for q in (SHARED,):\n    q.depth = 7",
        "for n, q in enumerate([SHARED]):\n    q.depth = 7",
        "for n, q in {'a': SHARED}.items():\n    q.depth = 7",
        "q = [r for r in [SHARED]][0]\nq.depth = 7",
        "[setattr(r, 'depth', 7) for r in [SHARED]]",
        "with elsewhere(SHARED) as q:\n    q.depth = 7",
        "with flag:\n    q = SHARED\n    q.depth = 7",
        "while flag:\n    q.depth = 7\n    q = SHARED",
        "try:\n    q = SHARED\nfinally:\n    q.depth = 7",
        "match SHARED:\n    case q:\n        q.depth = 7",
        "q = next(iter([SHARED]))\nq.depth = 7",
        "q = []\nq.append(SHARED)\nq[0].depth = 7",
        "q = {}\nq['a'] = SHARED\nq['a'].depth = 7",
        "h = Holder(SHARED)\nh.qos.depth = 7",
        "h = Holder(SHARED)\nh.change()",
        "Lower(node, SHARED)",
        "k = Keeper(node, SHARED)\nk.take(SHARED)",
        "lib.Helper(node, SHARED)",
        "tune(*[SHARED])",
        "tune(**{'q': SHARED})",
        "rest(SHARED)",
        "named(q=SHARED)",
        "Holder(SHARED).change()",
        "node.qos = SHARED\nnode.qos.depth = 7",
        "tune(SHARED)",
        "tune(q=SHARED)",
        "tune_later(SHARED)",
        "q = SHARED\ntune(q)",
        "elsewhere(SHARED)",
        "elsewhere([SHARED])",
        "q = SHARED\nlib.f(qos=q)",
        "functools.partial(tune, SHARED)()",
        "f = lambda: setattr(SHARED, 'depth', 7)\nf()",
        "q = SHARED\nf = lambda: tune(q)\nf()",
        "def inner():\n    SHARED.depth = 7\ninner()",
        "def inner():\n    q = SHARED\n    q.depth = 7\nreturn inner",
        "def inner(q=SHARED):\n    q.depth = 7\ninner()",
        "class Inner:\n    q = SHARED\n    q.depth = 7",
        "global SHARED\nSHARED = QoSProfile(depth=7)",
        "globals()['SHARED'].depth = 7",
        "exec('SHARED.depth = 7')",
        "q = SHARED\nq.depth, n = 7, 1",
        "q = SHARED\nq.__init__(depth=7)",
        "q = BY_NAME['a']\nq.depth = 7",
        "for q in BY_NAME.values():\n    q.depth = 7",
    ],
)  # fmt: skip
def test_what_an_unreached_function_may_change_is_not_known(python, body):
    assert learned_of(python, body) == UNKNOWN


@pytest.mark.parametrize("head", ["never(node, q=SHARED)", "never(node, *, q=SHARED)"])
def test_a_default_of_an_unreached_function_may_be_changed(python, head):
    assert learned_of(python, "q.depth = 7", head) == UNKNOWN


@pytest.mark.parametrize(
    "body",
    [
        "print(SHARED)",
        "q = SHARED\nprint(q.depth, q)",
        "q = SHARED.depth\nq = 7",
        "q = copy.copy(SHARED)\nq.depth = 7",
        "q = copy.deepcopy(SHARED)\ntune(q)",
        "q = QoSProfile(depth=SHARED.depth)\nq.depth = 7",
        "q = SHARED\nq = QoSProfile(depth=3)\nr = QoSProfile(depth=4)\nr.depth = 7",
        "SHARED = QoSProfile(depth=3)\nSHARED.depth = 7",
        "SHARED = QoSProfile(depth=3)\nq = SHARED\nq.depth = 7",
        "node.create_subscription(String, 'y', print, SHARED)",
        "node.create_publisher(String, 'y', qos_profile=SHARED)",
        "node.out = node.create_publisher(String, 'y', SHARED)\nnode.out.publish(String())",
        "q = SHARED\nnode.create_subscription(String, 'y', print, q)",
        "read(SHARED)",
        "q = SHARED\nread(q)",
        "q = SHARED\nnode.get_logger().info(f'{q}')",
        "return SHARED.depth",
        "return SHARED",
        "node.qos = SHARED",
        "k = Keeper(node, SHARED)\nk.show()",
        "return SHARED == QoSProfile(depth=3)",
        "elsewhere(SHARED.depth)",
        "q = [SHARED]\nprint(len(q))",
        "tune(QoSProfile(depth=SHARED.depth))",
        "def inner(q):\n    q.depth = 7\nreturn inner",
        "exec('print(1)')",
        "print(globals())",
    ],
)  # fmt: skip
def test_what_an_unreached_function_only_reads_stays_known(python, body):
    assert learned_of(python, body) == FIVE


OTHER = """
SHARED = QoSProfile(depth=5)

class Other:
    def __init__(self):
        {}

    def run(self):
        {}
"""


@pytest.mark.parametrize(
    ("made", "run", "expected"),
    [
        ("self.qos = SHARED", "self.qos.depth = 7", UNKNOWN),
        ("self.all = {'a': SHARED}", "self.all['a'].depth = 7", UNKNOWN),
        ("self.qos = SHARED", "q = self.qos; q.depth = 7", UNKNOWN),
        ("q = SHARED; self.qos = q", "setattr(self.qos, 'depth', 7)", UNKNOWN),
        ("self.qos = SHARED", "print(self.qos.depth)", FIVE),
        ("self.qos = SHARED", "self.create_subscription(String, 'y', print, self.qos)", FIVE),
        ("self.qos = SHARED", "self.other.depth = 7", FIVE),
        ("self.qos = QoSProfile(depth=SHARED.depth)", "self.qos.depth = 7", FIVE),
    ],
)
def test_methods_of_an_unreached_class_share_their_members(python, made, run, expected):
    found = python("self.create_publisher(String, 'x', SHARED)", "", OTHER.format(made, run))
    assert policies(found) == expected


OF_CLASS = """
SHARED = QoSProfile(depth=5)

class Other:
    qos = SHARED
    all = {{'a': SHARED}}

    def run(self):
        {}

def never(h, q):
    {}
"""


@pytest.mark.parametrize(
    ("run", "never", "expected"),
    [
        ("pass", "Other.qos.depth = 7", UNKNOWN),
        ("pass", "q = Other.all['a']; q.depth = 7", UNKNOWN),
        ("self.qos.depth = 7", "pass", UNKNOWN),
        ("Other.qos.depth = 7", "pass", UNKNOWN),
        ("print(self.qos)", "print(Other.qos.depth)", FIVE),
        ("qos = QoSProfile(depth=3); qos.depth = 7", "q.depth = 7", FIVE),
        ("self.other.depth = 7", "h.qos.depth = 7", FIVE),
    ],
)
def test_what_a_class_keeps_is_the_same_object(python, run, never, expected):
    found = python("self.create_publisher(String, 'x', SHARED)", "", OF_CLASS.format(run, never))
    assert policies(found) == expected


@pytest.mark.parametrize("head", ["never(node, SHARED)", "never(node, *SHARED)"])
def test_a_parameter_of_the_same_name_is_another_object(python, head):
    assert learned_of(python, "SHARED.depth = 7\nq = SHARED\nelsewhere(q)", head) == FIVE
