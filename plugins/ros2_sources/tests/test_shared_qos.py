"""Which quality of service an object has where names, references, pointers, lists and calls share it: the new value, or none; never the old one."""

from __future__ import annotations

import pytest

PUB = 'create_publisher<std_msgs::msg::String>("x", {})'
BEST = {"depth": 5, "reliability": "best_effort"}
FIVE = {"depth": 5}
SEVEN = {"depth": 7}
UNKNOWN = "unknown"
SENSOR = "sensor_data"
FUNCTIONS = """
void by_reference(rclcpp::QoS & q) { q.best_effort(); }
void by_pointer(rclcpp::QoS * q) { q->best_effort(); }
void by_value(rclcpp::QoS q) { q.best_effort(); }
void by_constant(const rclcpp::QoS & q) { print(q.depth()); }
void whole(rclcpp::QoS & q) { q = rclcpp::QoS(7); }
void of_rmw(rmw_qos_profile_t & r) { r.reliability = RMW_QOS_POLICY_RELIABILITY_BEST_EFFORT; }
rclcpp::QoS & same(rclcpp::QoS & q) { return q; }
rclcpp::QoS copy(rclcpp::QoS & q) { return q; }
rclcpp::QoS & once() { static rclcpp::QoS q(5); return q; }
"""
MEMBERS = """
rclcpp::QoS qos_{5};
rclcpp::QoS & mine() { return qos_; }
auto trailing() -> rclcpp::QoS & { return qos_; }
rclcpp::QoS theirs() { return qos_; }
const rclcpp::QoS & read() const { return qos_; }
rclcpp::QoS * address() { return &qos_; }
std::vector<rclcpp::QoS> all_{rclcpp::QoS(5), rclcpp::QoS(5)};
std::map<std::string, rclcpp::QoS> by_name_{{"a", rclcpp::QoS(5)}};
struct Config { rclcpp::QoS qos{5}; };
Config config_;
"""
RMW = "RMW_QOS_POLICY_RELIABILITY_BEST_EFFORT"


def policies(found):
    """Return the quality of service of the one endpoint, or that it is not known."""
    (entry,) = found["publishes"].values()
    qos = entry["qos"]
    return UNKNOWN if isinstance(qos, dict) and ("unknown" in qos or "unread" in qos) else qos


@pytest.mark.parametrize(
    ("body", "qos", "expected"),
    [
        # references to what rmw calls a profile
        pytest.param(f"rclcpp::QoS q(5); q.get_rmw_qos_profile().reliability = {RMW};", "q", BEST, id="profile"),
        pytest.param(f"auto q = rclcpp::QoS(5); auto & p = q.get_rmw_qos_profile(); p.reliability = {RMW};", "q", BEST, id="auto reference"),
        pytest.param(f"rclcpp::QoS q(5); rmw_qos_profile_t & p = q.get_rmw_qos_profile(); p.reliability = {RMW};", "q", BEST, id="reference"),
        pytest.param(f"rclcpp::QoS q(5); auto * p = &q.get_rmw_qos_profile(); p->reliability = {RMW};", "q", BEST, id="pointer"),
        pytest.param(f"rclcpp::QoS q(5); auto p = &q.get_rmw_qos_profile(); p->reliability = {RMW};", "q", BEST, id="auto pointer"),
        pytest.param("rclcpp::QoS q(5); auto * p = &q; p->get_rmw_qos_profile().depth = 7;", "q", SEVEN, id="profile over a pointer"),
        pytest.param(f"rclcpp::QoS q(5); auto p = q.get_rmw_qos_profile(); p.reliability = {RMW};", "q", FIVE, id="copy of the profile"),
        pytest.param(f"rclcpp::QoS q(5); rmw_qos_profile_t p = q.get_rmw_qos_profile(); p.reliability = {RMW};", "q", FIVE, id="typed copy of the profile"),
        pytest.param('rclcpp::QoS q(5); const auto & p = q.get_rmw_qos_profile(); RCLCPP_INFO(get_logger(), "%zu", p.depth);', "q", FIVE, id="constant profile"),
        pytest.param("rclcpp::QoS q(5); of_rmw(q.get_rmw_qos_profile());", "q", BEST, id="profile handed on"),
        pytest.param("rclcpp::QoS q(5); elsewhere(q.get_rmw_qos_profile());", "q", UNKNOWN, id="profile handed to what is not read"),
        pytest.param("rclcpp::QoS q(5); q.get_rmw_qos_profile().deadline.sec = 1;", "q", UNKNOWN, id="part of a policy"),
        pytest.param("rclcpp::QoS q(5); q.get_rmw_qos_profile() = rmw_qos_profile_sensor_data;", "q", SENSOR, id="whole profile"),
        # names of one object
        pytest.param("rclcpp::QoS q(5); rclcpp::QoS & r = q; r.best_effort();", "q", BEST, id="alias"),
        pytest.param("rclcpp::QoS & r = qos_; r.best_effort();", "qos_", BEST, id="alias of a member"),
        pytest.param("rclcpp::QoS & r = qos_; qos_.best_effort();", "r", BEST, id="alias read"),
        pytest.param("const rclcpp::QoS & r = qos_; qos_.best_effort();", "r", BEST, id="constant alias read"),
        pytest.param("rclcpp::QoS & r = qos_; r = rclcpp::QoS(7);", "qos_", SEVEN, id="alias assigned"),
        pytest.param("rclcpp::QoS & r = qos_; qos_ = rclcpp::QoS(7);", "r", SEVEN, id="alias of what is assigned"),
        pytest.param("rclcpp::QoS & r = qos_; rclcpp::QoS & s = r; s.best_effort();", "qos_", BEST, id="alias of an alias"),
        pytest.param("auto & r = qos_.best_effort(); r.keep_last(7);", "qos_", {"depth": 7, "reliability": "best_effort"}, id="alias of what a setter returns"),
        pytest.param("this->qos_.best_effort();", "qos_", BEST, id="this"),
        pytest.param("this->qos_.get_rmw_qos_profile().depth = 7;", "this->qos_", SEVEN, id="this and the profile"),
        pytest.param("config_.qos.best_effort();", "config_.qos", BEST, id="structure"),
        pytest.param("auto & c = config_; c.qos.best_effort();", "config_.qos", BEST, id="reference to a structure"),
        pytest.param("auto & c = config_.qos; c.best_effort();", "config_.qos", BEST, id="reference into a structure"),
        pytest.param("Config c = config_; c.qos.best_effort();", "config_.qos", FIVE, id="copy of a structure"),
        pytest.param("rclcpp::QoS * p = &qos_; *p = rclcpp::QoS(7);", "qos_", SEVEN, id="assigned over a pointer"),
        pytest.param("rclcpp::QoS q(7); rclcpp::QoS * p = &qos_; p = &q; p->best_effort();", "qos_", FIVE, id="pointer to something else"),
        pytest.param("rclcpp::QoS q(7); rclcpp::QoS * p = &qos_; p = &q; p->keep_last(5).best_effort();", "q", BEST, id="what the pointer means then"),
        pytest.param("auto p = std::make_shared<rclcpp::QoS>(5); auto r = p; r->best_effort();", "*p", BEST, id="shared pointer"),
        pytest.param("auto r = std::ref(qos_); r.get().best_effort();", "qos_", BEST, id="reference wrapper"),
        # copies
        pytest.param("rclcpp::QoS r = qos_; r.best_effort();", "qos_", FIVE, id="copy"),
        pytest.param("auto r = qos_; r.best_effort();", "qos_", FIVE, id="auto copy"),
        pytest.param("auto r = qos_; r.best_effort();", "r", BEST, id="what the copy has"),
        pytest.param("rclcpp::QoS r(qos_); r.best_effort();", "qos_", FIVE, id="copy constructor"),
        pytest.param("rclcpp::QoS r{qos_}; qos_.best_effort();", "r", FIVE, id="copy in braces"),
        pytest.param("rclcpp::QoS q = 5; q.best_effort();", "q", BEST, id="made of a number"),
        pytest.param("rclcpp::QoS q(rclcpp::KeepLast(5)); q.best_effort();", "q", BEST, id="made of a history"),
        pytest.param("rclcpp::QoS q(5); rclcpp::QoS r = std::move(q); q = rclcpp::QoS(7);", "r", FIVE, id="moved away"),
        pytest.param("rclcpp::QoS q(5); rclcpp::QoS r = std::move(q); q = rclcpp::QoS(7);", "q", SEVEN, id="assigned after a move"),
        pytest.param("rclcpp::QoS q(7); std::swap(q, qos_);", "qos_", UNKNOWN, id="swapped"),
        pytest.param("auto old = std::exchange(qos_, rclcpp::QoS(7));", "qos_", UNKNOWN, id="exchanged"),
        pytest.param("auto p = std::make_shared<rclcpp::QoS>(5); auto r = *p; r.best_effort();", "*p", FIVE, id="copy of what a pointer means"),
        pytest.param("once().best_effort();", "once()", BEST, id="static name"),
        pytest.param("auto t = std::tie(qos_); std::get<0>(t).best_effort();", "qos_", UNKNOWN, id="in a tuple"),
        # only read
        pytest.param("print(qos_.depth());", "qos_", FIVE, id="depth"),
        pytest.param("print(qos_.reliability());", "qos_", FIVE, id="reliability"),
        pytest.param("if (qos_.history() == rclcpp::HistoryPolicy::KeepAll) { print(1); }", "qos_", FIVE, id="history"),
        pytest.param('RCLCPP_INFO(get_logger(), "%zu", qos_.get_rmw_qos_profile().depth);', "qos_", FIVE, id="log"),
        pytest.param("size_t n = qos_.get_rmw_qos_profile().depth + 2;", "n", SEVEN, id="in an expression"),
        pytest.param("by_constant(qos_);", "qos_", FIVE, id="constant reference"),
        pytest.param("by_value(qos_);", "qos_", FIVE, id="handed on as a copy"),
        # functions
        pytest.param("by_reference(qos_);", "qos_", BEST, id="handed on by reference"),
        pytest.param("by_pointer(&qos_);", "qos_", BEST, id="handed on by pointer"),
        pytest.param("rclcpp::QoS & r = qos_; by_reference(r);", "qos_", BEST, id="alias handed on"),
        pytest.param("by_reference(std::ref(qos_));", "qos_", BEST, id="wrapper handed on"),
        pytest.param("whole(qos_);", "qos_", SEVEN, id="assigned in a function"),
        pytest.param("elsewhere(qos_);", "qos_", UNKNOWN, id="function that is not read"),
        pytest.param("rclcpp::QoS & r = qos_; elsewhere(r);", "qos_", UNKNOWN, id="alias in a function that is not read"),
        pytest.param("elsewhere(&qos_);", "qos_", UNKNOWN, id="pointer in a function that is not read"),
        pytest.param("elsewhere(all_[0]);", "all_[0]", UNKNOWN, id="element in a function that is not read"),
        pytest.param("auto & r = elsewhere(config_.qos); r.best_effort();", "config_.qos", UNKNOWN, id="what such a function returns"),
        pytest.param("same(qos_).best_effort();", "qos_", BEST, id="returned reference"),
        pytest.param("copy(qos_).best_effort();", "qos_", FIVE, id="returned copy"),
        pytest.param("mine().best_effort();", "qos_", BEST, id="returned member"),
        pytest.param("mine() = rclcpp::QoS(7);", "qos_", SEVEN, id="returned member assigned"),
        pytest.param("auto & r = mine(); r.best_effort();", "qos_", BEST, id="alias of what is returned"),
        pytest.param("auto r = mine(); r.best_effort();", "qos_", FIVE, id="copy of what is returned"),
        pytest.param("trailing().best_effort();", "qos_", BEST, id="type behind the function"),
        pytest.param("theirs().best_effort();", "qos_", FIVE, id="returned by value"),
        pytest.param("const auto & r = read(); qos_.best_effort();", "r", BEST, id="returned constant reference"),
        pytest.param("address()->best_effort();", "qos_", BEST, id="returned pointer"),
        pytest.param("auto p = address(); p->best_effort();", "qos_", BEST, id="name for a returned pointer"),
        # lambdas
        pytest.param("rclcpp::QoS q(5); auto f = [&]() { q.best_effort(); }; f();", "q", BEST, id="lambda"),
        pytest.param("rclcpp::QoS q(5); auto f = [&q]() { q.get_rmw_qos_profile().depth = 7; }; f();", "q", SEVEN, id="lambda by reference"),
        pytest.param("rclcpp::QoS q(5); auto f = [&r = q]() { r.best_effort(); }; f();", "q", BEST, id="lambda by a new name"),
        pytest.param("rclcpp::QoS q(5); auto f = [q]() mutable { q.best_effort(); }; f();", "q", FIVE, id="lambda with a copy"),
        pytest.param("rclcpp::QoS q(5); auto f = [=]() mutable { q.best_effort(); }; f();", "q", FIVE, id="lambda with copies"),
        pytest.param("rclcpp::QoS q(5); later([&]() { q.best_effort(); });", "q", UNKNOWN, id="lambda that is called later"),
        pytest.param("later([this]() { qos_.best_effort(); });", "qos_", UNKNOWN, id="lambda that changes a member later"),
        pytest.param("auto set = [](rclcpp::QoS & q) { q.best_effort(); }; set(qos_);", "qos_", BEST, id="argument of a lambda"),
        # lists
        pytest.param("all_[0].best_effort();", "all_[0]", BEST, id="element"),
        pytest.param("all_.at(0).best_effort();", "all_[0]", BEST, id="element by call"),
        pytest.param("all_[0].best_effort();", "all_[1]", FIVE, id="other element"),
        pytest.param("auto & r = all_[0]; r.best_effort();", "all_[0]", BEST, id="alias of an element"),
        pytest.param("all_[0] = rclcpp::QoS(7);", "all_[0]", SEVEN, id="element assigned"),
        pytest.param("all_[index()].best_effort();", "all_[0]", UNKNOWN, id="some element"),
        pytest.param("for (auto & q : all_) { q.best_effort(); }", "all_[0]", BEST, id="elements by reference"),
        pytest.param("for (auto q : all_) { q.best_effort(); }", "all_[0]", FIVE, id="elements by value"),
        pytest.param("for (const auto & q : all_) { print(q.depth()); }", "all_[0]", FIVE, id="elements by constant reference"),
        pytest.param("rclcpp::QoS q(5); std::vector<rclcpp::QoS> v{q}; v[0].best_effort();", "q", FIVE, id="copy in a list"),
        pytest.param("rclcpp::QoS q(5); std::vector<rclcpp::QoS> v; v.push_back(q); v.back().best_effort();", "q", FIVE, id="copy appended"),
        pytest.param("std::vector<rclcpp::QoS> v; v.push_back(rclcpp::QoS(5)); v.back().best_effort();", "v.front()", BEST, id="last element"),
        pytest.param("std::vector<rclcpp::QoS> v; v.emplace_back(5); v[0].best_effort();", "v[0]", BEST, id="element made in place"),
        pytest.param("rclcpp::QoS q(5); std::vector<rclcpp::QoS *> v{&q}; v[0]->best_effort();", "q", BEST, id="list of pointers"),
        pytest.param("rclcpp::QoS q(5); for (auto * p : {&q}) { p->best_effort(); }", "q", BEST, id="pointers in a loop"),
        pytest.param('by_name_.at("a").best_effort();', 'by_name_.at("a")', BEST, id="map"),
        pytest.param('by_name_["a"].get_rmw_qos_profile().depth = 7;', 'by_name_["a"]', SEVEN, id="map by index"),
        pytest.param("auto v = all_; v[0].best_effort();", "all_[0]", FIVE, id="copy of a list"),
        pytest.param("auto & v = all_; v[0].best_effort();", "all_[0]", BEST, id="reference to a list"),
        pytest.param("std::array<rclcpp::QoS, 1> v{qos_}; v[0].best_effort();", "qos_", FIVE, id="copy in an array"),
        # decisions
        pytest.param("rclcpp::QoS & r = qos_; if (ok()) { r.best_effort(); }", "qos_", UNKNOWN, id="perhaps"),
        pytest.param("rclcpp::QoS & r = qos_; if (ok()) {} else { r.best_effort(); }", "qos_", UNKNOWN, id="perhaps not"),
        pytest.param("rclcpp::QoS q(7); auto & r = ok() ? q : qos_; r.best_effort();", "qos_", UNKNOWN, id="one of two"),
        pytest.param("rclcpp::QoS q(5); rclcpp::QoS r = ok() ? q : qos_; r.best_effort();", "r", BEST, id="copy of one of two alike"),
        pytest.param("if (ok()) { qos_.best_effort(); } else { qos_.best_effort(); }", "qos_", BEST, id="in both branches"),
    ],
)  # fmt: skip
def test_qualities_of_service_in_cpp(cpp, body, qos, expected):
    assert policies(cpp(f"{body} {PUB.format(qos)};", MEMBERS, FUNCTIONS)) == expected


def test_a_parameter_decides_which_object_is_changed(cpp):
    body = (
        'bool on = declare_parameter<bool>("on", false); rclcpp::QoS q(7); auto & r = on ? q : qos_; r.best_effort();'
    )
    assert policies(cpp(f"{body} {PUB.format('qos_')};", MEMBERS)) == [
        {"when": {"on": "true"}, "depth": 5},
        {"depth": 5, "reliability": "best_effort"},
    ]
    assert policies(cpp(f"{body} {PUB.format('r')};", MEMBERS)) == [
        {"when": {"on": "true"}, "depth": 7, "reliability": "best_effort"},
        {"depth": 5, "reliability": "best_effort"},
    ]


def test_a_method_that_a_timer_may_call_first_changes_a_member(cpp):
    timers = "create_wall_timer(1s, [this]() { change(); }); create_wall_timer(1s, [this]() { make(); });"
    members = (
        f"{MEMBERS} void change() {{ qos_.get_rmw_qos_profile().depth = 7; }} void make() {{ {PUB.format('qos_')}; }}"
    )
    assert policies(cpp(timers, members)) == UNKNOWN


RELIABLE = {"profile": "sensor_data", "reliability": "reliable"}
HELPERS = """
import copy
import operator
from rclpy.qos import QoSPresetProfiles
from other_package import elsewhere

SHARED = QoSProfile(depth=5)

def change(q):
    q.reliability = ReliabilityPolicy.BEST_EFFORT

def default(q=QoSProfile(depth=5)):
    return q
"""
METHODS = """
    QOS = QoSProfile(depth=5)

    def mine(self):
        return self.qos
"""
EFFORT = "ReliabilityPolicy.BEST_EFFORT"


@pytest.mark.parametrize(
    ("body", "qos", "expected"),
    [
        # presets are objects of the process
        pytest.param("q = qos_profile_sensor_data\nq.reliability = ReliabilityPolicy.RELIABLE", "qos_profile_sensor_data", RELIABLE, id="preset"),
        pytest.param("q = qos_profile_sensor_data\nq.reliability = ReliabilityPolicy.RELIABLE", "q", RELIABLE, id="name of the preset"),
        pytest.param("qos_profile_sensor_data.reliability = ReliabilityPolicy.RELIABLE", "QoSPresetProfiles.SENSOR_DATA.value", RELIABLE, id="preset by its other name"),
        pytest.param("q = QoSPresetProfiles.SENSOR_DATA.value\nq.reliability = ReliabilityPolicy.RELIABLE", "qos_profile_sensor_data", RELIABLE, id="preset of the enumeration"),
        pytest.param("q = copy.copy(qos_profile_sensor_data)\nq.reliability = ReliabilityPolicy.RELIABLE", "qos_profile_sensor_data", SENSOR, id="copy of the preset"),
        pytest.param("q = copy.deepcopy(qos_profile_sensor_data)\nq.reliability = ReliabilityPolicy.RELIABLE", "q", RELIABLE, id="deep copy of the preset"),
        pytest.param("elsewhere(qos_profile_sensor_data)", "qos_profile_sensor_data", UNKNOWN, id="preset handed on"),
        pytest.param("print(qos_profile_sensor_data, qos_profile_sensor_data.depth)", "qos_profile_sensor_data", SENSOR, id="preset read"),
        pytest.param("if elsewhere():\n    qos_profile_sensor_data.depth = 7", "qos_profile_sensor_data", UNKNOWN, id="preset perhaps"),
        pytest.param("if elsewhere():\n    pass\nelse:\n    qos_profile_sensor_data.depth = 7", "qos_profile_sensor_data", UNKNOWN, id="preset perhaps not"),
        pytest.param("q = QoSPresetProfiles.get_from_short_key('sensor_data')\nq.reliability = ReliabilityPolicy.RELIABLE", "qos_profile_sensor_data", RELIABLE, id="preset by its short key"),
        pytest.param("q = QoSPresetProfiles['SENSOR_DATA'].value\nq.reliability = ReliabilityPolicy.RELIABLE", "qos_profile_sensor_data", RELIABLE, id="preset by its key"),
        # names of one object
        pytest.param("q = QoSProfile(depth=5)\nt = (q, 1)\na, b = t\na.depth = 7", "q", SEVEN, id="unpacked"),
        pytest.param("q = QoSProfile(depth=5)\nif a := q:\n    a.depth = 7", "q", SEVEN, id="named in a condition"),
        pytest.param("q = QoSProfile(depth=5)\na = q or QoSProfile(depth=9)\na.depth = 7", "q", SEVEN, id="or another one"),
        pytest.param(f"type(self).QOS.reliability = {EFFORT}", "self.QOS", BEST, id="class attribute by type"),
        pytest.param(f"self.__class__.QOS.reliability = {EFFORT}", "self.QOS", BEST, id="class attribute by __class__"),
        pytest.param(f"q = QoSProfile(depth=5)\nr = q\nr.reliability = {EFFORT}", "q", BEST, id="alias"),
        pytest.param(f"self.qos = QoSProfile(depth=5)\nr = self.qos\nr.reliability = {EFFORT}", "self.qos", BEST, id="alias of a member"),
        pytest.param(f"self.qos = QoSProfile(depth=5)\nr = self.qos\nself.qos.reliability = {EFFORT}", "r", BEST, id="alias read"),
        pytest.param("self.qos = QoSProfile(depth=5)\nr = self.qos\nself.qos = QoSProfile(depth=7)", "r", FIVE, id="another object"),
        pytest.param(f"self.qos = QoSProfile(depth=5)\nself.mine().reliability = {EFFORT}", "self.qos", BEST, id="returned"),
        pytest.param(f"a = b = QoSProfile(depth=5)\na.reliability = {EFFORT}", "b", BEST, id="two names"),
        pytest.param(f"a, b = QoSProfile(depth=5), QoSProfile(depth=5)\na.reliability = {EFFORT}", "b", FIVE, id="two objects"),
        pytest.param(f"q = QoSProfile(depth=5)\nr = copy.copy(q)\nr.reliability = {EFFORT}", "q", FIVE, id="copy"),
        pytest.param(f"q = QoSProfile(depth=5)\nr = copy.deepcopy(q)\nr.reliability = {EFFORT}", "r", BEST, id="what the copy has"),
        pytest.param(f"q = QoSProfile(depth=5)\nr = QoSProfile(depth=q.depth)\nr.reliability = {EFFORT}", "q", FIVE, id="made of it"),
        # calls that set
        pytest.param("q = QoSProfile(depth=5)\nsetattr(q, 'depth', 7)", "q", SEVEN, id="setattr"),
        pytest.param("q = QoSProfile(depth=5)\nr = q\nsetattr(r, 'depth', 7)", "q", SEVEN, id="setattr of an alias"),
        pytest.param("q = QoSProfile(depth=5)\nsetattr(q, elsewhere(), 7)", "q", UNKNOWN, id="setattr of any policy"),
        pytest.param("q = QoSProfile(depth=5)\nq.__setattr__('depth', 7)", "q", UNKNOWN, id="__setattr__"),
        pytest.param("q = QoSProfile(depth=5)\nobject.__setattr__(q, 'depth', 7)", "q", UNKNOWN, id="__setattr__ of object"),
        pytest.param("q = QoSProfile(depth=5)\nvars(q).update(depth=7)", "q", UNKNOWN, id="vars"),
        pytest.param("q = QoSProfile(depth=5)\nq.__dict__['depth'] = 7", "q", UNKNOWN, id="__dict__"),
        pytest.param("q = QoSProfile(depth=5)\nq.__dict__.update(depth=7)", "q", UNKNOWN, id="__dict__ updated"),
        pytest.param("q = QoSProfile(depth=5)\nq._depth = 7", "q", UNKNOWN, id="private"),
        pytest.param("q = QoSProfile(depth=5)\nq.depth += 2", "q", SEVEN, id="added"),
        pytest.param("self.qos = QoSProfile(depth=5)\nq = getattr(self, 'qos')\nq.depth = 7", "self.qos", SEVEN, id="getattr"),
        pytest.param("q = QoSProfile(depth=5)\nprint(getattr(q, 'depth'), q == QoSProfile(depth=5), str(q))", "q", FIVE, id="only read"),
        # functions
        pytest.param("q = QoSProfile(depth=5)\nchange(q)", "q", BEST, id="handed on"),
        pytest.param("q = QoSProfile(depth=5)\nchange(q=q)", "q", BEST, id="handed on by name"),
        pytest.param("q = QoSProfile(depth=5)\nelsewhere(q)", "q", UNKNOWN, id="function that is not read"),
        pytest.param("q = QoSProfile(depth=5)\nelsewhere(qos=q)", "q", UNKNOWN, id="function that is not read, by name"),
        pytest.param("q = QoSProfile(depth=5)\nelsewhere([q])", "q", UNKNOWN, id="function that is not read, in a list"),
        pytest.param("q = QoSProfile(depth=5)\nr = elsewhere.pick(q)\nr.depth = 7", "q", UNKNOWN, id="what such a function returns"),
        pytest.param(f"default().reliability = {EFFORT}", "default()", BEST, id="default argument"),
        pytest.param(f"f = lambda: QoSProfile(depth=5)\nf().reliability = {EFFORT}", "f()", FIVE, id="made for each call"),
        # what classes and modules have
        pytest.param(f"self.QOS.reliability = {EFFORT}", "Driver.QOS", BEST, id="class attribute"),
        pytest.param(f"Driver.QOS.reliability = {EFFORT}", "self.QOS", BEST, id="class attribute by the class"),
        pytest.param("self.QOS = QoSProfile(depth=7)", "Driver.QOS", FIVE, id="member of the name of a class attribute"),
        pytest.param(f"SHARED.reliability = {EFFORT}", "SHARED", BEST, id="top of the module"),
        pytest.param("change(SHARED)", "SHARED", BEST, id="top of the module, handed on"),
        pytest.param(f"copy.copy(SHARED).reliability = {EFFORT}", "SHARED", FIVE, id="top of the module, copied"),
        # lists
        pytest.param("a = QoSProfile(depth=5)\nb = QoSProfile(depth=5)\nfor q in (a, b):\n    q.depth = 7", "b", SEVEN, id="loop"),
        pytest.param("a = [QoSProfile(depth=5)]\na[0].depth = 7", "a[0]", SEVEN, id="list"),
        pytest.param("q = QoSProfile(depth=5)\na = [q]\na[0].depth = 7", "q", SEVEN, id="in a list"),
        pytest.param("q = QoSProfile(depth=5)\na = {'x': q}\na['x'].depth = 7", "q", SEVEN, id="in a dictionary"),
        pytest.param("q = QoSProfile(depth=5)\na = (q, 1)\na[0].depth = 7", "q", SEVEN, id="in a tuple"),
        pytest.param("q = QoSProfile(depth=5)\na = []\na.append(q)\na[0].depth = 7", "q", SEVEN, id="appended"),
        pytest.param("q = QoSProfile(depth=5)\na = [q]\na[elsewhere()].depth = 7", "q", UNKNOWN, id="some element"),
        pytest.param("q = QoSProfile(depth=5)\na = {'x': q}\nfor r in a.values():\n    r.depth = 7", "q", SEVEN, id="values"),
        pytest.param("q = QoSProfile(depth=5)\na = {'x': q}\nfor n, r in a.items():\n    r.depth = 7", "q", SEVEN, id="items"),
        pytest.param("q = QoSProfile(depth=5)\na = {'x': q}\na.get('x').depth = 7", "q", SEVEN, id="get"),
        pytest.param("q = QoSProfile(depth=5)\na = [q]\nfor r in sorted(a):\n    r.depth = 7", "q", UNKNOWN, id="a list made of it"),
        pytest.param("q = QoSProfile(depth=5)\n[setattr(r, 'depth', 7) for r in [q]]", "q", SEVEN, id="comprehension"),
        pytest.param("q = QoSProfile(depth=5)\nd = {'x': q}\noperator.setitem(d, 'x', QoSProfile(depth=7))", "d['x']", UNKNOWN, id="setitem"),
        pytest.param("q = QoSProfile(depth=5)\nd = {'x': q}\ne = d\ne['x'] = QoSProfile(depth=7)", "d['x']", UNKNOWN, id="element set over an alias"),
        # decisions
        pytest.param("q = QoSProfile(depth=5)\nr = q if elsewhere() else QoSProfile(depth=5)\nr.depth = 7", "q", UNKNOWN, id="one of two"),
        pytest.param("q = QoSProfile(depth=5)\nr = q if elsewhere() else QoSProfile(depth=5)", "r", FIVE, id="one of two alike"),
        pytest.param("q = QoSProfile(depth=5)\nif elsewhere():\n    q.depth = 7\nelse:\n    q.depth = 7", "q", SEVEN, id="in both branches"),
        pytest.param("q = QoSProfile(depth=5)\nr = q\nif elsewhere():\n    q.depth = 7\nr.depth = 7", "q", UNKNOWN, id="set behind a branch"),
        pytest.param("q = QoSProfile(depth=5)\nwhile elsewhere():\n    q.depth = q.depth + 1", "q", UNKNOWN, id="counted"),
    ],
)  # fmt: skip
def test_qualities_of_service_in_python(python, body, qos, expected):
    assert policies(python(f"{body}\nself.create_publisher(String, 'x', {qos})", METHODS, HELPERS)) == expected


def test_what_was_made_before_keeps_its_value(python):
    body = "self.create_publisher(String, 'a', qos_profile_sensor_data)\nqos_profile_sensor_data.depth = 7\nself.create_publisher(String, 'b', qos_profile_sensor_data)"
    found = python(body)["publishes"]
    assert found["a"]["qos"] == "sensor_data"
    assert found["b"]["qos"] == {"profile": "sensor_data", "depth": 7}


def test_a_parameter_decides_which_object_of_python_is_changed(python):
    body = "q = qos_profile_sensor_data if self.declare_parameter('on', False).value else QoSProfile(depth=5)\nq.depth = 7\nself.create_publisher(String, 'x', {})"
    both = [{"when": {"on": "true"}, "profile": "sensor_data", "depth": 7}, {"depth": 7}]
    assert policies(python(body.format("q"))) == both
    preset = [{"when": {"on": "true"}, "profile": "sensor_data", "depth": 7}, {"profile": "sensor_data"}]
    assert policies(python(body.format("qos_profile_sensor_data"))) == preset


def test_a_callback_that_changes_a_preset_makes_it_unknown_for_the_others(python):
    body = "self.create_timer(1.0, self.change)\nself.create_timer(1.0, self.make)"
    methods = "    def change(self):\n        qos_profile_sensor_data.depth = 7\n    def make(self):\n        self.create_publisher(String, 'x', qos_profile_sensor_data)"
    assert policies(python(body, methods)) == UNKNOWN


def test_two_objects_of_a_class_share_what_their_class_has(python):
    parts = f"class Part:\n    QOS = QoSProfile(depth=5)\n    def set(self):\n        self.QOS.reliability = {EFFORT}\n"
    body = "one, other = Part(), Part()\none.set()\nself.create_publisher(String, 'x', other.QOS)"
    assert policies(python(body, "", parts)) == BEST


SETUP = "from setuptools import setup\nsetup(entry_points={'console_scripts': ['driver = bot.driver:main']})\n"
TOP = """
import rclpy
from rclpy.node import Node
from rclpy.qos import QoSProfile, ReliabilityPolicy, qos_profile_sensor_data
from std_msgs.msg import String
{before}
class Driver(Node):
    def __init__(self):
        super().__init__('driver')
        self.create_publisher(String, 'x', {qos})

def main():
    rclpy.init()
    rclpy.spin(Driver())
"""


@pytest.mark.parametrize(
    ("before", "qos", "expected"),
    [
        pytest.param("Q = QoSProfile(depth=5)\nQ.depth = 7", "Q", SEVEN, id="a statement"),
        pytest.param("Q = QoSProfile(depth=5)\nsetattr(Q, 'depth', 7)", "Q", SEVEN, id="setattr"),
        pytest.param("Q = QoSProfile(depth=5)\ndef f(q):\n    q.depth = 7\nf(Q)", "Q", SEVEN, id="a function"),
        pytest.param("A = QoSProfile(depth=5)\nQ = QoSProfile(depth=5)\nfor q in (A, Q):\n    q.depth = 7", "Q", SEVEN, id="a loop"),
        pytest.param("from .other import Q", "Q", SEVEN, id="of another file"),
        pytest.param("from . import other", "qos_profile_sensor_data", {"profile": "sensor_data", "depth": 9}, id="a preset that another file changes"),
        pytest.param("", "qos_profile_sensor_data", SENSOR, id="a preset that a file changes which is not imported"),
        pytest.param("if __name__ == '__main__':\n    qos_profile_sensor_data.depth = 7", "qos_profile_sensor_data", SENSOR, id="only where it is run"),
        pytest.param("class Part:\n    Q = QoSProfile(depth=5)\n    Q.depth = 7", "Part.Q", UNKNOWN, id="the body of a class"),
        pytest.param("Q = QoSProfile(depth=5)\nprint(Q)", "Q", FIVE, id="only read"),
    ],
)  # fmt: skip
def test_what_importing_a_file_changes(learned, before, qos, expected):
    other = "from rclpy.qos import QoSProfile, qos_profile_sensor_data\nQ = QoSProfile(depth=5)\nQ.depth = 7\nqos_profile_sensor_data.depth = 9\n"
    files = {"setup.py": SETUP, "bot/driver.py": TOP.format(before=before, qos=qos), "bot/other.py": other}
    assert policies(learned(files).document["nodes"]["driver"]) == expected


def test_a_file_that_is_run_and_its_functions_share_what_stands_at_its_top(learned):
    script = TOP.format(before="Q = QoSProfile(depth=5)\nQ.depth = 7", qos="Q") + "\nmain()\n"
    files = {
        "CMakeLists.txt": "install(PROGRAMS scripts/driver.py DESTINATION lib/${PROJECT_NAME})\n",
        "scripts/driver.py": script,
    }
    (node,) = learned(files).document["nodes"].values()
    assert policies(node) == SEVEN
