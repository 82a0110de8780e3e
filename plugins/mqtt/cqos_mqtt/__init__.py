"""The MQTT rule pack of C-QoS. Here are only the hooks; everything else is imported when a check needs it."""

from __future__ import annotations

from collections.abc import Callable

from cqos_core.plugins import ExporterInfo, ImporterInfo, RulePackInfo, hookimpl


@hookimpl
def register_rule_packs(register: Callable[[RulePackInfo], None]) -> None:
    """Register ``mqtt``."""
    summary = "MQTT 3.1.1 and 5.0: publication, broker and subscription judged together"
    register(RulePackInfo("mqtt", summary, "cqos_mqtt.pack:PACK"))


@hookimpl
def register_importers(register: Callable[[ImporterInfo], None]) -> None:
    """Register the files in which people write what MQTT clients do."""
    for name, summary, suffixes in _READ:
        claim = f"cqos_mqtt.importers.detect:claims_{name}"
        reader = f"cqos_mqtt.importers.{name}:read"
        declines, inserter = _DECLINED.get(name, ""), _INSERTERS.get(name, "")
        register(ImporterInfo(name, summary, suffixes, claim, reader, declines=declines, inserter=inserter))


@hookimpl
def register_exporters(register: Callable[[ExporterInfo], None]) -> None:
    """Register the model of pairs for SPIN."""
    summary = "a Promela model of MQTT pairs for SPIN, with an LTL formula for each guarantee"
    register(ExporterInfo("promela", summary, ".pml", "cqos_mqtt.exporters.promela:write"))


_DOCUMENTS = (".yaml", ".yml", ".json")
_DECLINED = {"asyncapi": "cqos_mqtt.importers.detect:declines_asyncapi"}
_INSERTERS = {
    "asyncapi": "cqos_mqtt.importers.editing:insert_bindings",
    "mosquitto": "cqos_mqtt.importers.editing:state_directives",
    "node_red": "cqos_mqtt.importers.editing:state_fields",
    "wot": "cqos_mqtt.importers.editing:insert_terms",
}
_READ = (
    ("asyncapi", "AsyncAPI 2.x and 3.x documents with MQTT servers", _DOCUMENTS),
    ("wot", "W3C WoT Thing Descriptions with MQTT forms", (".jsonld", ".json", ".td")),
    ("node_red", "Flows of Node-RED (flows.json)", (".json",)),
    ("mosquitto", "Configurations of Mosquitto (mosquitto.conf)", (".conf",)),
    ("mosquitto_log", "Logs of Mosquitto, with `log_type all` or `subscribe`", (".log",)),
    ("mqtt_client", "Parameters of mqtt_client, the bridge between ROS 2 and MQTT", (".yaml", ".yml")),
)
