"""The law of qualities of service: what any statement may change has its new value or is not known, never its old one; what changes nothing stays known."""

from __future__ import annotations

import pytest

FUNCTIONS = """
#define TUNE(q) q.keep_last(7)
#define TUNE_MINE() qos_.keep_last(7)
#define TUNE_ALL(q) do { (q).keep_last(7); } while (0)
void tune(rclcpp::QoS & q) { q.keep_last(7); }
void read(const rclcpp::QoS & q) { print(q.depth()); }
rclcpp::QoS & same(rclcpp::QoS & q) { return q; }
rclcpp::QoS global(5);
static rclcpp::QoS hidden(5);
static rclcpp::QoS kept(5);
namespace bot { rclcpp::QoS inner(5); }
struct Shared { static rclcpp::QoS qos; };
rclcpp::QoS Shared::qos(5);
void never() { global.keep_last(7); hidden.get_rmw_qos_profile().depth = 7; bot::inner.keep_last(7); Shared::qos.keep_last(7); }
void reads() { print(kept.depth()); rclcpp::QoS kept(3); kept.keep_last(7); }
"""
MEMBERS = """
rclcpp::QoS qos_{5};
void change(rclcpp::QoS & q) { q.keep_last(7); }
void mine() { qos_.keep_last(7); }
std::vector<rclcpp::QoS> all_{rclcpp::QoS(5), rclcpp::QoS(5)};
std::map<std::string, rclcpp::QoS> by_name_{{"a", rclcpp::QoS(5)}};
struct Config { rclcpp::QoS qos{5}; };
struct Outer { Config config; };
Config config_;
Outer outer_;
"""
HELPERS = """
import contextlib
import copy
import functools
import itertools
import logging
import operator
import threading
import message_filters
from functools import partial
import lib
from other_package import elsewhere, Base

SHARED = QoSProfile(depth=5)
LOCAL = QoSProfile(depth=5)

def local():
    LOCAL = QoSProfile(depth=3)
    LOCAL.depth = 7

NEVER = QoSProfile(depth=5)

def never():
    NEVER.depth = 7

def tune(q):
    q.depth = 7

def read(q):
    print(q.depth)

def pair(q):
    return q, 1

def rest(*args):
    args[0].depth = 7

def named(**kwargs):
    kwargs['q'].depth = 7

def hand(*args, **kwargs):
    tune(*args, **kwargs)

def each(q):
    yield q

@elsewhere
def wrapped(q):
    return None

@contextlib.contextmanager
def context(q):
    q.depth = 7
    yield q

def decorate(function):
    def inner(q):
        q.depth = 7
    return inner

@decorate
def decorated(q):
    return None

class Holder:
    def __init__(self, qos):
        self.qos = qos

class Below(Base):
    def __init__(self, qos):
        super().__init__(qos)

class Tuning:
    def __init__(self, qos):
        qos.depth = 7

class Tuned(Tuning):
    def __init__(self, qos):
        super().__init__(qos)

class Caller:
    def __call__(self, q):
        q.depth = 7

class Context:
    def __init__(self, q):
        self.q = q
    def __enter__(self):
        self.q.depth = 7
        return self.q
    def __exit__(self, *args):
        self.q.depth = 7
"""
READING = """
    @property
    def mine(self):
        return self.qos

    @functools.cached_property
    def cached(self):
        return self.qos

    def two(self):
        return self.qos, 1
"""
METHODS = f"""{READING}
    @mine.setter
    def mine(self, value):
        self.qos.depth = 7

    @classmethod
    def of_class(cls, q):
        q.depth = 7

    @elsewhere
    def wrapped(self):
        return None

    def change(self):
        self.qos.depth = 7
"""
SEVEN = {"depth": 7}
FIVE = {"depth": 5}
UNKNOWN = "unknown"
Q = "rclcpp::QoS q(5); "
P = "q = QoSProfile(depth=5)\n"
M = "self.qos = QoSProfile(depth=5)\n"


def policies(found):
    """Return the quality of service of the one endpoint, or that it is not known."""
    (entry,) = found["publishes"].values()
    qos = entry["qos"]
    return UNKNOWN if isinstance(qos, dict) and ("unknown" in qos or "unread" in qos) else qos


@pytest.mark.parametrize(
    ("body", "qos"),
    [
        # functions as values
        (f"{Q}std::bind(tune, std::ref(q))();", "q"),
        (f"{Q}auto f = std::bind(&tune, std::ref(q)); f();", "q"),
        (f"{Q}auto f = std::bind(&Driver::change, this, std::ref(q)); f();", "q"),
        (f"{Q}auto f = std::bind(&Driver::change, this, std::placeholders::_1); f(q);", "q"),
        (f"{Q}auto f = std::bind(elsewhere, std::ref(q)); f();", "q"),
        (f"{Q}auto g = [](rclcpp::QoS & r) {{ r.keep_last(7); }}; auto f = std::bind(g, std::ref(q)); f();", "q"),
        (f"{Q}std::function<void()> f = std::bind(tune, std::ref(q)); f();", "q"),
        (f"{Q}std::bind_front(tune, std::ref(q))();", "q"),
        ("std::bind(&Driver::mine, this)();", "qos_"),
        (f"{Q}std::thread t(tune, std::ref(q)); t.join();", "q"),
        (f"{Q}std::thread t(&Driver::change, this, std::ref(q)); t.join();", "q"),
        (f"{Q}std::thread t(elsewhere, std::ref(q)); t.join();", "q"),
        (f"{Q}std::thread([&]() {{ q.keep_last(7); }}).join();", "q"),
        (f"{Q}std::thread t([&q]() {{ q.keep_last(7); }}); t.join();", "q"),
        (f"{Q}auto t = std::make_unique<std::thread>(tune, std::ref(q)); t->join();", "q"),
        ("std::thread t(&Driver::mine, this); t.join();", "qos_"),
        (f"{Q}std::async(tune, std::ref(q)).get();", "q"),
        (f"{Q}auto r = std::async(std::launch::async, tune, std::ref(q)); r.get();", "q"),
        (f"{Q}std::invoke(tune, q);", "q"),
        (f"{Q}std::invoke(&Driver::change, this, q);", "q"),
        (f"{Q}std::invoke(&rclcpp::QoS::reliable, q);", "q"),
        (f"{Q}std::apply(tune, std::tie(q));", "q"),
        (f"{Q}std::once_flag once; std::call_once(once, tune, std::ref(q));", "q"),
        (f"{Q}std::function<void(rclcpp::QoS &)> f = tune; f(q);", "q"),
        (f"{Q}auto f = tune; f(q);", "q"),
        (f"{Q}auto f = &tune; f(q);", "q"),
        (f"{Q}auto f = &tune; (*f)(q);", "q"),
        (f"{Q}void (*f)(rclcpp::QoS &) = tune; f(q);", "q"),
        (f"{Q}auto m = &Driver::change; (this->*m)(q);", "q"),
        ("auto m = &Driver::mine; (this->*m)();", "qos_"),
        (f"{Q}auto m = &rclcpp::QoS::reliable; (q.*m)();", "q"),
        (f"{Q}auto m = &rclcpp::QoS::reliable; auto p = &q; (p->*m)();", "q"),
        (f"{Q}auto f = std::mem_fn(&rclcpp::QoS::reliable); f(q);", "q"),
        (f"{Q}std::mem_fn(&Driver::change)(this, q);", "q"),
        (f"{Q}[&]() {{ q.keep_last(7); }}();", "q"),
        (f"{Q}std::vector<std::function<void()>> fs{{[&]() {{ q.keep_last(7); }}}}; for (auto & f : fs) {{ f(); }}", "q"),
        (f"{Q}std::vector<std::function<void()>> fs; fs.push_back([&]() {{ q.keep_last(7); }}); fs[0]();", "q"),
        (f"{Q}elsewhere([&]() {{ q.keep_last(7); }});", "q"),
        (f"{Q}elsewhere(std::bind(tune, std::ref(q)));", "q"),
        (f"{Q}auto f = [&]() {{ auto g = [&]() {{ q.keep_last(7); }}; g(); }}; f();", "q"),
        ("elsewhere(std::bind(&Driver::mine, this));", "qos_"),
        (f"{Q}auto h = std::make_shared<lib::Helper>(q);", "q"),
        (f"{Q}lib::Helper h(q);", "q"),
        (f"{Q}lib::Helper h(&q); h.run();", "q"),
        (f"{Q}std::for_each(all_.begin(), all_.end(), [&](auto & r) {{ q.keep_last(7); }});", "q"),
        (f"{Q}while (elsewhere(q)) {{}}", "q"),
        (f"{Q}do {{ elsewhere(); }} while (elsewhere(q));", "q"),
        (f"{Q}for (int i = 0; elsewhere(q); ++i) {{}}", "q"),
        (f"{Q}for (int i = 0; i < 3; elsewhere(q)) {{}}", "q"),
        (f"{Q}switch (elsewhere(q)) {{ case 1: break; }}", "q"),
        (f"{Q}throw_if(elsewhere(q));", "q"),
        (f"{Q}if (auto n = elsewhere(q); n) {{}}", "q"),
        (f"{Q}int a[] = {{elsewhere(q)}};", "q"),
        (f"{Q}auto n = static_cast<int>(elsewhere(q));", "q"),
        (f"{Q}auto n = (int)elsewhere(q);", "q"),
        (f"{Q}auto n = elsewhere(q) ? 1 : 2;", "q"),
        (f"{Q}assert(elsewhere(q));", "q"),
        (f'{Q}RCLCPP_INFO(get_logger(), "%d", elsewhere(q));', "q"),
        (f"{Q}std::cout << elsewhere(q);", "q"),
        (f"{Q}auto * n = new lib::Helper(q);", "q"),
        (f"{Q}delete elsewhere(q);", "q"),
        (f"{Q}sizeof(q); elsewhere(1, {{q, q}}, &q);", "q"),
        (f"{Q}elsewhere >> q;", "q"),
        # structured bindings, pairs and tuples
        (f"{Q}rclcpp::QoS o(5); auto pair = std::tie(q, o); auto & [a, b] = pair; a.keep_last(7);", "q"),
        (f"{Q}auto [a, b] = std::tie(q, qos_); a.keep_last(7);", "q"),
        (f"{Q}std::pair<rclcpp::QoS &, int> p(q, 1); auto & [a, b] = p; a.keep_last(7);", "q"),
        (f"{Q}std::pair<rclcpp::QoS &, int> p(q, 1); p.first.keep_last(7);", "q"),
        (f"{Q}std::pair<rclcpp::QoS &, int> p{{q, 1}}; p.first.keep_last(7);", "q"),
        (f"{Q}std::tuple<rclcpp::QoS &, int> t(q, 1); std::get<0>(t).keep_last(7);", "q"),
        ("std::pair<rclcpp::QoS, int> p{rclcpp::QoS(5), 1}; auto & [a, b] = p; a.keep_last(7);", "p.first"),
        ("std::pair<rclcpp::QoS, int> p{rclcpp::QoS(5), 1}; p.first.keep_last(7);", "p.first"),
        ("auto p = std::make_pair(rclcpp::QoS(5), 1); auto & [a, b] = p; a.keep_last(7);", "p.first"),
        ("auto p = std::make_pair(rclcpp::QoS(5), 1); p.first.keep_last(7);", "p.first"),
        (f"{Q}auto p = std::make_pair(std::ref(q), 1); p.first.get().keep_last(7);", "q"),
        (f"{Q}auto t = std::forward_as_tuple(q); std::get<0>(t).keep_last(7);", "q"),
        ("for (auto & [n, r] : by_name_) { r.keep_last(7); }", 'by_name_.at("a")'),
        ("for (auto & each : by_name_) { each.second.keep_last(7); }", 'by_name_.at("a")'),
        ("auto & [a] = config_; a.keep_last(7);", "config_.qos"),
        (f"{Q}std::reference_wrapper<rclcpp::QoS> r(q); r.get().keep_last(7);", "q"),
        (f"{Q}std::vector<std::reference_wrapper<rclcpp::QoS>> v{{q}}; v[0].get().keep_last(7);", "q"),
        (f"{Q}std::vector<std::reference_wrapper<rclcpp::QoS>> v; v.push_back(q); v[0].get().keep_last(7);", "q"),
        (f"{Q}std::vector<rclcpp::QoS *> v; v.push_back(&q); v[0]->keep_last(7);", "q"),
        ("std::optional<rclcpp::QoS> o = rclcpp::QoS(5); o->keep_last(7);", "*o"),
        ("std::optional<rclcpp::QoS> o(rclcpp::QoS(5)); o.value().keep_last(7);", "o.value()"),
        ("auto p = std::make_unique<rclcpp::QoS>(5); auto * r = p.get(); r->keep_last(7);", "*p"),
        ("auto p = std::make_shared<Config>(); auto r = p; r->qos.keep_last(7);", "p->qos"),
        # iterators
        ("auto it = all_.begin(); it->keep_last(7);", "all_[0]"),
        ("auto it = all_.begin(); (*it).keep_last(7);", "all_[0]"),
        ("auto it = all_.begin(); it->get_rmw_qos_profile().depth = 7;", "all_[0]"),
        ("auto it = all_.begin(); (*it).get_rmw_qos_profile().depth = 7;", "all_[0]"),
        ("auto it = all_.begin(); *it = rclcpp::QoS(7);", "all_[0]"),
        ("*all_.begin() = rclcpp::QoS(7);", "all_[0]"),
        ("auto it = all_.begin(); ++it; it->keep_last(7);", "all_[1]"),
        ("auto it = all_.begin(); it++; it->keep_last(7);", "all_[1]"),
        ("auto it = all_.begin(); it += 1; it->keep_last(7);", "all_[1]"),
        ("auto it = all_.begin(); std::advance(it, 1); it->keep_last(7);", "all_[1]"),
        ("std::next(all_.begin())->keep_last(7);", "all_[1]"),
        ("std::prev(all_.end())->keep_last(7);", "all_[1]"),
        ("(all_.begin() + 1)->keep_last(7);", "all_[1]"),
        ("auto it = all_.begin() + 1; it->keep_last(7);", "all_[1]"),
        ("(*(all_.begin() + 1)).keep_last(7);", "all_[1]"),
        ("all_.begin()[1].keep_last(7);", "all_[1]"),
        ("all_.rbegin()->keep_last(7);", "all_[1]"),
        ("std::begin(all_)->keep_last(7);", "all_[0]"),
        ("for (auto it = all_.begin(); it != all_.end(); ++it) { it->keep_last(7); }", "all_[0]"),
        ("for (auto it = all_.begin(); it != all_.end(); ++it) { *it = rclcpp::QoS(7); }", "all_[0]"),
        ("for (size_t i = 0; i < all_.size(); ++i) { all_[i].keep_last(7); }", "all_[0]"),
        ("for (size_t i = 0; i < all_.size(); ++i) { auto & r = all_.at(i); r.keep_last(7); }", "all_[0]"),
        ("for (size_t i = 0; i < all_.size(); ++i) { all_[i] = rclcpp::QoS(7); }", "all_[0]"),
        ("all_.front().keep_last(7);", "all_[0]"),
        ("all_.front() = rclcpp::QoS(7);", "all_[0]"),
        ("all_.front() = rclcpp::QoS(7);", "all_.front()"),
        ("all_.back().keep_last(7);", "all_[1]"),
        ("all_.back() = rclcpp::QoS(7);", "all_[1]"),
        ("all_.at(0).get_rmw_qos_profile().depth = 7;", "all_[0]"),
        ("all_.at(0) = rclcpp::QoS(7);", "all_.at(0)"),
        ("all_.data()->keep_last(7);", "all_[0]"),
        ("auto & r = all_.front(); r.keep_last(7);", "all_[0]"),
        ("std::deque<rclcpp::QoS> v; v.push_front(rclcpp::QoS(5)); v.front().keep_last(7);", "v[0]"),
        ('by_name_.find("a")->second.keep_last(7);', 'by_name_.at("a")'),
        ('auto it = by_name_.find("a"); it->second.keep_last(7);', 'by_name_.at("a")'),
        ('auto it = by_name_.find("a"); it->second = rclcpp::QoS(7);', 'by_name_.at("a")'),
        ('if (auto it = by_name_.find("a"); it != by_name_.end()) { it->second.keep_last(7); }', 'by_name_.at("a")'),
        ("by_name_.begin()->second.keep_last(7);", 'by_name_.at("a")'),
        ('by_name_.insert_or_assign("a", rclcpp::QoS(7));', 'by_name_.at("a")'),
        ('by_name_["a"] = rclcpp::QoS(7);', 'by_name_.at("a")'),
        ("std::for_each(all_.begin(), all_.end(), tune);", "all_[0]"),
        ("std::for_each(all_.begin(), all_.end(), [](auto & r) { r.keep_last(7); });", "all_[0]"),
        ("std::for_each(all_.begin(), all_.begin() + 1, tune);", "all_[0]"),
        ("std::for_each_n(all_.begin(), 1, tune);", "all_[0]"),
        ("std::ranges::for_each(all_, tune);", "all_[0]"),
        ("std::for_each(std::begin(all_), std::end(all_), tune);", "all_[0]"),
        ("auto b = all_.begin(); auto e = all_.end(); std::for_each(b, e, tune);", "all_[0]"),
        ("std::transform(all_.begin(), all_.end(), all_.begin(), [](auto r) { return r.keep_last(7); });", "all_[0]"),
        ("std::fill(all_.begin(), all_.end(), rclcpp::QoS(7));", "all_[0]"),
        ("std::generate(all_.begin(), all_.end(), []() { return rclcpp::QoS(7); });", "all_[0]"),
        ("std::vector<rclcpp::QoS> o{rclcpp::QoS(7), rclcpp::QoS(7)}; std::copy(o.begin(), o.end(), all_.begin());", "all_[0]"),
        ("std::vector<rclcpp::QoS> o{rclcpp::QoS(7), rclcpp::QoS(7)}; std::swap(all_, o);", "all_[0]"),
        ("std::vector<rclcpp::QoS> o{rclcpp::QoS(7), rclcpp::QoS(7)}; all_.swap(o);", "all_[0]"),
        ("std::vector<rclcpp::QoS> o{rclcpp::QoS(7), rclcpp::QoS(7)}; all_ = o;", "all_[0]"),
        ("all_.assign(2, rclcpp::QoS(7));", "all_[0]"),
        ("all_.insert(all_.begin(), rclcpp::QoS(7));", "all_[0]"),
        ("all_.erase(all_.begin()); all_.push_back(rclcpp::QoS(7));", "all_[1]"),
        ("rclcpp::QoS a[2] = {rclcpp::QoS(5), rclcpp::QoS(5)}; a[0].keep_last(7);", "a[0]"),
        ("rclcpp::QoS a[2] = {rclcpp::QoS(5), rclcpp::QoS(5)}; auto * p = a; p->keep_last(7);", "a[0]"),
        ("rclcpp::QoS a[2] = {rclcpp::QoS(5), rclcpp::QoS(5)}; for (auto & r : a) { r.keep_last(7); }", "a[0]"),
        # globals and statics that something else changes
        ("", "global"),
        ("", "hidden"),
        ("", "bot::inner"),
        ("", "Shared::qos"),
        ("auto & r = global;", "r"),
        # macros
        ("TUNE(qos_);", "qos_"),
        ("TUNE_MINE();", "qos_"),
        ("TUNE_ALL(qos_);", "qos_"),
        ("TUNE_ELSEWHERE(qos_);", "qos_"),
        (f"{Q}TUNE_ELSEWHERE(q)", "q"),
        # objects that hold one
        ("elsewhere(config_);", "config_.qos"),
        ("elsewhere(&config_);", "config_.qos"),
        ("elsewhere(outer_);", "outer_.config.qos"),
        ("elsewhere(outer_.config);", "outer_.config.qos"),
        ("auto p = std::make_shared<Config>(); elsewhere(p);", "p->qos"),
        ("std::vector<Config> v{Config()}; elsewhere(v);", "v[0].qos"),
        ("std::vector<Config> v(1); v[0].qos.keep_last(7);", "v[0].qos"),
        ("elsewhere(all_);", "all_[0]"),
        ("elsewhere(all_.begin());", "all_[0]"),
        ("elsewhere.set(config_);", "config_.qos"),
        ("elsewhere.set(qos_);", "qos_"),
        # casts
        (f"{Q}const auto & c = q; const_cast<rclcpp::QoS &>(c).keep_last(7);", "q"),
        (f"{Q}static_cast<rclcpp::QoS &>(q).keep_last(7);", "q"),
        (f"{Q}auto && r = q; r.keep_last(7);", "q"),
        (f"{Q}(q).keep_last(7);", "q"),
        (f"{Q}(&q)->keep_last(7);", "q"),
        (f"{Q}auto p = std::addressof(q); p->keep_last(7);", "q"),
        (f"{Q}same(same(q)).keep_last(7);", "q"),
        (f"{Q}rclcpp::QoS & r = same(q); r.keep_last(7);", "q"),
        (f"{Q}q = std::move(q).keep_last(7);", "q"),
        (f"{Q}(elsewhere(), q).keep_last(7);", "q"),
        (f"{Q}rclcpp::QoS o(5); (elsewhere() ? q : o).keep_last(7);", "q"),
    ],
)  # fmt: skip
def test_a_change_in_cpp_is_seen_or_makes_it_unknown(cpp, body, qos):
    found = policies(cpp(f'{body} create_publisher<std_msgs::msg::String>("x", {qos});', MEMBERS, FUNCTIONS))
    assert found in (UNKNOWN, SEVEN) or "reliability" in found


@pytest.mark.parametrize(
    ("body", "qos"),
    [
        ('create_publisher<std_msgs::msg::Empty>("y", qos_);', "qos_"),
        ("auto f = std::bind(&Driver::mine, this); auto g = std::bind(read, qos_); g();", "config_.qos"),
        (f"{Q}auto f = std::bind(tune, q); f();", "q"),
        (f"{Q}auto f = std::bind(read, std::cref(q)); f();", "q"),
        (f"{Q}read(q); std::cout << q.depth();", "q"),
        (f'{Q}RCLCPP_INFO(get_logger(), "%zu", q.depth());', "q"),
        (f'{Q}RCLCPP_INFO_STREAM(get_logger(), "qos " << q.depth());', "q"),
        (f"{Q}auto o = std::max(q.depth(), all_.size());", "q"),
        (f"{Q}auto o = std::make_shared<rclcpp::QoS>(q); o->keep_last(7);", "q"),
        (f"{Q}rclcpp::QoS o = q; o.keep_last(7);", "q"),
        (f"{Q}if (q == rclcpp::QoS(5)) {{ elsewhere(); }}", "q"),
        ("print(all_.size(), all_.empty());", "all_[0]"),
        ("for (const auto & r : all_) { read(r); }", "all_[0]"),
        ("auto r = all_.front(); r.keep_last(7);", "all_[0]"),
        ("auto it = all_.begin(); print(it->depth());", "all_[0]"),
        ("all_.push_back(qos_);", "qos_"),
        ("", "kept"),
        ("", "qos_"),
        (f'{Q}message_filters::Subscriber<std_msgs::msg::Empty> s; s.subscribe(this, "y", q.get_rmw_qos_profile());', "q"),
        (f'{Q}image_transport::create_publisher(this, "y", q.get_rmw_qos_profile());', "q"),
        ("elsewhere(this);", "qos_"),
        ("auto o = std::make_shared<tf2_ros::TransformListener>(*buffer_, this);", "qos_"),
    ],
)  # fmt: skip
def test_what_changes_nothing_in_cpp_keeps_it_known(cpp, body, qos):
    found = cpp(f'{body} create_publisher<std_msgs::msg::String>("x", {qos});', MEMBERS, FUNCTIONS)
    assert policies({"publishes": {"x": found["publishes"]["x"]}}) == FIVE


@pytest.mark.parametrize(
    ("body", "qos"),
    [
        # what names and members mean
        (f"{M}self.mine.depth = 7", "self.qos"),
        (f"{M}r = self.mine\nr.depth = 7", "self.qos"),
        (f"{M}self.cached.depth = 7", "self.qos"),
        (f"{M}self.mine = 3", "self.qos"),
        (f"{M}tune(self.mine)", "self.qos"),
        (f"{M}self.qos.depth = 7", "self.mine"),
        (f"{M}self.__dict__['qos'].depth = 7", "self.qos"),
        (f"{M}vars(self)['qos'].depth = 7", "self.qos"),
        (f"{M}operator.attrgetter('qos')(self).depth = 7", "self.qos"),
        (f"{P}a, b = pair(q)\na.depth = 7", "q"),
        (f"{M}a, b = self.two()\na.depth = 7", "self.qos"),
        (f"{P}(a, b), c = (q, 1), 2\na.depth = 7", "q"),
        (f"{P}a, *b = q, 1, 2\na.depth = 7", "q"),
        (f"{P}*a, b = q, 1\na[0].depth = 7", "q"),
        (f"{P}[a] = [q]\na.depth = 7", "q"),
        (f"{P}pair(q)[0].depth = 7", "q"),
        (f"{P}(r := q).depth = 7", "q"),
        (f"{P}(r := pair(q)[0]).depth = 7", "q"),
        (f"{M}print(r := self.mine)\nr.depth = 7", "self.qos"),
        (f"{P}if (r := elsewhere(q)):\n    r.depth = 7", "q"),
        (f"{P}(q if elsewhere() else None).depth = 7", "q"),
        (f"{P}h = Holder(q)\nh.qos.depth = 7", "q"),
        (f"{P}h = Holder(q)\nh.qos.depth = 7", "h.qos"),
        ("", "NEVER"),
        (f"{P}globals()['SHARED'].depth = 7", "SHARED"),
        ("exec('SHARED.depth = 7')", "SHARED"),
        (f"{P}exec('q.depth = 7')", "q"),
        (f"{P}eval('tune(q)')", "q"),
        (f"{P}locals()['q'].depth = 7", "q"),
        (f"{P}eval('q').depth = 7", "q"),
        (f"{M}exec('self.qos.depth = 7')", "self.qos"),
        (f"{P}q.depth, a = 7, 1", "q"),
        (f"{P}for q.depth in [7]:\n    pass", "q"),
        (f"{P}with elsewhere() as q.depth:\n    pass", "q"),
        (f"{P}del q.depth", "q"),
        # functions as values
        (f"{P}functools.partial(tune, q)()", "q"),
        (f"{P}f = partial(tune, q)\nf()", "q"),
        (f"{P}f = partial(tune, q=q)\nf()", "q"),
        (f"{P}f = partial(partial(hand, q))\nf()", "q"),
        (f"{P}f = partial(setattr, q, 'depth')\nf(7)", "q"),
        (f"{P}f = partial(elsewhere, q)\nf()", "q"),
        (f"{P}elsewhere(partial(tune, q))", "q"),
        (f"{P}lib.Helper(q)", "q"),
        (f"{P}lib.Helper(qos=q)", "q"),
        (f"{P}async def f():\n    q.depth = 7\nf()", "q"),
        (f"{P}def f():\n    def g():\n        q.depth = 7\n    g()\nf()", "q"),
        (f"{P}def f():\n    return lambda: setattr(q, 'depth', 7)\nf()()", "q"),
        (f"{P}class Inner:\n    q.depth = 7", "q"),
        (f"{P}class Inner:\n    def run(self):\n        q.depth = 7\nInner().run()", "q"),
        (f"{P}elsewhere.attribute = q", "q"),
        (f"{P}lib.shared = q\nlib.tune()", "q"),
        (f"{P}h = lib.Helper()\nh.qos = q\nh.run()", "q"),
        (f"{M}b = Below(1)\nb.qos = self.qos\nb.run()", "self.qos"),
        (f"{P}x = elsewhere(q) < 3", "q"),
        (f"{P}return_value = yield_from = elsewhere(q)", "q"),
        (f"{P}raise_it = [elsewhere(q)]", "q"),
        (f"{P}try:\n    raise ValueError(q)\nexcept ValueError as e:\n    e.args[0].depth = 7", "q"),
        (f"{P}type(q).depth.fset(q, 7)", "q"),
        (f"{P}QoSProfile.depth.fset(q, 7)", "q"),
        (f"{P}QoSProfile.__init__(q, depth=7)", "q"),
        (f"{P}s = q.__setattr__\ns('depth', 7)", "q"),
        (f"{P}q.__setattr__('depth', 7)", "q"),
        (f"{P}s = setattr\ns(q, 'depth', 7)", "q"),
        (f"{P}s = object.__setattr__\ns(q, 'depth', 7)", "q"),
        (f"{P}f = tune\nf(q)", "q"),
        (f"{P}f = elsewhere\nf(q)", "q"),
        (f"{P}{{'a': tune}}['a'](q)", "q"),
        (f"{P}{{'a': elsewhere}}['a'](q)", "q"),
        (f"{P}[tune][0](q)", "q"),
        (f"{P}for f in (tune,):\n    f(q)", "q"),
        (f"{P}for f in elsewhere():\n    f(q)", "q"),
        (f"{P}(tune if elsewhere() else read)(q)", "q"),
        (f"{P}f = tune if elsewhere() else read\nf(q)", "q"),
        (f"{P}(lambda r: setattr(r, 'depth', 7))(q)", "q"),
        (f"{P}f = lambda r: setattr(r, 'depth', 7)\nf(q)", "q"),
        (f"{P}(lambda: setattr(q, 'depth', 7))()", "q"),
        (f"{P}f = lambda r=q: setattr(r, 'depth', 7)\nf()", "q"),
        (f"{P}(lambda r: r)(q).depth = 7", "q"),
        (f"{P}def f():\n    q.depth = 7\nf()", "q"),
        (f"{P}def f(r=q):\n    r.depth = 7\nf()", "q"),
        (f"{P}def f():\n    q.depth = 7\nelsewhere(f)", "q"),
        (f"{P}elsewhere(lambda: setattr(q, 'depth', 7))", "q"),
        (f"{P}@elsewhere\ndef f():\n    q.depth = 7", "q"),
        (f"{P}Caller()(q)", "q"),
        (f"{P}c = Caller()\nc(q)", "q"),
        (f"{P}operator.setitem(vars(q), '_depth', 7)", "q"),
        (f"{P}wrapped(q)", "q"),
        (f"{P}decorated(q)", "q"),
        (f"{M}self.wrapped()", "self.qos"),
        (f"{P}self.of_class(q)", "q"),
        (f"{P}Driver.of_class(q)", "q"),
        (f"{M}f = self.change\nf()", "self.qos"),
        (f"{M}getattr(self, 'change')()", "self.qos"),
        (f"{M}Driver.change(self)", "self.qos"),
        (f"{M}threading.Thread(target=self.change).start()", "self.qos"),
        (f"{P}t = threading.Thread(target=tune, args=(q,))\nt.start()", "q"),
        (f"{P}threading.Thread(target=tune, kwargs={{'q': q}}).start()", "q"),
        (f"{P}threading.Thread(target=lambda: tune(q)).start()", "q"),
        (f"{P}threading.Timer(1.0, tune, [q]).start()", "q"),
        (f"{P}lib.pool.submit(tune, q)", "q"),
        # arguments
        (f"{P}rest(q)", "q"),
        (f"{P}rest(q, 1)", "q"),
        (f"{P}named(q=q)", "q"),
        (f"{P}hand(q)", "q"),
        (f"{P}hand(q=q)", "q"),
        (f"{P}tune(*[q])", "q"),
        (f"{P}a = [q]\ntune(*a)", "q"),
        (f"{P}tune(**{{'q': q}})", "q"),
        (f"{P}a = {{'q': q}}\ntune(**a)", "q"),
        (f"{P}a = {{'q': q, **elsewhere()}}\ntune(**a)", "q"),
        (f"{P}elsewhere(*[q])", "q"),
        (f"{P}elsewhere(**{{'q': q}})", "q"),
        (f"{P}elsewhere({{'a': [q]}})", "q"),
        (f"{P}elsewhere(Holder(q))", "q"),
        (f"{P}h = Holder(q)\nlib.f(h)", "q"),
        (f"{P}h = Holder(q)\nlib.f([h])", "h.qos"),
        (f"{P}h = Holder(Holder(q))\nlib.f(h)", "q"),
        (f"{M}lib.f(self)", "self.qos"),
        (f"{M}self.helper = lib.Helper(self)", "self.qos"),
        (f"{M}lib.f(node=self)", "self.qos"),
        (f"{M}self.profiles = {{'a': self.qos}}\nlib.f(self)", "self.qos"),
        (f"{P}elsewhere.append(q)\nelsewhere[0].depth = 7", "q"),
        (f"{P}Below(q)", "q"),
        (f"{P}Tuned(q)", "q"),
        # loops
        (f"{M}self.profiles = {{'a': self.qos}}\nfor r in self.profiles.values():\n    r.depth = 7", "self.qos"),
        (f"{M}self.profiles = {{'a': self.qos}}\nfor n in self.profiles:\n    self.profiles[n].depth = 7", "self.qos"),
        (f"{M}self.profiles = {{'a': self.qos}}\nfor n, r in self.profiles.items():\n    setattr(r, 'depth', 7)", "self.qos"),
        (f"{P}list(map(tune, [q]))", "q"),
        (f"{P}list(map(elsewhere, [q]))", "q"),
        (f"{P}list(map(lambda r: setattr(r, 'depth', 7), [q]))", "q"),
        (f"{P}for _ in map(tune, [q]):\n    pass", "q"),
        (f"{P}list(filter(tune, [q]))", "q"),
        (f"{P}functools.reduce(lambda a, r: tune(r), [q], 0)", "q"),
        (f"{P}sorted([q], key=tune)", "q"),
        (f"{P}max([q], key=lambda r: tune(r))", "q"),
        (f"{P}list(itertools.starmap(tune, [(q,)]))", "q"),
        (f"{P}for r, n in zip([q], [1]):\n    r.depth = 7", "q"),
        (f"{P}for n, r in enumerate([q]):\n    r.depth = 7", "q"),
        (f"{P}for r in itertools.chain([q], []):\n    r.depth = 7", "q"),
        (f"{P}for r in reversed([q]):\n    r.depth = 7", "q"),
        (f"{P}for r in [q] + []:\n    r.depth = 7", "q"),
        (f"{P}for r in [q][:1]:\n    r.depth = 7", "q"),
        (f"{P}for r in {{q}}:\n    r.depth = 7", "q"),
        (f"{P}for r in each(q):\n    r.depth = 7", "q"),
        (f"{P}for r in (x for x in [q]):\n    r.depth = 7", "q"),
        (f"{P}for r in [x for x in [q] if x]:\n    r.depth = 7", "q"),
        (f"{P}for r in [x for a in [[q]] for x in a]:\n    r.depth = 7", "q"),
        (f"{P}next(iter([q])).depth = 7", "q"),
        (f"{P}[q].pop().depth = 7", "q"),
        (f"{P}a = [q]\na.pop(0).depth = 7", "q"),
        (f"{P}a = []\na += [q]\na[0].depth = 7", "q"),
        (f"{P}a = []\na.extend([q])\na[0].depth = 7", "q"),
        (f"{P}a = {{}}\na['x'] = q\na['x'].depth = 7", "q"),
        (f"{P}a = {{}}\na.update(x=q)\na['x'].depth = 7", "q"),
        (f"{P}a = {{}}\na.setdefault('x', q).depth = 7", "q"),
        (f"{P}a = dict(x=q)\na['x'].depth = 7", "q"),
        (f"{P}a = {{**{{'x': q}}}}\na['x'].depth = 7", "q"),
        (f"{P}a = [*[q]]\na[0].depth = 7", "q"),
        (f"{P}[tune(r) for r in [q]]", "q"),
        (f"{P}[tune(r) for r in [q] if r]", "q"),
        (f"{P}[setattr(r, 'depth', 7) for r in [q] if r.depth]", "q"),
        (f"{P}[1 for r in [q] if tune(r)]", "q"),
        (f"{P}[tune(r) for a in [[q]] for r in a]", "q"),
        (f"{P}[tune(r) for r in elsewhere(q)]", "q"),
        (f"{P}{{tune(r) for r in [q]}}", "q"),
        (f"{P}{{n: tune(r) for n, r in {{'a': q}}.items()}}", "q"),
        (f"{P}any(tune(r) for r in [q])", "q"),
        (f"{P}[tune(q) for _ in range(3)]", "q"),
        (f"{P}[tune(q) for _ in elsewhere()]", "q"),
        (f"{P}while tune(q):\n    pass", "q"),
        # with, match, try and other statements
        (f"{P}with elsewhere(q):\n    pass", "q"),
        (f"{P}with elsewhere(q) as r:\n    r.depth = 7", "q"),
        (f"{P}with contextlib.nullcontext(q) as r:\n    r.depth = 7", "q"),
        (f"{P}with context(q):\n    pass", "q"),
        (f"{P}with context(q) as r:\n    r.depth = 7", "q"),
        (f"{P}with Context(q):\n    pass", "q"),
        (f"{P}with Context(q) as r:\n    r.depth = 7", "q"),
        (f"{P}with elsewhere():\n    q.depth = 7", "q"),
        (f"{P}match q:\n    case r:\n        r.depth = 7", "q"),
        (f"{P}match [q]:\n    case [r]:\n        r.depth = 7", "q"),
        (f"{P}try:\n    elsewhere()\nexcept ValueError:\n    q.depth = 7", "q"),
        (f"{P}try:\n    elsewhere()\nfinally:\n    q.depth = 7", "q"),
        (f"{P}assert tune(q) is None", "q"),
        (f"{P}x = not tune(q)", "q"),
        (f"{P}x = 1 < tune(q) < 3", "q"),
        (f"{P}x = f'{{tune(q)}}'", "q"),
        (f"{P}x = [1, 2][tune(q):]", "q"),
        (f"{P}x = {{**{{'a': tune(q)}}}}", "q"),
        (f"{P}elsewhere(*[tune(q)])", "q"),
        (f"{P}elsewhere() and tune(q)", "q"),
        (f"{P}x = tune(q) if elsewhere() else None", "q"),
        (f"{P}if elsewhere() and tune(q):\n    pass", "q"),
        (f"{P}x = q.__init__(depth=7)", "q"),
    ],
)  # fmt: skip
def test_a_change_in_python_is_seen_or_makes_it_unknown(python, body, qos):
    assert policies(python(f"{body}\nself.create_publisher(String, 'x', {qos})", METHODS, HELPERS)) in (UNKNOWN, SEVEN)


@pytest.mark.parametrize(
    ("body", "qos"),
    [
        (f"{P}self.create_subscription(String, 'y', print, q)", "q"),
        (f"{P}self.create_subscription(String, 'y', partial(read, q), q)", "q"),
        (f"{P}self.create_subscription(String, 'y', lambda m: read(q), qos_profile=q)", "q"),
        (f"{P}message_filters.Subscriber(self, String, 'y', qos_profile=q)", "q"),
        (f"{P}self.get_logger().info(f'{{q}}')", "q"),
        (f"{P}self.get_logger().info('qos %s' % q)", "q"),
        (f"{P}logging.info('%s', q)", "q"),
        (f"{P}print(q, '{{}}'.format(q), str(q), repr(q), format(q), q == q, q != 3, q is None)", "q"),
        (f"{P}print(len([q]), isinstance(q, QoSProfile), hash(q), id(q), type(q))", "q"),
        (f"{P}r = copy.copy(q)\nr.depth = 7", "q"),
        (f"{P}r = copy.deepcopy(q)\nelsewhere(r)", "q"),
        (f"{P}r = QoSProfile(depth=q.depth)\nr.depth = 7", "q"),
        (f"{P}elsewhere(q.depth)", "q"),
        (f"{P}read(q)", "q"),
        (f"{P}partial(read, q)()", "q"),
        (f"{P}list(map(read, [q]))", "q"),
        (f"{P}[read(r) for r in [q]]", "q"),
        (f"{P}with elsewhere():\n    read(q)", "q"),
        (f"{P}a = [q, QoSProfile(depth=5)]\na[1].depth = 7", "q"),
        (f"{M}self.other = QoSProfile(depth=5)\nself.other.depth = 7", "self.qos"),
        (f"{M}self.create_timer(1.0, self.two)", "self.qos"),
        (f"{M}rclpy.spin_once(self)", "self.qos"),
        (f"{M}read(self.mine)", "self.qos"),
        (f"{M}elsewhere(self.get_name())", "self.qos"),
        (f"{M}threading.Thread(target=self.two).start()", "self.qos"),
        (f"{M}self.tf = tf2_ros.TransformListener(tf2_ros.Buffer(), self)", "self.qos"),
        (f"{M}super().destroy_node", "self.qos"),
        ("", "LOCAL"),
    ],
)  # fmt: skip
def test_what_changes_nothing_in_python_keeps_it_known(python, body, qos):
    found = python(
        f"{body}\nself.create_publisher(String, 'x', {qos})",
        READING,
        HELPERS.replace("import lib", "import lib, tf2_ros"),
    )
    assert policies({"publishes": {"x": found["publishes"]["x"]}}) == FIVE
