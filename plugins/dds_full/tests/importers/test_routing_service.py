"""Configurations of RTI Routing Service as bridges, and what of them is named as not read."""

import pytest

from cqos_core import check
from cqos_core.files.inputs import read

SYSTEM = b"""cqos: 1
protocol: dds
options: {dds: {implementation: connext}}
participants:
  a: {domain: 0, publishes: {Cmd: {reliability: reliable}}}
  b: {domain: 1, subscribes: {Cmd: {reliability: %s}}}
"""
BEST_EFFORT = "<reliability><kind>BEST_EFFORT_RELIABILITY_QOS</kind></reliability>"
RELIABLE = "<reliability><kind>RELIABLE_RELIABILITY_QOS</kind></reliability>"
TOPIC = "<topic_name>Cmd</topic_name><registered_type_name>S</registered_type_name>"


def service(routes, name="R", within="", tags=('participant name="1"', 'participant name="2"')):
    first, second = (f"<{tag}><domain_id>{number}</domain_id></{tag.split()[0]}>" for number, tag in enumerate(tags))
    session = f'<session name="S">{routes}</session>'
    return f'<routing_service name="{name}">{within}<domain_route name="D">{first}{second}{session}</domain_route></routing_service>'


def topic_route(reads=RELIABLE, writes=RELIABLE, inner=""):
    start = f'<input participant="1">{TOPIC}{inner}<datareader_qos>{reads}</datareader_qos></input>'
    end = f"<output>{TOPIC}<datawriter_qos>{writes}</datawriter_qos></output>"
    return f'<topic_route name="T">{start}{end}</topic_route>'


def automatic(allow="*", deny="rti/*", second="*"):
    filters = "<allow_topic_name_filter>{}</allow_topic_name_filter><deny_topic_name_filter>{}</deny_topic_name_filter>"
    start = f'<input participant="1">{filters.format(allow, deny)}<datareader_qos>{RELIABLE}</datareader_qos></input>'
    end = f'<output participant="2">{filters.format(second, deny)}<datawriter_qos>{RELIABLE}</datawriter_qos></output>'
    return f"<auto_topic_route>{start}{end}</auto_topic_route>"


def both_ways(name, **filters):
    there = automatic(**filters)
    back = there.replace('output participant="2"', 'output participant="1"')
    return service(there + back.replace('input participant="1"', 'input participant="2"'), name=name)


def report(tmp_path, xml, reliability=b"reliable"):
    (tmp_path / "s.yaml").write_bytes(SYSTEM % reliability)
    (tmp_path / "rs.xml").write_text(f"<dds>{xml}</dds>", encoding="utf-8")
    return check(tmp_path / "s.yaml", tmp_path / "rs.xml")


def outcome(found):
    return found.verdict_words, [each.code for each in found.findings if each.severity == "error"]


@pytest.mark.parametrize(
    ("routes", "reliability", "expected"),
    [
        (topic_route(), b"reliable", ("compatible", [])),
        (topic_route(BEST_EFFORT, BEST_EFFORT), b"reliable", ("incompatible", ["DDS101"])),
        (topic_route(BEST_EFFORT, BEST_EFFORT), b"best_effort", ("compatible", [])),
        (automatic(), b"reliable", ("compatible", [])),
        (automatic("C*"), b"reliable", ("compatible", [])),
        (automatic("X,Cm?", second="C*"), b"reliable", ("compatible", [])),
        (automatic("[CS]*", second="[CS]*"), b"reliable", ("compatible", [])),
        (automatic("C*", second="*d"), b"reliable", ("compatible", [])),
        (automatic("[A-M]*[!x]", second="?[m]*"), b"reliable", ("compatible", [])),
        (automatic("*C*m*", second="*m*d*"), b"reliable", ("compatible", [])),
        (automatic(deny="*x*x*"), b"reliable", ("compatible", [])),
    ],
)
def test_a_route_is_a_bridge_between_domains(tmp_path, routes, reliability, expected):
    assert outcome(report(tmp_path, service(routes), reliability)) == expected


@pytest.mark.parametrize(
    "routes",
    [
        *(automatic("X*"), automatic(deny="C*"), automatic("X", second="Y"), ""),
        *(automatic("C*", second="C?"), automatic("C?", second="C*"), automatic("C?", second="?d")),
        *(automatic("[CS]*", second="[!C]*"), automatic("[*]md", second="*"), automatic(deny="*m*d")),
    ],
)
def test_a_topic_that_no_route_carries_never_meets(tmp_path, routes):
    found = report(tmp_path, service(routes))
    assert found.verdict_words == "unknown"
    assert "DDS401" in [each.code for each in found.findings]


def test_old_names_of_participants_and_routes_that_are_off(tmp_path):
    old = service(topic_route(), tags=("participant_1", "participant_2"))
    assert outcome(report(tmp_path, old)) == ("compatible", [])
    off = service(topic_route().replace('name="T"', 'name="T" enabled="false"'))
    assert report(tmp_path, off).verdict_words == "unknown"


@pytest.mark.parametrize(
    ("xml", "parts"),
    [
        (service(automatic("*" + "a*" * 12, second="*" + "b*" * 12)), ["routing_service/auto_topic_route"]),
        (service(topic_route() + "<no_schema_has_this/>"), ["routing_service/no_schema_has_this"]),
        (service(topic_route(inner="<no_schema_has_this/>")), ["routing_service/no_schema_has_this"]),
        (
            service(topic_route().replace("<input", "<no_schema_has_this/><input")),
            ["routing_service/no_schema_has_this"],
        ),
        (
            service(
                automatic().replace(
                    "<datareader",
                    "<allow_registered_type_name_filter>S*</allow_registered_type_name_filter><datareader",
                )
            ),
            ["routing_service/allow_registered_type_name_filter"],
        ),
        (service(topic_route(), within="<administration><domain_id>3</domain_id></administration>"), []),
        (service(topic_route()) + '<web_integration_service name="W"/>', ["web_integration_service"]),
        (service(topic_route()) + '<persistence_service name="W"/>', ["persistence_service"]),
        (service(topic_route()) + "<plugin_library/>", []),
        (service(topic_route()) + service(topic_route(), "Q"), ["R", "Q"]),
    ],
)
def test_what_is_not_read_is_named(tmp_path, xml, parts):
    found = report(tmp_path, xml)
    assert [each.name for each in found.coverage.unread] == parts
    assert (found.verdict_words == "compatible") is not bool(parts)


def test_a_processor_leaves_readers_and_writers_and_no_way_between_them(tmp_path):
    routes = topic_route().replace("<input", '<processor plugin_name="P::X"/><input')
    found = report(tmp_path, service(routes))
    assert [each.name for each in found.coverage.unread] == ["routing_service/processor"]
    assert found.verdict_words == "compatible as far as read"  # the reader of the route and a, its writer and b


def test_a_content_filter_may_lose_samples(tmp_path):
    routes = topic_route(inner="<content_filter><expression>x = 1</expression></content_filter>")
    found = report(tmp_path, service(routes))
    assert outcome(found) == ("compatible", [])
    (tmp_path / "s.yaml").write_bytes(SYSTEM.replace(b"%s}", b"reliable, needs: {latest: true}}"))
    assert "DDS566" in [each.code for each in check(tmp_path / "s.yaml", tmp_path / "rs.xml").findings]


def test_several_services_in_one_file_are_a_warning(tmp_path):
    found = report(tmp_path, service(topic_route()) + service(topic_route(), "Q"))
    assert "DDS908" in [each.code for each in found.findings]


@pytest.mark.parametrize(
    ("files", "ids"),
    [
        (("one.xml", "two.xml"), ["R (one)", "R (two)"]),
        (("one/rs.xml", "two/rs.xml"), ["R (one/rs.xml)", "R (two/rs.xml)"]),
        (("one.xml",), ["R"]),
    ],
)
def test_services_of_one_name_in_two_files_are_two(tmp_path, monkeypatch, files, ids):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "s.yaml").write_bytes(SYSTEM % b"reliable")
    for number, name in enumerate(files):
        (tmp_path / name).parent.mkdir(exist_ok=True)
        domains = [f"<domain_id>{2 * number + side}</domain_id>" for side in (0, 1)]
        text = service(topic_route()).replace("<domain_id>0</domain_id>", domains[0])
        text = text.replace("<domain_id>1</domain_id>", domains[1]) if number else text
        (tmp_path / name).write_text(f"<dds>{text}</dds>", encoding="utf-8")
    found = check("s.yaml", *files)
    assert "CQ060" not in [each.code for each in found.findings]
    assert outcome(found) == ("compatible", [])
    readers = {name.partition("/D/")[0] for group in found.groups for name in group.subscribers if "/D/" in name}
    assert readers == {ids[0]}
    assert sorted(read(*files).bridges) == ids


@pytest.mark.parametrize("filters", [{}, {"deny": ""}, {"allow": "X,Cm?", "second": "C*"}])
def test_two_services_that_carry_both_ways_are_a_loop(tmp_path, filters):
    (tmp_path / "q.xml").write_text(f"<dds>{both_ways('Q', **filters)}</dds>", encoding="utf-8")
    alone = report(tmp_path, both_ways("R", **filters))
    together = check(*(tmp_path / each for each in ("s.yaml", "rs.xml", "q.xml")))
    assert ["CQ503" in outcome(each)[1] for each in (alone, together)] == [False, True]
