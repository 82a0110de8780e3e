"""Directives of mosquitto.conf that are not taken as settings: each is known not to matter, or makes unknown what it may decide."""

from __future__ import annotations

import gzip
import re
from pathlib import Path

import pytest

from cqos_core import check
from cqos_core.model.settings import Place
from cqos_mqtt.importers import mosquitto
from cqos_mqtt.importers.editing import state_directives
from cqos_mqtt.importers.mosquitto_bridge import OF_CONNECTIONS, TAKEN
from cqos_mqtt.importers.mosquitto_directives import ADDRESSES, CANNOT_MATTER, UNDECIDED, UNDECIDED_OF_BRIDGES

OF_2_0_20 = [
    "acl_file",
    "address",
    "addresses",
    "allow_anonymous",
    "allow_duplicate_messages",
    "allow_zero_length_clientid",
    "auth_plugin",
    "auth_plugin_deny_special_chars",
    "auto_id_prefix",
    "autosave_interval",
    "autosave_on_changes",
    "bind_address",
    "bind_interface",
    "bridge_alpn",
    "bridge_attempt_unsubscribe",
    "bridge_bind_address",
    "bridge_cafile",
    "bridge_capath",
    "bridge_certfile",
    "bridge_identity",
    "bridge_insecure",
    "bridge_keyfile",
    "bridge_max_packet_size",
    "bridge_outgoing_retain",
    "bridge_protocol_version",
    "bridge_psk",
    "bridge_require_ocsp",
    "bridge_tls_version",
    "cafile",
    "capath",
    "certfile",
    "check_retain_source",
    "ciphers",
    "cleansession",
    "clientid",
    "clientid_prefixes",
    "connection",
    "connection_messages",
    "crlfile",
    "dhparamfile",
    "http_dir",
    "idle_timeout",
    "include_dir",
    "keepalive_interval",
    "keyfile",
    "listener",
    "local_cleansession",
    "local_clientid",
    "local_password",
    "local_username",
    "log_dest",
    "log_facility",
    "log_timestamp",
    "log_timestamp_format",
    "log_type",
    "max_connections",
    "max_inflight_bytes",
    "max_inflight_messages",
    "max_keepalive",
    "max_packet_size",
    "max_qos",
    "max_queued_bytes",
    "max_queued_messages",
    "max_topic_alias",
    "maximum_qos",
    "memory_limit",
    "message_size_limit",
    "mount_point",
    "notification_topic",
    "notifications",
    "notifications_local_only",
    "password",
    "password_file",
    "per_listener_settings",
    "persistence",
    "persistence_file",
    "persistence_location",
    "persistent_client_expiration",
    "pid_file",
    "plugin",
    "port",
    "protocol",
    "psk_file",
    "psk_hint",
    "queue_qos0_messages",
    "remote_clientid",
    "remote_password",
    "remote_username",
    "require_certificate",
    "restart_timeout",
    "retain_available",
    "retained_persistence",
    "retry_interval",
    "round_robin",
    "set_tcp_nodelay",
    "socket_domain",
    "start_type",
    "sys_interval",
    "threshold",
    "tls_engine",
    "tls_engine_kpass_sha1",
    "tls_keyform",
    "tls_version",
    "topic",
    "try_private",
    "upgrade_outgoing_qos",
    "use_identity_as_username",
    "use_subject_as_username",
    "use_username_as_clientid",
    "user",
    "username",
    "websockets_headers_size",
    "websockets_log_level",
]
"""Directives that conf.c of Mosquitto 2.0.20 compares a line with."""
VALUES = frozenset(
    [
        "all",
        "automatic",
        "debug",
        "dlt",
        "error",
        "file",
        "information",
        "internal",
        "ipv4",
        "ipv6",
        "lazy",
        "manual",
        "mosquitto",
        "mosquitto_passwd",
        "mqtt",
        "mqttsn",
        "mqttv31",
        "mqttv311",
        "mqttv50",
        "none",
        "notice",
        "once",
        "stderr",
        "stdout",
        "subscribe",
        "syslog",
        "unsubscribe",
        "value",
        "warning",
        "websockets",
    ]
)
"""Words that the manual prints as it prints directives."""
MANUAL = Path("/usr/share/man/man5/mosquitto.conf.5.gz")
TAKEN_OF_BROKERS = mosquitto.TAKEN
DESIGN = b"""cqos: 1
protocol: mqtt
participants:
  p: {broker: main, client: {client_id: p}, publishes: {t: {qos: 1}}}
  s: {broker: main, client: {client_id: s, clean_start: false}, subscribes: {t: {qos: 1}}}
"""


def known(name):
    return name in TAKEN_OF_BROKERS | TAKEN | CANNOT_MATTER.keys() | UNDECIDED.keys() | UNDECIDED_OF_BRIDGES.keys()


@pytest.mark.parametrize("name", OF_2_0_20)
def test_every_directive_of_the_source_is_in_a_table(name):
    assert known(name)


@pytest.mark.skipif(not MANUAL.exists(), reason="Mosquitto is installed without its manual")
def test_every_directive_of_the_manual_is_in_a_table():
    text = gzip.decompress(MANUAL.read_bytes()).decode()
    listed = set(re.findall(r"^\\fB([a-z_0-9]+)\\fR(?: |$)", text, re.MULTILINE)) - VALUES
    assert {name for name in listed if not known(name)} == set()
    assert len(listed) > 80  # the form of the manual is still read


def test_each_is_in_one_table():
    tables = (
        TAKEN_OF_BROKERS | TAKEN,
        CANNOT_MATTER.keys(),
        UNDECIDED.keys(),
        UNDECIDED_OF_BRIDGES.keys() - {*ADDRESSES},
    )
    assert sum(map(len, tables)) == len(set().union(*tables))
    assert {*UNDECIDED_OF_BRIDGES} <= OF_CONNECTIONS


def report(tmp_path, *lines):
    (tmp_path / "main.conf").write_text("\n".join(("listener 1883", *lines)) + "\n")
    (tmp_path / "design.yaml").write_bytes(DESIGN)
    return check(tmp_path / "design.yaml", tmp_path / "main.conf")


ACCESS = "acl_file acl"


@pytest.mark.parametrize("name", UNDECIDED)
def test_what_may_decide_is_named_and_is_not_green(tmp_path, name):
    about = UNDECIDED[name]
    (tmp_path / "acl").write_text("topic readwrite #\n")
    word = "false" if "true" in about.harmless else "true" if "false" in about.harmless else "1000"
    found = report(tmp_path, ACCESS, f"{name} {word}")
    assert found.verdict_words != "compatible"
    assert [each.kind for each in found.coverage.unread] == ["element"]
    if about.policies != ("autosave_interval",):  # which nothing in this design asks for
        assert found.verdict == "unknown"
    for harmless in about.harmless:
        assert report(tmp_path, ACCESS, f"{name} {harmless}").verdict_words == "compatible"


@pytest.mark.parametrize("name", [name for name, about in UNDECIDED.items() if about.policies == ("acl",)])
def test_what_is_about_access_decides_nothing_where_all_is_allowed(tmp_path, name):
    word = "false" if "true" in UNDECIDED[name].harmless else "true"
    assert report(tmp_path, f"{name} {word}").verdict_words == "compatible"


def test_what_holds_for_one_listener_is_not_taken_back_by_another(tmp_path):
    """Of a directive of the whole broker the last counts; of those of listeners each."""
    (tmp_path / "acl").write_text("topic readwrite #\n")
    for name, about in UNDECIDED.items():
        harmless = about.harmless[0] if about.harmless else None
        if harmless is None:
            continue
        word = "false" if harmless == "true" else "true" if harmless == "false" else "1000"
        lines = (ACCESS, f"{name} {word}", "listener 1884", f"{name} {harmless}")
        verdict = report(tmp_path, *lines).verdict
        assert (verdict == "compatible") is not about.of_listener, name
        again = report(tmp_path, ACCESS, f"{name} {word}", f"{name} {harmless}")
        assert again.verdict_words == "compatible", name


@pytest.mark.skipif(not MANUAL.exists(), reason="Mosquitto is installed without its manual")
def test_the_manual_says_which_hold_for_listeners():
    text = gzip.decompress(MANUAL.read_bytes()).decode()
    listeners = text[text.index('\n.SH "LISTENERS"') : text.index('\n.SH "CONFIGURING BRIDGES"')]
    own = {name for name in UNDECIDED if re.search(rf"^\\fB{name}\\fR(?: |$)", listeners, re.MULTILINE)}
    assert own
    assert own <= {name for name, about in UNDECIDED.items() if about.of_listener}


@pytest.mark.parametrize(
    ("lines", "verdict"),
    [
        (("address far:1883",), "compatible"),
        (("addresses far:1883",), "compatible"),
        (("address far:1883 near:1883",), "unknown"),
        (("addresses far:1883 near:1883",), "unknown"),
    ],
)
def test_a_bridge_with_several_addresses_may_go_on_to_another_broker(tmp_path, lines, verdict):
    """Mosquitto 2.0.11 takes both words alike: it goes on to the second address where the first one does not answer."""
    (tmp_path / "far.conf").write_text("listener 1883\n")
    (tmp_path / "design.yaml").write_text(DESIGN.decode().replace("s: {broker: main", "s: {broker: far"))
    (tmp_path / "main.conf").write_text("\n".join(("listener 1883", "connection up", *lines, "topic t out 1")) + "\n")
    found = check(*(tmp_path / each for each in ("design.yaml", "main.conf", "far.conf")))
    assert found.verdict == verdict
    assert ("MQTT948" in {each.code for each in found.findings}) is (verdict == "unknown")


@pytest.mark.parametrize("words", [ADDRESSES, ADDRESSES[::-1], ("address", "address")])
def test_mosquitto_refuses_a_second_line_of_addresses(tmp_path, words):
    """By running 2.0.11: `Invalid bridge configuration`."""
    found = report(tmp_path, "connection up", *(f"{word} far:1883" for word in words), "topic t out 1")
    assert {(each.code, each.place.line) for each in found.findings} >= {("MQTT940", 4)}
    assert [each.kind for each in found.coverage.unread] == ["bridge"]


@pytest.mark.parametrize("name", UNDECIDED_OF_BRIDGES)
def test_what_a_bridge_then_carries_is_not_known(tmp_path, name):
    about = UNDECIDED_OF_BRIDGES[name]
    word = {**dict.fromkeys(ADDRESSES, "far:1883 near:1883"), "start_type": "lazy", "round_robin": "true"}.get(
        name, "1000"
    )
    (tmp_path / "far.conf").write_text("listener 1883\n")
    (tmp_path / "design.yaml").write_text(DESIGN.decode().replace("s: {broker: main", "s: {broker: far"))

    def checked(*lines):
        block = ("listener 1883", "connection up", *lines, "topic t out 1")
        (tmp_path / "main.conf").write_text("\n".join(block) + "\n")
        return check(*(tmp_path / each for each in ("design.yaml", "main.conf", "far.conf")))

    address = () if name in ADDRESSES else ("address far:1883",)
    found = checked(*address, f"{name} {word}")
    assert found.verdict == "unknown"
    assert [each.kind for each in found.coverage.unread] == ["element"]
    for harmless in about.harmless:
        assert checked(*address, f"{name} {harmless}").verdict_words == "compatible"


def test_a_plugin_is_not_read(tmp_path):
    assert report(tmp_path, "plugin /usr/lib/other.so").verdict_words == "compatible as far as read"


@pytest.mark.parametrize(("limit", "written"), [("9s", None), ("10s", "max_keepalive 10\n")])
def test_no_fix_writes_a_keep_alive_that_mosquitto_refuses(limit, written):
    text = "max_keepalive 60\n"
    made = state_directives(text, Place("m.conf", 1, 1), {"server_keep_alive": limit})
    assert (made and f"{text[: made.start]}{made.text}{text[made.end :]}") == written
