"""What a BPMN model can state for C-QoS: the one table of the words in the namespace ``http://qos``."""

from __future__ import annotations

from typing import Final

from cqos_core.model.excerpt import NAMESPACES
from cqos_core.packs.drawing_notation import DrawnAttribute, DrawnForm, DrawnOwner, DrawnWord

_TRUTH: Final = ("true", "false")
BOUNDS: Final = ("exactly", "at_least", "at_most", "not")
"""What a check may require of its ``policy``."""
ROLES: Final = ("publisher", "subscriber")
SEVERITIES: Final = ("error", "warning", "note")
WHERE: Final = {
    "role": "Only endpoints of this role.",
    "topic": "Only topics of this name; `*` and `?` stand for any text and any character.",
    "participant": "Only participants with this id or name, likewise a pattern.",
    "protocol": "Only this protocol, likewise a pattern.",
    "type": "Only this type of messages, likewise a pattern.",
    "id": "Only the event with this id, likewise a pattern.",
}
"""Where a check applies."""

_PROTOCOL: Final = DrawnWord("protocol", "protocol", "The protocol (rule pack); what stands nearer to an event wins.")
_EXTERNAL: Final = DrawnWord(
    "external", "external", "The partner is in no model, so that a missing one is no finding.", values=_TRUTH
)
_OPTION: Final = DrawnWord(
    "option",
    "option",
    "An assumption about the deployment.",
    element=True,
    attributes=(
        DrawnAttribute("protocol", "The protocol whose option it is; that of the model if not stated."),
        DrawnAttribute("name", "Name of the option.", required=True),
        DrawnAttribute("value", "Its value.", required=True),
    ),
)
_OWN_OPTION: Final = DrawnWord(
    _OPTION.name,
    _OPTION.meaning,
    "An option of this participant alone.",
    element=True,
    attributes=_OPTION.attributes[1:],
)
_ACCEPT: Final = DrawnWord(
    "accept",
    "exception",
    "A known exception: findings of a rule that do not count here.",
    element=True,
    attributes=(
        DrawnAttribute("rule", "Code or name of the rule.", required=True),
        DrawnAttribute("because", "The reason, for later readers.", required=True),
        DrawnAttribute("until", "The last day on which it holds, as 2027-01-31."),
    ),
)
_NEED: Final = DrawnWord(
    "need",
    "requirement",
    "What the application requires of the arriving data.",
    element=True,
    attributes=(
        DrawnAttribute("name", "The guarantee that it needs.", required=True),
        DrawnAttribute("value", "How much of it.", required=True),
    ),
)
_CHECK: Final = DrawnWord(
    "check",
    "team_rule",
    "A rule of the team for endpoints of this model.",
    element=True,
    attributes=(
        DrawnAttribute("name", "Its name, in kebab case; say the good pattern.", required=True),
        DrawnAttribute("because", "The reason, for later readers.", required=True),
        DrawnAttribute("policy", "The setting that it is about; or else write a `sentence`."),
        *(DrawnAttribute(each, f"The value that is required: {each.replace('_', ' ')} this.") for each in BOUNDS),
        DrawnAttribute("sentence", "A whole condition, for what one value cannot say."),
        *(DrawnAttribute(name, doc, values=ROLES if name == "role" else ()) for name, doc in WHERE.items()),
        DrawnAttribute("severity", "Severity of its findings; `error` if not stated.", values=SEVERITIES),
    ),
)

MODEL: Final = DrawnOwner(
    "model",
    ("bpmn:Definitions",),
    ("definitions", "collaborations"),
    (),
    (_PROTOCOL, _OPTION, _ACCEPT, _CHECK),
)
PARTICIPANT: Final = DrawnOwner(
    "participant",
    ("bpmn:Participant", "bpmn:Process"),
    ("participants", "processes"),
    ("participant", "option"),
    (_PROTOCOL, _EXTERNAL, _OWN_OPTION),
)
SIGNAL: Final = DrawnOwner("signal", ("bpmn:Signal",), ("signals",), ("topic",), (_EXTERNAL, _ACCEPT))
EVENT: Final = DrawnOwner(
    "event",
    ("bpmn:Event",),
    ("events",),
    ("endpoint",),
    (
        _PROTOCOL,
        DrawnWord("profile", "preset", "A preset or profile; settings of the event itself win over it."),
        _EXTERNAL,
        DrawnWord("type", "type", "The type of the messages, for instance `sensor_msgs/msg/Image`."),
        _NEED,
        _ACCEPT,
        DrawnWord("policy", "settings", "Settings as FaMe modeler writes them.", element=True, foreign=True),
    ),
)
FORM: Final = DrawnForm(NAMESPACES["qos"], "qos", "bpmn", (MODEL, PARTICIPANT, SIGNAL, EVENT))
