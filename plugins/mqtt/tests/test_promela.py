"""The model of a pair and SPIN's answers to it: a few cells whole, and counterexamples in words."""

from __future__ import annotations

import json
import os
import subprocess

import pytest

from cqos_core.analysis.proving import Fault, Outcome
from cqos_core.analysis.proving.runs import disagreements, named, prepare, summary
from cqos_core.api import context, read
from cqos_core.files.export import ExportContext
from cqos_core.formatters.proofs import timeline
from cqos_mqtt.exporters.promela import write
from cqos_mqtt.promela.spin import SPIN, Spin
from tests.effort import EXPLORE

MISSING = SPIN.missing()
if MISSING and os.environ.get("CI") == "true":
    raise RuntimeError(f"SPIN {MISSING}")
asks = pytest.mark.skipif(MISSING is not None, reason=str(MISSING))
KEPT = {"clean_start": False, "session_expiry_interval": 3600, "stores_session": True}
WHERE = context(())


def system(publication, subscription, publisher=None, subscriber=None, heard=None, **broker):
    own = {
        "cqos": 1,
        "protocol": "mqtt",
        "options": {"mqtt": {"protocol_version": "5.0"}},
        "brokers": {"main": {"profile": "mosquitto", "persistence": True, **broker}},
        "topics": {"t": {"period": "1s"}},
        "participants": {
            "p": {"client": publisher or {}, "publishes": {"t": publication}},
            "s": {
                "client": subscriber or {},
                "subscribes": {"t": {"taken_every": "0ms", **subscription}, **(heard or {})},
            },
        },
    }
    return named(read(json.dumps(own).encode(), importer="yaml"), WHERE)


def ask(own, fault=None, *, shows=False, messages=1):
    trial = prepare(own, "p/publisher/t", "s/subscriber/t", WHERE, "spin", fault)
    return trial, Spin(messages, shows=shows).prove(trial.plan)


@asks
def test_sessions_that_go_on_survive_an_outage():
    trial, outcome = ask(system({"qos": 1}, {"qos": 1}, KEPT, KEPT), Fault("link_outage", 2.0), messages=2)
    assert {word: outcome.answers[word] for word in ("latest", "loss_free", "duplicate_free")} == {
        "latest": True,
        "loss_free": True,
        "duplicate_free": False,
    }
    assert disagreements(trial, outcome, WHERE) == []


@asks
def test_a_counterexample_is_read_back_in_words():
    needs = {"loss_free": True, "survives": ["subscriber_restart"]}
    trial, outcome = ask(system({"qos": 1}, {"qos": 1, "needs": needs}), Fault("subscriber_restart", 0.4), shows=True)
    assert disagreements(trial, outcome, WHERE) == []
    lines = [" ".join(line.split()) for line in timeline(outcome.events)]
    assert lines[0] == "SPIN breaks loss free"
    assert lines.index("subscriber is killed") < lines.index("subscriber starts again")
    lost = next(line for line in lines if line.startswith("broker has no subscription for message"))
    assert f"publisher sends message {lost[-1]}" in lines
    assert f"subscriber gets message {lost[-1]}" not in lines
    assert "some run breaks latest, loss_free" in summary(outcome)


if EXPLORE:  # each question takes three seconds of processor time

    @asks
    @pytest.mark.explored
    @pytest.mark.parametrize(("server", "holds"), [("infinite", True), ("0", False)])
    def test_the_model_sends_no_will_where_the_broker_turns_keep_alive_off(server, holds):
        client, needs = {"keep_alive": 10, "will": {"topic": "gone", "qos": 1}}, {"liveness": "30s"}
        own = system(
            {"qos": 1}, {"qos": 1, "needs": needs}, client, heard={"gone": {"qos": 1}}, server_keep_alive=server
        )
        trial, outcome = ask(own)
        assert outcome.answers["liveness"] is holds
        assert disagreements(trial, outcome, WHERE) == []

    @asks
    @pytest.mark.explored
    def test_a_retained_message_of_qos_0_is_lost_at_a_break():
        """The fact behind MQTT330: the session goes on, and its client need not subscribe again."""
        _, outcome = ask(system({"qos": 1, "retain": True}, {"qos": 0}, KEPT, KEPT), Fault("link_outage", 2.0))
        assert outcome.answers["late_join"] is False
        _, outcome = ask(system({"qos": 1, "retain": True}, {"qos": 1}, KEPT, KEPT), Fault("link_outage", 2.0))
        assert outcome.answers["late_join"] is True


def test_a_claim_that_the_model_breaks_is_a_disagreement():
    own = system({"qos": 1}, {"qos": 1}, KEPT, KEPT)
    trial = prepare(own, "p/publisher/t", "s/subscriber/t", WHERE, "spin")
    for holds in (True, False):
        outcome = Outcome("SPIN", (), matched=True, answers={"loss_free": holds, "duplicate_free": False})
        wrong = [] if holds else ["C-QoS says loss_free yes"]
        assert [text.partition(",")[0] for text in disagreements(trial, outcome, WHERE)] == wrong


@asks
def test_spin_reads_what_convert_writes(tmp_path):
    exported = write(
        system({"qos": 2}, {"qos": 1, "needs": {"offline": "5s"}}, KEPT, KEPT), ExportContext(WHERE.find_pack)
    )
    assert exported.expressed == 1
    (tmp_path / "m.pml").write_text(exported.text, encoding="utf-8")
    command = ["spin", "-DPAIR=1", "-DABSENT=1", "-a", "m.pml"]
    done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, check=False)
    assert done.returncode == 0
    assert "9 never claims" in done.stdout


def test_pairs_that_the_model_cannot_show_are_left_out():
    one = {"client_id": "one"}
    exported = write(system({"qos": 1}, {"qos": 1}, one, one), ExportContext(WHERE.find_pack))
    assert exported.expressed == 0
    assert "has the id `one` of another client" in exported.notes[0]
    client = {"will": {"topic": "gone"}}
    exported = write(system({}, {}, client, heard={"gone": {}}), ExportContext(WHERE.find_pack))
    assert exported.expressed == 1
    assert "a Will is published by the broker" in exported.notes[0]


def test_what_is_no_mqtt_is_left_out():
    own = {
        "cqos": 1,
        "protocol": "dds",
        "participants": {"a": {"publishes": {"t": {}}}, "b": {"subscribes": {"t": {}}}},
    }
    exported = write(read(json.dumps(own).encode(), importer="yaml"), ExportContext(WHERE.find_pack))
    assert exported.expressed == 0
    assert "dds is not MQTT" in exported.notes[0]
