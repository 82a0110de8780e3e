"""The endpoints of a large file are a list of endpoints for every purpose, and a check changes nothing in them."""

import copy
import pickle
from dataclasses import replace

import pytest

import cqos_core as cqos
from cqos_core import Endpoint, Setting
from tests.benchmarks import inputs

FORMS = (inputs.system_file, inputs.diagram)
SIZE = 1_200


def read(form) -> list[Endpoint]:
    return cqos.read(b"".join(form(SIZE))).endpoints


@pytest.mark.parametrize("form", FORMS)
class TestEndpoints:
    def test_are_objects_that_stay(self, form):
        endpoints = read(form)
        assert isinstance(endpoints, list)
        assert len(endpoints) == SIZE
        first, last = endpoints[0], endpoints[-1]
        assert isinstance(first, Endpoint)
        assert (endpoints[0], endpoints[SIZE - 1]) == (first, last)
        assert endpoints[0] is first
        first.topic = "other"
        assert next(iter(endpoints)) is first
        assert endpoints[:1] == [first]
        assert first != read(form)[0]

    def test_are_a_list(self, form):
        plain, endpoints = [*read(form)], read(form)
        assert endpoints == plain == read(form)
        assert plain == read(form)
        assert endpoints != plain[1:]
        assert read(form) + plain[:1] == plain + plain[:1]
        joined, filled, grown = plain[:1] + read(form), plain[:1], plain[:1]
        same, filled[:] = grown, read(form)
        grown += read(form)
        assert same is grown
        assert (joined, filled, grown) == (plain[:1] + plain, plain, plain[:1] + plain)
        assert all(isinstance(each, Endpoint) for each in (*joined, *filled, *grown))
        assert [*reversed(read(form))] == plain[::-1]
        assert plain[5] in read(form)
        assert read(form).index(plain[5]) == 5
        assert read(form).pop() == plain[-1]
        assert sorted(read(form), key=lambda each: each.id) == sorted(plain, key=lambda each: each.id)
        assert repr(read(form)) == repr(plain)
        for made in (read(form).copy(), copy.copy(read(form)), copy.deepcopy(read(form))):
            assert made == plain
        assert pickle.loads(pickle.dumps(read(form))) == plain  # noqa: S301 - our own

    def test_take_other_objects(self, form):
        endpoints = read(form)
        more = [replace(endpoints[0], id="new"), replace(endpoints[1], id="newer")]
        endpoints.append(more[0])
        endpoints += more[1:]
        endpoints.insert(0, more[0])
        del endpoints[1]
        assert [endpoints[0], *endpoints[-2:]] == [more[0], *more]
        assert len(endpoints) == SIZE + 2

    def test_are_endpoints_for_every_purpose(self, form):
        endpoint = read(form)[7]
        for made in (
            pickle.loads(pickle.dumps(read(form)[7])),  # noqa: S301 - our own
            copy.deepcopy(read(form)[7]),
            replace(read(form)[7]),
        ):
            assert isinstance(made, Endpoint)
            assert made == endpoint
            assert endpoint == made
        assert repr(endpoint).startswith("Endpoint(id=")
        assert not hasattr(endpoint, "colour")
        endpoint.settings["depth"] = Setting("8")
        assert endpoint != read(form)[7]


@pytest.mark.parametrize("form", FORMS)
def test_a_list_of_a_program_has_the_report_of_the_file(form):
    system = cqos.read(b"".join(form(SIZE)))
    report = cqos.check(replace(system, endpoints=[*system.endpoints]))
    assert cqos.check(b"".join(form(SIZE))).to_dict() == report.to_dict()


@pytest.mark.parametrize("form", FORMS)
def test_a_change_of_the_system_does_not_reach_a_report_that_was_made_before(form):
    system = cqos.read(b"".join(form(SIZE)))
    whole = cqos.check(replace(system, endpoints=[*system.endpoints])).to_dict()
    system = cqos.read(b"".join(form(SIZE)))
    report = cqos.check(system)
    for endpoint in system.endpoints:
        endpoint.settings = {"reliability": Setting("best_effort"), "depth": Setting("0")}
        endpoint.topic = "elsewhere"
    system.endpoints.clear()
    assert report.to_dict() == whole


def test_equal_ids_of_a_program_stay_two_endpoints():
    system = cqos.read(b"".join(inputs.system_file(SIZE)))
    one, other = system.endpoints[0], system.endpoints[2]
    assert (one.role, one.topic) != (other.role, other.topic)
    other.id = one.id
    report = cqos.check(system)
    few = cqos.check(
        replace(system, endpoints=[each for each in system.endpoints if each.topic in {one.topic, other.topic}])
    )
    named = {name for group in few.groups for name in (*group.publishers, *group.subscribers)}
    assert len(named) == 4
    assert {*map(str, few.groups)} <= {*map(str, report.groups)}


SPELLINGS = {
    "on one line": '/t{0}: {{depth: {1}, "reliability": best_effort}} # {{}}',
    "in quotes": "'/t{0}': {{\"depth\": '{1}', reliability: \"best_effort\"}}",
    "on several lines": "/t{0}:\n        depth: {1}  # a\n        # b\n        reliability:\n          best_effort",
    "in brackets on several lines": '/t{0}: {{ # a\n  "depth": {1},\n\n reliability:\n  best_effort}}',
    "with a type": "/t{0}: {{depth: {1}, type: std_msgs/msg/String, reliability: best_effort}}",
    "with an id": "/t{0}: {{depth: {1}, reliability: best_effort, id: a/publisher/t{0}}}",
    "in a list": "/t{0}: [{{depth: {1}, reliability: best_effort}}]",
    "beside other letters": "/t{0}: {{depth: {1}, reliability: best_effort}}\n      # ä",
}


def of_one(lines: list[str]) -> bytes:
    text = "".join(f"      {line}\n" for line in lines)
    return f"cqos: 1\nprotocol: ros2\nparticipants:\n  a:\n    publishes:\n{text}".encode()


def stands_at(place: cqos.Place | None, data: bytes, text: str) -> bool:
    """Whether a text stands at a place, perhaps in quotes."""
    if place is None or place.line is None or place.column is None:
        return False
    line = data.decode().split("\n")[place.line - 1]
    return line[place.column - 1 :].lstrip("\"'").startswith(text)


@pytest.mark.parametrize("spelling", SPELLINGS.values(), ids=SPELLINGS)
def test_endpoints_say_where_they_stand_however_they_are_written(spelling):
    data = of_one([spelling.format(each, each + 1) for each in range(SIZE)])
    endpoint = cqos.read(data).endpoints[7]
    assert (endpoint.id, endpoint.topic, endpoint.label, endpoint.profiles) == ("a/publisher/t7", "/t7", None, ())
    assert endpoint.type == ("std_msgs/msg/String" if "type" in spelling else None)
    assert {name: each.text for name, each in endpoint.settings.items()} == {"depth": "8", "reliability": "best_effort"}
    assert all(stands_at(each.place, data, each.text) for each in endpoint.settings.values())
    assert stands_at(endpoint.place, data, "/t7")
    assert endpoint.room.place == endpoint.place


def test_several_on_one_topic_stand_where_each_begins():
    data = of_one(["/t: [", *(f"  {{depth: {each}}}," for each in range(SIZE)), "]"])
    endpoint = cqos.read(data).endpoints[7]
    assert (endpoint.id, str(endpoint.place)) == ("a/publisher/t#8", "<bytes>:14:9")


def test_what_an_alias_repeats_has_the_places_of_its_anchor():
    data = of_one(["/t: &one {depth: 5}", *(f"/t{each}: *one" for each in range(SIZE))])
    endpoint = cqos.read(data).endpoints[7]
    assert (str(endpoint.place), str(endpoint.settings["depth"].place)) == ("<bytes>:13:7", "<bytes>:6:24")


def test_ids_of_lines_give_way_as_those_of_others():
    lines = "".join(f"      /t{each}: {{depth: 1}}\n" for each in range(SIZE))
    groups = "    publishers:\n      g: {publishes: {/t7: {depth: 2}}}\n"
    text = f"cqos: 1\nprotocol: ros2\nparticipants:\n  a:\n    publishes:\n{lines}{groups}".encode()
    assert cqos.read(text).endpoints[-1].id == "a/publisher/t7#2"
    chosen = b"  b:\n    subscribes:\n      /x: {id: a/publisher/t7}\n"
    with pytest.raises(cqos.InputError, match=r"is taken, first at <bytes>:13:7"):
        cqos.read(text + chosen)
