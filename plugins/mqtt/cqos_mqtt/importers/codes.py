"""What the importers of MQTT files report, beside what all importers do (``CQ0xx``).

MQTT900-MQTT919: AsyncAPI; MQTT920-MQTT939: Thing Descriptions and flows; MQTT940-MQTT959: Mosquitto;
MQTT960-MQTT979: bridges.
"""

from __future__ import annotations

from typing import Final

from cqos_core.model.code_info import CodeInfo

CODES: Final = (
    CodeInfo(
        "MQTT901",
        "unresolved-reference",
        "error",
        "A `$ref` leads to nothing.",
        "References within the document begin with `#/`; before that, the path of another file may stand, relative to the file "
        "that names it. Other files are read where the document is a file itself.",
    ),
    CodeInfo(
        "MQTT902",
        "cyclic-reference",
        "error",
        "References lead in a circle.",
        "What they stand for can never be found; the message shows the circle.",
    ),
    CodeInfo(
        "MQTT903",
        "no-mqtt-server",
        "warning",
        "No server of an AsyncAPI document speaks MQTT, so its channels are not read.",
        "No importer reads AsyncAPI over other protocols. A document without servers is read where it has MQTT bindings.",
        help="state `protocol: mqtt` (or mqtts, secure-mqtt) at a server, if there is one",
        leaves_out="document",
        missing=1,
    ),
    CodeInfo(
        "MQTT905",
        "value-left-open",
        "note",
        "A binding describes a value by a schema that allows several, so it is not known.",
        "Rules over it are not decided.",
        help="a `const` in the schema says which it is",
    ),
    CodeInfo(
        "MQTT906",
        "reference-to-the-network",
        "warning",
        "A `$ref` leads to the network, which is never asked.",
        "What stands there is not known.",
        help="save it as a file beside the document, and refer to that",
        leaves_out="file",
        missing=1,
    ),
    CodeInfo(
        "MQTT907",
        "document-of-another-version",
        "error",
        "The document is of a version of AsyncAPI that is not known.",
        "Versions 2.0 to 2.6 and 3.x are read.",
    ),
    CodeInfo(
        "MQTT920",
        "form-without-topic",
        "warning",
        "A form names neither a topic nor a filter, in its terms or in its address.",
        "It is passed over.",
        help="state `mqv:topic` or `mqv:filter`",
        leaves_out="form",
        missing=1,
    ),
    CodeInfo(
        "MQTT921",
        "topic-filled-in-later",
        "note",
        "A topic is filled in at run time, from messages or the environment, so it is not known here.",
        "It is passed over.",
        leaves_out="endpoint",
        missing=1,
    ),
    CodeInfo(
        "MQTT922",
        "node-without-broker",
        "warning",
        "A node names a broker that is not among the nodes of the flows.",
        "It is never connected.",
        help="choose a broker in the editor, or export the configuration nodes as well",
    ),
    CodeInfo(
        "MQTT923",
        "flows-without-mqtt",
        "note",
        "Flows of Node-RED have no MQTT node.",
        "Nothing is read from them.",
    ),
    CodeInfo(
        "MQTT940",
        "directive-refused",
        "error",
        "A line of mosquitto.conf or of an acl_file has a value that Mosquitto refuses.",
        "Mosquitto does not start with it.",
    ),
    CodeInfo(
        "MQTT941",
        "acl-not-read",
        "warning",
        "The acl_file or the file of dynamic security of a broker cannot be read, so who may publish and subscribe is not known.",
        "Then nothing is concluded about access.",
        help="name both files together, or put it where the configuration says",
        leaves_out="file",
    ),
    CodeInfo(
        "MQTT942",
        "listeners-differ",
        "note",
        "The listeners of a broker have different settings.",
        "Which of them holds depends on the listener that a client connects to; verdicts hold for each.",
    ),
    CodeInfo(
        "MQTT943",
        "bridge-takes-back",
        "warning",
        "A bridge carries a topic both ways, and the other broker does not know that it is a bridge.",
        "The other broker sends every message back that the bridge published there, so it arrives twice on this side.",
        help="leave `try_private` on, or set `bridge_protocol_version mqttv50`",
    ),
    CodeInfo(
        "MQTT944",
        "included-folder-not-read",
        "warning",
        "A configuration of Mosquitto includes the files of a folder that cannot be read.",
        "What the configuration does not state itself is unknown.",
        help="check the configuration where that folder is, or send its files along",
        leaves_out="folder",
    ),
    CodeInfo(
        "MQTT945",
        "log-without-publications",
        "note",
        "The log of a broker has no line of a publication.",
        "Who publishes is not known then, so subscriptions have no partner in this file.",
        help="set `log_type all` or `log_type debug`, or name the design beside the log",
        leaves_out="publisher",
        missing=1,
    ),
    CodeInfo(
        "MQTT946",
        "refused-by-access-control",
        "warning",
        "The log of a broker says that it refused a publication or a subscription.",
        "No subscriber gets a refused publication, and a refused subscription gets nothing; neither is an endpoint of the system.",
        help="check the access control of the broker for this client and topic",
    ),
    CodeInfo(
        "MQTT947",
        "user-never-connected",
        "note",
        "Users that the dynamic security of a broker lets in are not in its log.",
        "What they would subscribe and publish is not in the snapshot.",
        leaves_out="user",
        missing=1,
    ),
    CodeInfo(
        "MQTT960",
        "bridged-topic-incomplete",
        "warning",
        "A topic that a bridge is to carry is not described as far as the bridge needs it.",
        "The bridge does not carry it.",
    ),
    CodeInfo(
        "MQTT961",
        "bridge-setting-ignored",
        "warning",
        "A setting of a bridge has no effect.",
        "It looks as if it were in force, but the bridge does not read it.",
    ),
)
