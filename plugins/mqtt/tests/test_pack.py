"""The pack as a whole: described for machines, brokers and presets, filters as meeting, bad input, sessions kept open."""

import json
import subprocess
import sys
from dataclasses import replace
from typing import Any

import pytest

from cqos_core import Broker, Report, Session, Setting, Severity, check, check_pair, explain, read
from cqos_core.packs import LINK, WORDS, parse
from cqos_core.packs.catalogue import describe_pack
from cqos_core.packs.guarantee import FAULTS, faults_of, unstated
from cqos_mqtt.names import PATTERN
from cqos_mqtt.pack import PACK
from tests.explained_values import side


def text(**more: Any) -> bytes:
    return json.dumps({"cqos": 1, "protocol": "mqtt", **more}).encode()


def judged(**more: Any) -> Report:
    return check(text(**more), importer="yaml", packs=[PACK])


def codes(report: Report, *severities: str) -> list[str]:
    return [each.code for each in report.findings if not severities or each.severity in severities]


def met(report: Report) -> list[tuple[str, tuple[str, ...], tuple[str, ...]]]:
    return [(group.topic, group.publishers, group.subscribers) for group in report.groups]


def test_registering_imports_nothing_heavy():
    script = "import sys, cqos_mqtt; print([m for m in sys.modules if m.startswith(('cqos_mqtt.', 'yaml', 'pydantic', 'cqos_core.packs.pack'))])"
    found = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=True)
    assert found.stdout.strip() == "[]"


def test_claiming_a_file_imports_no_parser():
    script = "import sys, cqos_mqtt.importers.detect; print([m for m in sys.modules if m.startswith(('yaml', 'cqos_mqtt.p', 'cqos_core.'))])"
    found = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=True)
    assert "yaml" not in found.stdout
    assert "cqos_mqtt.p" not in found.stdout


def test_the_pack_describes_itself_to_machines():
    described = json.loads(json.dumps(describe_pack(PACK)))
    assert described["id"] == "mqtt"
    assert all(each["because"] and each["clause"] for each in described["rules"])
    assert all(each["doc"] for each in described["policies"])


def test_every_sentence_has_a_text_form():
    for rule in PACK.rules:
        read = parse(str(rule.condition), PACK.definitions)
        assert (read, str(read)) == (rule.condition, str(rule.condition))


def test_every_word_of_the_currency_is_given():
    assert set(PACK.guaranteed) == set(WORDS)


def test_every_rule_names_its_clause_for_each_version_it_holds_for():
    for rule in PACK.rules:
        assert rule.clause.startswith(("MQTT 3.1.1, ", "MQTT 5.0, ", "C-QoS, ", "Mosquitto, ", "RabbitMQ, ")), rule.code


def test_every_cell_that_may_be_given_is_proven_or_has_a_clause_of_a_standard_or_manual():
    proven = {(proof.guarantee, proof.fault) for proof in PACK.implementations.proofs}
    clauses = {(each.guarantee, fault): each.clause for each in PACK.unaffected for fault in each.faults}
    for rule in PACK.rules:
        for fault in (
            faults_of(rule.survives) or (LINK,) if rule.guarantee and not rule.clause.startswith("C-QoS") else ()
        ):
            clauses[rule.guarantee, fault] = rule.clause
    without = {(word, fault) for word in WORDS for fault in (LINK, *FAULTS)} - proven - clauses.keys()
    left_open = {
        (rule.guarantee, fault) for rule in unstated(PACK.rules, PACK.unaffected) for fault in faults_of(rule.survives)
    }
    assert without <= left_open


@pytest.mark.parametrize(
    ("broker", "derived"),
    [
        ({"profile": "mosquitto"}, ()),
        ({"profile": "emqx"}, ("emqx",)),
        ({"persistence": False}, ("an implementation that is not stated",)),
    ],
)
def test_explain_names_where_a_guarantee_was_seen(broker, derived):
    system = text(
        brokers={"b": broker},
        participants={
            "p": {"publishes": {"t": {"qos": 1}}},
            "s": {"subscribes": {"t": {"qos": 1, "taken_every": "0ms"}}},
        },
    )
    pair = explain(system, publisher="p/publisher/t", subscriber="s/subscriber/t")
    cell = next(each.cells[0] for each in pair.guarantees if each.word == "loss_free")
    assert (cell.fault, cell.value, cell.proven, cell.derived) == ("link", "yes", ("Mosquitto 2.0.11",), derived)


def test_every_preset_of_a_broker_names_its_source():
    brokers = {name: preset for name, preset in PACK.presets.items() if preset.level == "broker"}
    assert {"mosquitto", "hivemq_ce", "emqx", "aws_iot_core", "rabbitmq_3_10"} <= set(brokers)
    assert all("(" in preset.doc for preset in brokers.values())


@pytest.mark.parametrize("version", ["3.1.1", "5.0", None])
def test_two_defaults_fit_without_a_word(version):
    report = check_pair("mqtt", {}, {}, {"version": version} if version else {}, packs=[PACK])
    assert report.verdict == "compatible"
    assert report.findings == ()


# The core function: what a subscription gets, as the table of the standard has it


@pytest.mark.parametrize(
    ("published", "granted", "loss_free", "duplicate_free"),
    [
        (0, 0, False, True),
        (0, 1, False, True),
        (0, 2, False, True),
        (1, 0, False, False),
        (1, 1, True, False),
        (1, 2, True, False),
        (2, 0, False, True),
        (2, 1, True, False),
        (2, 2, True, True),
    ],
)
def test_loss_and_duplicates_are_two_properties(published, granted, loss_free, duplicate_free):
    for word, given in (("loss_free", loss_free), ("duplicate_free", duplicate_free)):
        requested = {"qos": granted, "taken_every": "0ms"}
        report = check_pair("mqtt", {"qos": published}, requested, needs={word: True}, packs=[PACK])
        assert (report.verdict == "compatible") is given, word


@pytest.mark.parametrize(
    ("published", "granted", "broker", "arrives"),
    [
        ("2", "1", {}, "1"),
        ("0", "2", {}, "0"),
        ("2", "2", {"maximum_qos": 1}, "1"),
        ("0", "1", {"upgrade_outgoing_qos": True}, "1"),
        ("0", "2", {"upgrade_outgoing_qos": True, "granted_qos": 1}, "1"),
        ("2", "0", {"upgrade_outgoing_qos": True}, "0"),
    ],
)
def test_explain_says_with_which_qos_a_message_arrives(published, granted, broker, arrives):
    own = {
        "cqos": 1,
        "protocol": "mqtt",
        "brokers": {"main": broker},
        "participants": {
            "p": {"publishes": {"t": {"qos": published}}},
            "s": {"subscribes": {"t": {"qos": granted}}},
        },
    }
    pair = explain(
        json.dumps(own).encode(), publisher="p/publisher/t", subscriber="s/subscriber/t", packs=[PACK], protocol="mqtt"
    )
    assert pair.derived == (("arrives with QoS", arrives),)


# Filters as meeting

FARM: dict[str, dict[str, Any]] = {
    "station": {"publishes": {"farm/a/weather": {}, "farm/b/weather": {}, "$x/y": {}}},
    "display": {"subscribes": {"farm/+/weather": {}}},
    "one": {"subscribes": {"farm/a/weather": {}}},
    "all": {"subscribes": {"#": {}}},
}


def test_a_filter_meets_every_topic_it_matches():
    report = judged(participants=FARM)
    assert met(report) == [
        (
            "farm/a/weather",
            ("station/publisher/farm/a/weather",),
            ("all/subscriber/#", "display/subscriber/farm/+/weather", "one/subscriber/farm/a/weather"),
        ),
        (
            "farm/b/weather",
            ("station/publisher/farm/b/weather",),
            ("all/subscriber/#", "display/subscriber/farm/+/weather"),
        ),
    ]
    assert codes(report, "error", "warning") == []


def test_a_report_counts_topics_and_not_filters():
    report = judged(participants={**FARM, "station": {"publishes": {"farm/a/weather": {}, "farm/b/weather": {}}}})
    assert report.topics == 2
    assert report.endpoints == 5


def test_a_filter_that_matches_nothing_is_one_warning():
    report = judged(participants={**FARM, "other": {"subscribes": {"barn/#": {}}}})
    assert codes(report, "warning") == ["CQ401"]


@pytest.mark.parametrize(
    ("filter", "words"),
    [
        ("Barn/+/light", "upper and lower case"),
        ("/barn/+/light", "slashes at the ends"),
        ("barn/+/light/", "slashes at the ends"),
        ("$share/g/BARN/#", "upper and lower case"),
    ],
)
def test_a_near_miss_of_a_filter_is_reported(filter, words):  # noqa: A002
    report = judged(participants={"a": {"publishes": {"barn/x/light": {}}}, "b": {"subscribes": {filter: {}}}})
    (finding,) = [each for each in report.findings if each.code == "CQ403"]
    assert words in finding.message
    assert "CQ401" not in codes(report)


def test_a_dollar_at_the_start_is_a_near_miss():
    report = judged(participants={"a": {"publishes": {"$state/x": {}}}, "b": {"subscribes": {"+/x": {}}}})
    assert "CQ403" in codes(report)


def test_a_published_wildcard_is_an_error_and_matches_no_filter():
    report = judged(participants={"a": {"publishes": {"a/+": {}}}, "b": {"subscribes": {"a/b": {}}}})
    (finding,) = [each for each in report.findings if each.code == "MQTT602"]
    assert finding.place is not None
    assert report.groups == ()


def test_explaining_a_pair_finds_the_topic_that_a_filter_meets():
    found = explain(
        text(participants=FARM),
        publisher="station/publisher/farm/b/weather",
        subscriber="all/subscriber/#",
        packs=[PACK],
    )
    assert found.verdict == "compatible"


# Brokers


def test_settings_of_a_broker_win_over_its_presets_and_keep_their_origin():
    report = judged(
        brokers={"main": {"profile": "aws_iot_core", "max_packet_size": 10}},
        participants={"a": {"publishes": {"t": {"qos": 2, "max_payload": 11}}}, "b": {"subscribes": {"t": {}}}},
    )
    found = {each.code: each for each in report.findings}
    facts = {
        each.policy: each.origin for code in ("MQTT201", "MQTT209") for side in found[code].sides for each in side.facts
    }
    assert facts["maximum_qos"] == "preset aws_iot_core"
    assert facts["maximum_packet_size"] == "explicit"


def test_a_profile_of_the_system_may_be_that_of_a_broker():
    report = judged(
        profiles={"small": {"max_qos": 0, "profile": "mosquitto"}},
        brokers={"main": {"profile": "small"}},
        participants={"a": {"publishes": {"t": {"qos": 1, "topic_alias": 11}}}, "b": {"subscribes": {"t": {}}}},
    )
    assert codes(report, "error") == ["MQTT201", "MQTT211"]


@pytest.mark.parametrize(
    ("brokers", "code"),
    [
        ({"main": {"max_qoss": 1}}, "CQ202"),
        ({"main": {"max_qos": 3}}, "CQ203"),
        ({"main": {"profile": "mosquito"}}, "CQ204"),
        ({"main": {"acl": ["reed bob #"]}}, "CQ203"),
        ({"main": {"acl": [["read"]]}}, "CQ203"),
        ({"main": {"profile": "sparkplug_state"}}, "CQ204"),
    ],
)
def test_a_mistake_in_a_broker_is_one_error_at_its_place(brokers, code):
    report = judged(
        brokers=brokers,
        participants={name: {"publishes": {"t": {}}, "subscribes": {"t": {}}} for name in ("a", "b", "c")},
    )
    (finding,) = [each for each in report.findings if each.code == code]
    assert finding.severity == "error"
    assert finding.place is not None


def test_a_preset_of_a_broker_is_none_of_an_endpoint():
    report = judged(participants={"a": {"publishes": {"t": "mosquitto"}}, "b": {"subscribes": {"t": {}}}})
    assert codes(report, "error") == ["CQ204"]


def test_a_broker_that_is_not_there():
    report = judged(brokers={"main": {}}, participants={"a": {"broker": "mian", "publishes": {"t": {}}}})
    (finding,) = [each for each in report.findings if each.code == "CQ216"]
    assert finding.severity == "error"
    assert "did you mean `main`" in (finding.help or "")


def test_clients_that_name_none_of_several_brokers_share_one_finding():
    people: dict[str, Any] = {name: {"publishes": {"t": {}}} for name in ("a", "b", "c")}
    report = judged(brokers={"x": {}, "y": {}}, participants=people)
    (finding,) = [each for each in report.findings if each.code == "CQ216"]
    assert finding.severity == "warning"
    assert finding.sides[0].members == ("a", "b", "c")


# Sparkplug B


def test_sparkplug_as_it_is_meant_gives_no_finding_about_qos():
    report = judged(
        options={"mqtt": {"implied_needs": "warning"}},
        participants={
            "host": {
                "publishes": {"spBv1.0/plant/NCMD/edge": "sparkplug_message", "spBv1.0/STATE/host": "sparkplug_state"},
                "subscribes": {"spBv1.0/#": {}},
            },
            "edge": {
                "publishes": {"spBv1.0/plant/NDATA/edge": "sparkplug_message"},
                "subscribes": {"spBv1.0/plant/NCMD/edge": "sparkplug_commands", "spBv1.0/STATE/host": {"qos": 1}},
            },
        },
    )
    assert codes(report, "error", "warning") == []
    assert len(report.groups) == 3


# Bad input


@pytest.mark.parametrize(
    ("client", "settings", "code"),
    [
        ({}, {"qos": 3}, "CQ203"),
        ({}, {"message_expiry": -1}, "CQ203"),
        ({}, {"message_expiry": "500ms"}, "CQ203"),
        ({}, {"message_expiry": 4294967296}, "CQ203"),
        ({"keep_alive": 65536}, {}, "CQ203"),
        ({"session_expiry": -1}, {}, "CQ203"),
        ({"version": "6"}, {}, "CQ203"),
        ({"receive_maximum": 0}, {}, "CQ203"),
        ({"will": {"topic": "a/#"}}, {}, "MQTT602"),
        ({"will": {"topic": "a", "qos": 3}}, {}, "CQ203"),
        ({"version": "3.1.1", "session_expiry": 5}, {}, "MQTT411"),
    ],
)
def test_bad_input_gives_a_located_error(client, settings, code):
    report = judged(
        participants={"a": {"client": client, "publishes": {"t": settings}}, "b": {"subscribes": {"t": {}}}}
    )
    found = [each for each in report.findings if each.code == code]
    assert found
    assert all(each.severity != "note" and each.place is not None and each.place.line for each in found)


# Bridges and sessions


def test_bridges_that_share_a_subscription_bring_nothing_twice():
    def repeated(topic):
        """Two bridges carry what a sensor says from the broker in the hall to the one in the office."""
        report = judged(
            brokers={"hall": {}, "office": {}},
            participants={
                "sensor": {"broker": "hall", "publishes": {"t": {"qos": 2}}},
                "viewer": {"broker": "office", "subscribes": {"t": {"qos": 2, "needs": {"duplicate_free": True}}}},
                **{f"{name}_in": {"broker": "hall"} for name in "ab"},
                **{f"{name}_out": {"broker": "office"} for name in "ab"},
            },
            bridges={
                name: {
                    "routes": [
                        {
                            "from": {"participant": f"{name}_in", "topic": topic, "qos": 2},
                            "to": {"participant": f"{name}_out", "topic": "t", "qos": 2},
                        }
                    ]
                }
                for name in "ab"
            },
        )
        return "CQ507" in codes(report)

    assert repeated("t")
    assert not repeated("$share/bridges/t")


def test_a_session_follows_what_one_edit_changes_elsewhere():
    """An edit of one endpoint changes what is known of others: what overlaps, what replaces it, who hears a Will."""
    system = read(text(participants=FARM), importer="yaml")
    session = Session(system, packs=[PACK])
    for edit in range(4):
        if edit == 1:
            session.put_broker(Broker("main", "mqtt", {"maximum_qos": Setting("0")}))
        elif edit == 2:
            own = next(each for each in session.system.endpoints if each.participant == "all")
            own.topic = "farm/#"
            session.put(own)
        elif edit == 3:
            session.remove("one/subscriber/farm/a/weather")
        report, fresh = session.report(), check(session.system, packs=[PACK])
        assert report.findings == fresh.findings
        assert report.groups == fresh.groups


def test_two_thousand_endpoints_on_as_many_filters_stay_small():
    people: dict[str, Any] = {f"s{n}": {"publishes": {f"site/{n}/value": {"qos": 1}}} for n in range(1_000)}
    people |= {f"v{n}": {"subscribes": {f"site/{n}/#": {"qos": 1}}} for n in range(1_000)}
    report = judged(participants=people)
    assert len(report.groups) == 1_000
    assert codes(report, "error", "warning") == []
    assert all(each.severity is Severity.NOTE for each in report.findings)


def derived_stated(**parts):
    endpoint = {"qos": 1, **parts.get("endpoint", {})}
    system = {
        "cqos": 1,
        "protocol": "mqtt",
        "profiles": {"p": parts.get("profile", {})},
        "participants": {
            "a": {"client": parts.get("client", {}), "publishes": {"t": {}}},
            "b": {"subscribes": {"t": {"profile": "p", **endpoint}}},
        },
    }
    report = check(json.dumps(system).encode())
    return [finding.message for finding in report.findings if finding.code == "CQ202"]


@pytest.mark.parametrize(
    ("parts", "owner"),
    [
        ({"endpoint": {"wildcards": True}}, "subscriber `b/subscriber/t` states `wildcards`"),
        ({"profile": {"shared": True}}, "profile `p` states `shared`"),
        ({"client": {"client_id_taken": True}}, "participant `a` states `client_id_taken`"),
    ],
)
def test_a_derived_fact_cannot_be_stated(parts, owner):
    (message,) = derived_stated(**parts)
    assert message.startswith(f"{owner}, which cannot be stated. ")
    assert "derived from" in message


def test_a_derived_fact_cannot_be_stated_after_the_same_text_was_derived():
    check(b"cqos: 1\nprotocol: mqtt\nparticipants: {b: {subscribes: {'a/+': {}}}, a: {publishes: {a/b: {}}}}\n")
    assert derived_stated(endpoint={"wildcards": True})


def test_no_derived_fact_is_offered_as_a_name():
    report = check(b"cqos: 1\nprotocol: mqtt\nparticipants: {a: {publishes: {t: {wil: 1}}}}\n")
    (finding,) = (finding for finding in report.findings if finding.code == "CQ202")
    assert "closing_message" not in str(finding.help)


# Wills whose fields are misspelt


@pytest.mark.parametrize(
    ("will", "named", "meant"),
    [
        ({"lastwil": {"topic": "gone", "qos": 1}}, "lastwil", "topic"),
        ({"will": {"topc": "gone", "qos": 1}}, "will.topc", "will.topic"),
        ({"lastWill": {"topic": "gone", "qoss": 1}}, "lastWill.qoss", "will.qos"),
        ({"will.topc": "gone"}, "will.topc", "will.topic"),
    ],
)
def test_a_misspelt_field_of_a_will_is_one_error_and_leaves_the_will_alone_unknown(will, named, meant):
    report = judged(
        brokers={"b": {"profile": "mosquitto"}},
        participants={
            "p": {"client": will, "publishes": {"t": {"qos": 1}}},
            "s": {"subscribes": {"t": {"qos": 1, "needs": {"latest": True}}, "gone": {}}},
        },
    )
    (error,) = [each for each in report.findings if each.severity == "error"]
    assert (error.code, f"`{named}`" in error.message) == ("CQ202", True)
    assert meant in error.help.partition("?")[0]
    assert {group.verdict for group in report.groups} == {"unknown"}
    assert not [each.code for each in report.findings if each.code in {"CQ216", "MQTT108"}]


def test_clients_that_differ_in_names_alone_have_equal_values():
    """What a client's queue brings must not tell apart clients whose messages name nothing of it."""
    parts = {
        f"s{n}": {"client": {"client_id": f"s{n}"}, "subscribes": {"t": {"qos": 1}, f"own/{n}": {"qos": 1}}}
        for n in range(3)
    }
    system = text(
        brokers={"b": {"profile": "mosquitto"}},
        topics={"t": {"period": "1s"}},
        participants={"p": {"publishes": {"t": {"qos": 1}}}, **parts},
    )
    subscribers = [f"s{n}/subscriber/t" for n in range(3)]
    pairs = [explain(system, publisher="p/publisher/t", subscriber=each) for each in subscribers]
    assert len({side(each, "subscriber")["queue_lasts"].value for each in pairs}) == 1


@pytest.mark.parametrize(
    ("limits", "changed"), [("{profile: aws_iot_core}", False), ("{profile: mosquitto, maximum_qos: 1}", True)]
)
def test_no_fix_changes_a_broker_that_a_provider_runs(limits, changed):
    report = check(
        f"""cqos: 1
protocol: mqtt
brokers: {{cloud: {limits}}}
participants:
  board: {{client: {{client_id: b, will: {{topic: gone, qos: 2}}}}, publishes: {{t: {{qos: 1}}}}}}
  service: {{client: {{client_id: s}}, subscribes: {{t: {{qos: 1}}}}}}
""".encode(),
        importer="yaml",
    )
    (finding,) = [each for each in report.findings if each.code == "MQTT204"]
    assert any("maximum_qos" in each.text for each in finding.remedies) is changed


@pytest.mark.parametrize(("broker", "verdict"), [("rabbitmq_3_10", "unknown"), ("mosquitto", "compatible")])
def test_how_many_levels_dots_make_in_a_pattern_of_topics_is_not_known(broker, verdict):
    clients: dict[str, object] = {"p": {"publishes": {"a.b/c": {}}}, "s": {"subscribes": {"a.b/+": {}}}}
    system = read(text(brokers={"main": {"profile": broker}}, participants=clients), importer="yaml")
    system.endpoints[0] = replace(system.endpoints[0], topic="a.b/+", kind=PATTERN)
    assert check(system).verdict == verdict
