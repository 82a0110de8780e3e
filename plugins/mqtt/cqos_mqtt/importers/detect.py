"""Recognises the files of MQTT people from a name and the first bytes, without importing a parser."""

from __future__ import annotations

from typing import Final

from cqos_core.importers.format_detection import head_text
from cqos_core.model.regular_expressions import re, regular_expression

_ASYNCAPI: Final = regular_expression(r"""^(?:asyncapi|"asyncapi"|'asyncapi')[ \t]*:""", re.MULTILINE)
_ASYNCAPI_IN_FLOW: Final = regular_expression(r"""[{,]\s*["']?asyncapi["']?\s*:""")
_PROTOCOL: Final = regular_expression(r"""\bprotocol["']?\s*:\s*["']?([A-Za-z0-9-]+)""")
_FLOW: Final = regular_expression(r"(?:\s++|#[^\n]*+|---)*+\{")
_MQTT: Final = regular_expression(r"mqtt", re.IGNORECASE)
_CONTEXT: Final = regular_expression(r'"@context"\s*:', part='"@context"')
_THING: Final = regular_expression(r"www\.w3\.org/\d{4}/wot/td|w3\.org/ns/td|wot/td/v1")
_FORM: Final = regular_expression(r'"mqv:|"mqtts?://|"mqtts?\+')
_FLOWS: Final = regular_expression(r"\s*\[\s*\{")
_TAB: Final = regular_expression(r'"type"\s*:\s*"tab"|"wires"\s*:\s*\[')
_CUT: Final = 65_536
"""Bytes of a head that may not be the whole file."""
_NODE: Final = regular_expression(r'"type"\s*:\s*"mqtt(?:-broker| in| out)"')
_PARAMETERS: Final = regular_expression(r"""^[^#\n]*\bros__parameters["']?[ \t]*:""", re.MULTILINE, "ros__parameters")
_BRIDGED: Final = regular_expression(r"^[^#\n]*\b(?:ros2mqtt|mqtt2ros)\b", re.MULTILINE)
_DIRECTIVE: Final = regular_expression(
    r"^[ \t]*(?:listener[ \t]+\d+|port[ \t]+[18]883|allow_anonymous|persistence_location|persistent_client_expiration|max_queued_messages|"
    r"max_inflight_messages|queue_qos0_messages|per_listener_settings|acl_file|password_file|max_keepalive|max_qos|"
    r"upgrade_outgoing_qos|autosave_interval|sys_interval|retain_available|connection_messages|allow_zero_length_clientid|"
    r"max_packet_size|message_size_limit|allow_duplicate_messages)\b",
    re.MULTILINE,
)
_CONNECTION: Final = regular_expression(r"^[ \t]*connection \S", re.MULTILINE)
_LOGGED: Final = regular_expression(
    r"^[^\n]*?(?:mosquitto version \S+ (?:starting|running)$|New client connected from \S+ as .* \(p\d, c[01], k\d+|"
    r"Received (?:SUBSCRIBE from .|PUBLISH from .* \(d\d, q\d, r\d, m\d+, '))",
    re.MULTILINE,
)
_LOG_WORDS: Final = ("mosquitto version", "New client connected", "Received ")
"""Each line that `_LOGGED` finds has one of these."""
_TOPIC: Final = regular_expression(r"^[ \t]*(?:topic|address(?:es)?) \S", re.MULTILINE)


def claims_asyncapi(name: str, head: bytes) -> bool:  # noqa: ARG001 - the signature of all claims
    """Say whether this is an AsyncAPI document in which MQTT is spoken of."""
    text = head_text(head)
    if "asyncapi" not in text:
        return False
    key = _ASYNCAPI_IN_FLOW if _FLOW.match(text) else _ASYNCAPI
    return key.search(text) is not None and _MQTT.search(text) is not None


def declines_asyncapi(name: str, head: bytes) -> tuple[str, str] | None:  # noqa: ARG001
    """Say of an AsyncAPI document without MQTT that no importer reads its protocol."""
    text = head_text(head)
    if (_ASYNCAPI_IN_FLOW if _FLOW.match(text) else _ASYNCAPI).search(text) is None:
        return None
    spoken = ", ".join(dict.fromkeys(_PROTOCOL.findall(text)))
    what = f"this is an AsyncAPI document over {spoken}" if spoken else "this is an AsyncAPI document without MQTT"
    return f"{what}, which no importer reads", "AsyncAPI is read where its servers or bindings are of MQTT"


def claims_wot(name: str, head: bytes) -> bool:  # noqa: ARG001
    """Say whether this is a Thing Description with forms for MQTT."""
    text = head_text(head)
    return all(found.search(text) for found in (_CONTEXT, _THING, _FORM))


def claims_node_red(name: str, head: bytes) -> bool:  # noqa: ARG001
    """Say whether these are flows of Node-RED with MQTT nodes; in long ones these may come later."""
    text = head_text(head)
    if not text.lstrip().startswith("[") or _FLOWS.match(text) is None:
        return False
    return _NODE.search(text) is not None or (len(head) >= _CUT and _TAB.search(text) is not None)


def claims_mosquitto(name: str, head: bytes) -> bool:
    """Say whether this is a configuration of Mosquitto."""
    lower = name.lower()
    if not lower.endswith(".conf"):
        return False
    text = head_text(head)
    return (
        lower.endswith("mosquitto.conf")
        or _DIRECTIVE.search(text) is not None
        or (_CONNECTION.search(text) is not None and _TOPIC.search(text) is not None)
    )


def claims_mqtt_client(name: str, head: bytes) -> bool:  # noqa: ARG001
    """Say whether these are parameters of mqtt_client."""
    text = head_text(head)
    return _PARAMETERS.search(text) is not None and _BRIDGED.search(text) is not None


def claims_mosquitto_log(name: str, head: bytes) -> bool:  # noqa: ARG001 - the signature of all claims
    """Say whether this is a log of Mosquitto."""
    text = head_text(head)
    return any(words in text for words in _LOG_WORDS) and _LOGGED.search(text) is not None
