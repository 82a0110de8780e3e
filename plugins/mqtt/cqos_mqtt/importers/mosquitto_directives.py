"""What mosquitto.conf may state beyond what the importer takes as settings: which directives cannot matter, and which may decide.

Names are those of Mosquitto 2.0.20 (conf.c) and of 2.1 (mosquitto.conf(5)); each that the importer takes is in its own tables.
"""

from __future__ import annotations

from typing import Final, NamedTuple

from cqos_core.model.settings import EVERY_OTHER


class Undecided(NamedTuple):
    """A directive that may decide a verdict and is not modelled.

    Attributes:
        effect: what it does, after its name.
        policies: the settings of the broker that are not known with it; of a bridge all that is not stated.
        harmless: values, as they are written, with which it does nothing.
        of_listener: whether it holds for the listener above it only.
    """

    effect: str
    policies: tuple[str, ...]
    harmless: tuple[str, ...] = ()
    of_listener: bool = False


_OFF: Final = ("false", "0")
_UNBOUNDED: Final = ("0", "-1")

UNDECIDED: Final = {
    "accept_protocol_versions": Undecided(
        "refuses clients of other versions", ("oldest_version", "newest_version"), of_listener=True
    ),
    "allow_duplicate_messages": Undecided(
        "sends a message once to a client whose filters overlap", (EVERY_OTHER,), ("true", "1")
    ),
    "autosave_on_changes": Undecided("counts changes in place of seconds", ("autosave_interval",), _OFF),
    "check_retain_source": Undecided(
        "keeps retained messages of clients that may not publish any more", ("acl",), ("true", "1")
    ),
    "max_inflight_bytes": Undecided(
        "bounds the bytes on their way to a client", ("max_inflight_messages", "max_queued_messages"), _UNBOUNDED
    ),
    "memory_limit": Undecided(
        "drops messages where memory ends", ("max_queued_messages", "max_queued_bytes"), _UNBOUNDED
    ),
    "mount_point": Undecided(
        "puts a prefix before the topics of the clients of a listener", (EVERY_OTHER,), of_listener=True
    ),
    "per_listener_settings": Undecided("lets each listener have an access control of its own", ("acl",), _OFF),
    "retain_expiry_interval": Undecided("removes retained messages after a time", ("retain_available",)),
    "use_identity_as_username": Undecided("takes the user name from the certificate", ("acl",), _OFF, of_listener=True),
    "use_subject_as_username": Undecided("takes the user name from the certificate", ("acl",), _OFF, of_listener=True),
    "use_username_as_clientid": Undecided(
        "takes the user name as the client id", (EVERY_OTHER,), _OFF, of_listener=True
    ),
}
"""Directives of the broker and of listeners that may decide."""

ADDRESSES: Final = ("address", "addresses")
"""Two words for the same: all addresses of a connection, of which it takes the first one that answers."""

UNDECIDED_OF_BRIDGES: Final = {
    **dict.fromkeys(ADDRESSES, Undecided("goes on to another broker where one does not answer", ())),
    "bridge_max_packet_size": Undecided("keeps larger packets from the bridge", (), _UNBOUNDED),
    "bridge_receive_maximum": Undecided("bounds the messages on their way to the bridge", ()),
    "round_robin": Undecided("goes on to another broker where one does not answer", (), _OFF),
    "start_type": Undecided("connects the bridge only at times", (), ("automatic",)),
}
"""Those of a connection; what the bridge carries is then not known."""

_LETS_IN: Final = "decides who may connect, which is not checked"
_SECURES: Final = "is about encryption and certificates"
_LOGS: Final = "is about the log"
_TRANSPORT: Final = "is about how packets are carried, not what they say"
_FILES: Final = "names where something is kept, not what"
_OBSOLETE: Final = "has had no effect since Mosquitto 1.5"

CANNOT_MATTER: Final = {
    **dict.fromkeys(
        (
            *("allow_anonymous", "allow_zero_length_clientid", "auth_plugin_deny_special_chars", "clientid_prefixes"),
            *(
                "global_max_clients",
                "global_max_connections",
                "listener_allow_anonymous",
                "max_connections",
                "password_file",
            ),
            *("bridge_bind_address", "local_password", "local_username", "password", "remote_password"),
            *("remote_username", "username"),
        ),
        _LETS_IN,
    ),
    **dict.fromkeys(
        (
            *("bridge_alpn", "bridge_cafile", "bridge_capath", "bridge_certfile", "bridge_ciphers", "bridge_identity"),
            *("bridge_insecure", "bridge_keyfile", "bridge_psk", "bridge_require_ocsp", "bridge_tls_use_os_certs"),
            *("bridge_tls_version", "cafile", "capath", "certfile", "ciphers", "crlfile", "dhparamfile"),
            *("disable_client_cert_date_checks", "keyfile", "proxy_protocol_v2_require_tls", "psk_file", "psk_hint"),
            *("require_certificate", "tls_engine", "tls_engine_kpass_sha1", "tls_keyform", "tls_version"),
        ),
        _SECURES,
    ),
    **dict.fromkeys(
        (
            *("connection_messages", "log_dest", "log_facility", "log_timestamp", "log_timestamp_format", "log_type"),
            *("max_log_entries", "websockets_log_level"),
        ),
        _LOGS,
    ),
    **dict.fromkeys(
        (
            *("bind_interface", "bridge_tcp_keepalive", "bridge_tcp_user_timeout", "enable_proxy_protocol"),
            *("packet_buffer_size", "protocol", "set_tcp_nodelay", "socket_domain", "websockets_headers_size"),
            *("websockets_origin",),
        ),
        _TRANSPORT,
    ),
    **dict.fromkeys(("http_dir", "persistence_file", "persistence_location", "pid_file"), _FILES),
    **dict.fromkeys(("retry_interval", "store_clean_interval"), _OBSOLETE),
    **dict.fromkeys(
        ("auto_id_prefix", "listener_auto_id_prefix"), "names clients whose sessions end with the connection"
    ),
    **dict.fromkeys(("enable_control_api", "http_api"), "serves administrators"),
    "sys_interval": "says how often the broker publishes about itself below $SYS",
    "user": "names the account under which the broker runs",
    "plugin_use": "names a plugin that another line loads, and which is reported there",
    **dict.fromkeys(
        ("bridge_max_topic_alias", "max_topic_alias_broker"), "shortens names on the way; receivers see whole ones"
    ),
    **dict.fromkeys(
        ("attempt_unsubscribe", "bridge_attempt_unsubscribe"), "ends subscriptions of an earlier configuration only"
    ),
    **dict.fromkeys(
        ("bridge_reload_type", "restart_timeout"),
        "says how soon a bridge connects again, after which it carries the same",
    ),
    **dict.fromkeys(("idle_timeout", "threshold"), "counts only with `start_type lazy`, which is reported"),
}
"""Directives that no verdict rests on, each with the reason."""
