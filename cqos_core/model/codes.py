"""Codes of the core: what it reports about inputs, models, meeting and configuration. Permanent, like rule codes.

CQ0xx: reading (CQ001-CQ029 in general, CQ030-CQ059 BPMN, CQ060 several files together, CQ061 profiles alone); CQ2xx: settings and
profiles; CQ4xx: names and meeting; CQ5xx: bridges;
CQ6xx: accepted exceptions and the team's own rules; CQ7xx: plugins at fault.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal


@dataclass(frozen=True, slots=True)
class CodeInfo:
    """One thing the core, or the importers of a rule pack, may report.

    Attributes:
        name: the bad pattern in kebab case.
        severity: of the finding; a problem that stops the reading is always an error.
        summary: one sentence.
        reason: why it matters.
        help: what to do about it, as a finding says it that has no better advice.
        aliases: former codes and names.
    """

    code: str
    name: str
    severity: Literal["error", "warning", "note"]
    summary: str
    reason: str = ""
    aliases: tuple[str, ...] = ()
    help: str = ""

    @property
    def spellings(self) -> frozenset[str]:
        """What it may be called, in lower case: its code, name and aliases."""
        return frozenset(spelling.lower() for spelling in (self.code, self.name, *self.aliases))


_READING = (
    CodeInfo(
        "CQ001",
        "unreadable-file",
        "error",
        "The file cannot be read in its format: not well formed, cut off, or in another encoding than it says.",
        "Nothing is checked in a file that cannot be read whole; the place says where reading stopped.",
    ),
    CodeInfo(
        "CQ002",
        "refused-content",
        "error",
        "The file declares entities, or something in it is larger or deeper than any real file needs.",
        "Entities can read other files or fill the memory, so they are refused before they are looked at.",
    ),
    CodeInfo(
        "CQ003",
        "not-recognised",
        "error",
        "No importer knows the format of the file.",
        help="name the importer with `--from`, or give the file the ending of its format",
    ),
    CodeInfo(
        "CQ004",
        "wrong-version",
        "error",
        "A document does not say `cqos: 1`, or names a version of the form that is not known.",
        "What keys mean depends on the version, so nothing is read without it.",
    ),
    CodeInfo(
        "CQ005",
        "duplicate-key",
        "error",
        "A key stands twice in one map.",
        "Most parsers keep the last one silently; then half of what was written has no effect.",
    ),
    CodeInfo(
        "CQ006",
        "unknown-key",
        "error",
        "A key is not known at this place.",
        "A misspelt key would be without effect; the message names the nearest known one.",
    ),
    CodeInfo(
        "CQ007",
        "include-failed",
        "error",
        "A file that another one includes cannot be opened.",
    ),
    CodeInfo(
        "CQ008",
        "include-cycle",
        "error",
        "A file includes itself, directly or through others.",
        help="move what both need into a third file",
    ),
    CodeInfo(
        "CQ009",
        "wrong-kind-of-value",
        "error",
        "A value is of another kind than its key wants: a text where a map is expected, say.",
    ),
    CodeInfo(
        "CQ010",
        "missing-key",
        "error",
        "Something lacks a key that it cannot do without.",
        "Checks and exceptions without a reason, for instance, are not understood later.",
    ),
    CodeInfo(
        "CQ011",
        "value-not-allowed",
        "error",
        "A value is none of those that its key allows.",
    ),
    CodeInfo(
        "CQ012",
        "stated-twice",
        "error",
        "Something is stated twice: in two files, in two documents, or in two ways with different values.",
        "Which of them is meant cannot be known.",
        help="keep one of the two places, which are both named",
    ),
    CodeInfo(
        "CQ013",
        "duplicate-endpoint-id",
        "error",
        "Two endpoints have the same id, and at least one of them was given it.",
        "Exceptions, baselines and `cqos explain` use ids.",
    ),
    CodeInfo(
        "CQ014",
        "unknown-variable",
        "error",
        "A text mentions a variable that is not among the `instances`, or where nothing can be multiplied.",
        "`${name}` makes a copy for each instance; `$${` stands for the characters `${`.",
    ),
    CodeInfo(
        "CQ015",
        "name-without-variable",
        "error",
        "Something mentions a variable but its name does not, so all copies would have one name.",
        help="write the variable in the name too",
    ),
    CodeInfo(
        "CQ016",
        "too-many-instances",
        "error",
        "The instances multiply beyond what a person can review.",
        "Fewer instances show the same faults: copies of one thing differ in their names only.",
    ),
    CodeInfo(
        "CQ017",
        "undefined-alias",
        "error",
        "`*name` stands without quotes and refers to an anchor that is not there.",
        "Names and patterns that begin with `*` stand for anchors in YAML where they have no quotes.",
        help="write the name in quotes",
    ),
    CodeInfo(
        "CQ018",
        "unknown-tag",
        "error",
        "A value has a YAML tag that means nothing here.",
        "No objects are made from files.",
        help="write texts that begin with `!` in quotes",
    ),
    CodeInfo(
        "CQ019",
        "name-lost-in-comment",
        "warning",
        "A topic or filter with `#` is read as a comment.",
        "In YAML a `#` after a blank or at the beginning of a value begins a comment.",
        help="write the name in quotes",
    ),
    CodeInfo(
        "CQ020",
        "key-glued-to-value",
        "warning",
        "A key without a value has a colon in it, as in `{depth:5}`.",
        "In YAML a colon separates only with a blank after it.",
        help="write a blank after the colon",
    ),
    CodeInfo(
        "CQ029",
        "too-many-endpoints",
        "error",
        "Bridges carry so many topics that the system has more endpoints than are allowed.",
        "A few bridges that rename what they carry can make any number of topics, which would fill time and memory.",
        help="narrow the patterns of the bridges by `only` and `but`; CQOS_MAX_ENDPOINTS sets the limit of the command",
    ),
    CodeInfo(
        "CQ060",
        "stated-differently",
        "warning",
        "Files that are checked together state one participant, topic or broker differently, or a profile that another file uses.",
        "What they state differently is not known, so verdicts that rest on it are unknown.",
        help="give one of them another name, or state it once and include it",
    ),
    CodeInfo(
        "CQ061",
        "profiles-tried-alone",
        "note",
        "There are profiles and no endpoints, so each profile is tried as a publisher and a subscriber that meet.",
        "C-QoS reports what it can decide for a profile alone: whether its endpoints can be created, and whether two that share it fit.",
        help="check it together with the system that uses it to see what its endpoints really get",
    ),
    CodeInfo(
        "CQ030",
        "not-bpmn-20",
        "error",
        "The document is XML, but not BPMN 2.0 (20100524).",
        "Drafts and older versions use other names for the same things.",
        help="save the model as BPMN 2.0",
    ),
    CodeInfo(
        "CQ031",
        "duplicate-id",
        "warning",
        "Two elements have the same id.",
        "What refers to the id can mean either; the first one is taken, later ones are told apart by `#2`, `#3`.",
    ),
    CodeInfo(
        "CQ032",
        "dangling-reference",
        "warning",
        "A reference names an element that is not in the file.",
        "Other files are not searched for it.",
        help="fix the reference, or add what it names",
    ),
    CodeInfo(
        "CQ033",
        "signal-without-name",
        "warning",
        "A signal event has neither a signal with a name nor a name of its own, so it has no topic.",
        "Without a topic it matches no endpoint; it is not checked.",
    ),
    CodeInfo(
        "CQ034",
        "topic-guessed-from-event-name",
        "note",
        "A signal event names no signal, so its own name is taken for the topic.",
        "The topic changes with the event's name.",
        help="choose a signal for the event",
    ),
    CodeInfo(
        "CQ035",
        "signals-share-a-name",
        "note",
        "Two signals have the same name and are one topic.",
        "Modelers compare signals by id, C-QoS and middleware compare topics by name.",
    ),
    CodeInfo(
        "CQ036",
        "topic-known-at-run-time-only",
        "warning",
        "The topic's name is an expression that only the engine can compute.",
        "What is computed at run time cannot be checked at design time; the event is not paired.",
    ),
    CodeInfo(
        "CQ037",
        "signal-stays-in-its-instance",
        "note",
        "The signal has the scope of a process instance and never reaches a middleware.",
        "Events of such a signal are no publishers and no subscribers.",
    ),
    CodeInfo(
        "CQ038",
        "all-qos-zero",
        "note",
        "All eight QoS attributes of the event are 0.",
        "Some modelers write 0 everywhere into events that were never edited. So reliability is best_effort or the default, "
        "and durability transient_local or the default, alike on all such events; verdicts hold under both readings.",
        help="choose a value for reliability and durability, or remove the attributes",
    ),
    CodeInfo(
        "CQ039",
        "conflicting-values",
        "warning",
        "The same thing is stated twice with different values.",
        "Attributes of the element win over `qos:policy`, that wins over Camunda properties, and a later statement of "
        "the same kind over an earlier one.",
    ),
    CodeInfo(
        "CQ040",
        "misplaced-qos",
        "warning",
        "QoS is stated where nothing reads it.",
        "QoS belongs on the event that throws or catches a signal.",
        help="move it there, or take it away",
    ),
    CodeInfo(
        "CQ041",
        "unknown-qos-word",
        "warning",
        "An element or attribute in the namespace `http://qos` is not known, or not at this place.",
        "It is skipped; a misspelt word would otherwise be lost silently.",
    ),
    CodeInfo(
        "CQ042",
        "incomplete-qos-element",
        "error",
        "An element or attribute in the namespace `http://qos` lacks something that it needs.",
    ),
    CodeInfo(
        "CQ043",
        "bad-qos-value",
        "error",
        "An attribute of C-QoS's own has a value that it cannot have.",
    ),
    CodeInfo(
        "CQ044",
        "import-not-followed",
        "note",
        "The model imports another file, which is not opened.",
        "What stands in the other file matches no endpoint here.",
        help="give the files together",
    ),
    CodeInfo(
        "CQ045",
        "message-flows-not-read",
        "note",
        "The model has message flows but no signals.",
        "Message flows run between two points; reading them as topics is a convention that has to be switched on.",
        help="switch it on with `--message-flows` if that is what they mean",
    ),
    CodeInfo(
        "CQ046",
        "event-outside-process",
        "warning",
        "A signal event stands outside of every process, so no participant throws or catches it.",
    ),
    CodeInfo(
        "CQ047",
        "unknown-importer-switch",
        "error",
        "The importer has no such switch, or the switch no such value.",
    ),
    CodeInfo(
        "CQ048",
        "process-shared-by-participants",
        "note",
        "Several participants have the same process.",
        "Each of them throws and catches for itself: the events of the process count once for each.",
    ),
    CodeInfo(
        "CQ049",
        "message-without-name",
        "warning",
        "A message event or task has neither a message flow nor a message, so it has no topic.",
    ),
)
_MODEL = (
    CodeInfo(
        "CQ201",
        "protocol-without-pack",
        "warning",
        "No installed rule pack judges this protocol, so its endpoints are in no pair.",
        "Without rules there is no verdict.",
        help="install the plugin that brings the pack; `cqos packs` lists those that are there",
    ),
    CodeInfo(
        "CQ202",
        "unknown-setting",
        "error",
        "A setting has a name that its protocol does not know.",
        "A misspelt setting is silently not applied; the message names the nearest known one.",
    ),
    CodeInfo(
        "CQ203",
        "invalid-value",
        "error",
        "A setting's text is none of its policy's values.",
        "The value is treated as not known, so nothing that rests on it is called compatible.",
    ),
    CodeInfo(
        "CQ204",
        "unknown-profile",
        "error",
        "A profile is used that is neither defined nor a preset of the protocol.",
        "A name that means nothing sets nothing.",
        help="define it under `profiles:`, or use one of the presets that the message lists",
    ),
    CodeInfo(
        "CQ205",
        "setting-ignored",
        "warning",
        "A setting is stated that the middleware in use ignores, so it promises nothing.",
        "Readers of the design will rely on it.",
        help="take it away, or use a middleware that honours it",
    ),
    CodeInfo(
        "CQ206",
        "profile-shadows-preset",
        "warning",
        "A profile has the name of a preset with other values; the profile is used.",
        "A reader who knows the preset will expect its values.",
        help="give the profile a name of its own",
    ),
    CodeInfo(
        "CQ207",
        "preset-not-available",
        "error",
        "A preset is used that the stated version of the protocol does not have yet.",
        "Programs of that version do not know it.",
        help="write the values down instead, or target a version that has the preset",
    ),
    CodeInfo(
        "CQ208",
        "unknown-option-value",
        "warning",
        "An option has a value that the rule pack does not know; the nearest it knows stands in.",
        "The verdict rests on the value that stands in.",
        help="check the spelling; a newer rule pack may know the value",
    ),
    CodeInfo(
        "CQ209",
        "setting-stated-twice",
        "warning",
        "One policy is stated twice at one place, under different spellings and with different values.",
        "The last one is used.",
        help="keep only one",
    ),
    CodeInfo(
        "CQ210",
        "setting-without-effect",
        "warning",
        "A setting is stated for an endpoint of a role that does not have it.",
        "It changes nothing.",
        help="state it on the other side",
    ),
    CodeInfo(
        "CQ211",
        "need-not-judged",
        "warning",
        "The system states needs or bridges that no installed rule pack judges.",
        "They were read and are valid, but nothing was compared with them.",
    ),
    CodeInfo(
        "CQ212",
        "profile-cycle",
        "error",
        "Profiles are based on each other in a circle.",
        "What a profile sets is unknown while it rests on itself.",
        help="break the circle, which the message shows",
    ),
    CodeInfo(
        "CQ213",
        "unknown-start",
        "warning",
        "`starts_after` names neither a participant nor an endpoint of the system.",
        "The order of start is then not known.",
        help="correct the name",
    ),
    CodeInfo(
        "CQ214",
        "overlay-without-effect",
        "warning",
        "Settings that another file lays over endpoints cover none of them.",
        "The override is silently not applied.",
        help="correct the node, topic or entity that it names",
    ),
    CodeInfo(
        "CQ215",
        "overlay-gives-way",
        "warning",
        "A setting of another file decides only what endpoints leave open, and none of those that it covers does.",
        "It looks as if it were in force, but what the endpoints state themselves is.",
        help="leave the value open there, or take the setting away",
    ),
    CodeInfo(
        "CQ216",
        "broker-not-known",
        "error",
        "A participant names a broker that the system does not describe, or none where there are several.",
        "What the broker can do, and who else is connected to it, is then not known.",
        help="describe it under `brokers:`, or name one that is there",
    ),
    CodeInfo(
        "CQ217",
        "value-not-known",
        "warning",
        "The input does not say which value a setting has: a variable is not set, a file is missing, an expression is not read.",
        "Every verdict that depends on the value is unknown; no default is assumed in its place.",
        help="state what the message names",
    ),
    CodeInfo(
        "CQ218",
        "guarantee-not-stated",
        "warning",
        "A guarantee has to survive a fault for which its rule pack states neither a clause nor a run.",
        "Nothing is claimed there, so whether the requirement is met is not known.",
        help="drop the fault from `survives`, or verify it with the running system",
    ),
    CodeInfo(
        "CQ401",
        "subscriber-without-publisher",
        "warning",
        "Nobody in the system publishes what this endpoint subscribes to.",
        "It will never receive anything.",
        help="mark the topic or participant `external: true` if its publisher is elsewhere",
    ),
    CodeInfo(
        "CQ402",
        "publisher-without-subscriber",
        "note",
        "Nobody in the system subscribes to what this endpoint publishes.",
        "What it sends reaches no subscriber.",
        help="mark the topic or participant `external: true` if its subscriber is elsewhere",
    ),
    CodeInfo(
        "CQ403",
        "near-miss",
        "warning",
        "Two topics, one with publishers only and one with subscribers only, have names that nearly agree.",
        "They never meet.",
        help="correct one of the two names, if it is misspelt",
    ),
    CodeInfo(
        "CQ404",
        "nothing-compared",
        "warning",
        "Not a single publisher meets a subscriber, so nothing was compared.",
        "An empty comparison says nothing about compatibility. Where all endpoints have their partners elsewhere it is a note.",
        help="check the names, domains and protocols",
    ),
    CodeInfo(
        "CQ405",
        "names-collapse",
        "warning",
        "Different names stand for one topic once they are written as the protocol demands.",
        "Their endpoints will meet although the design keeps them apart.",
        help="rename one of them",
    ),
    CodeInfo(
        "CQ406",
        "pair-within-participant",
        "note",
        "A participant subscribes to what it publishes itself.",
        "That is legal, but often a slip of the model.",
    ),
    CodeInfo(
        "CQ501",
        "bridge-without-side",
        "error",
        "A route of a bridge names a participant that there is not.",
        "Nothing is carried by that route until both its sides are participants of the system.",
    ),
    CodeInfo(
        "CQ502",
        "bridge-carries-nothing",
        "warning",
        "No topic matches the pattern of a bridge's route.",
        "Nothing is carried by that route; the pattern is probably misspelt.",
    ),
    CodeInfo(
        "CQ503",
        "bridge-loop",
        "warning",
        "What is published comes back to its own topic over two or more bridges.",
        "Every sample goes round for ever unless a bridge drops what it has seen; take one direction away.",
    ),
    CodeInfo(
        "CQ504",
        "bridge-gives-less",
        "note",
        "A bridge gets more than those behind it do: values that are not lost before it may be lost behind it.",
        "No requirement states that an application needs it, so it is no error.",
        help="state by `needs:` what an application requires; it is then an error that says what to change",
    ),
    CodeInfo(
        "CQ505",
        "bridge-into-shallow-topic",
        "warning",
        "A bridge carries several topics into one, which stores less for late subscribers than there are topics.",
        "The newest value of one topic pushes out that of another, so a late subscriber never learns of some.",
        help="carry each topic on under its own name, or store more",
    ),
    CodeInfo(
        "CQ506",
        "bridge-leaves-out",
        "note",
        "The expressions of a bridge's route keep back what its pattern would carry.",
        "Who waits for it behind the bridge gets nothing.",
    ),
    CodeInfo(
        "CQ507",
        "bridges-in-parallel",
        "error",
        "One sample reaches a subscription that needs `duplicate_free` over two ways, of which a bridge is at least one.",
        "Each way brings a copy, and the subscription takes both.",
        help="take one of the ways away, or let the application drop what it has seen",
    ),
    CodeInfo(
        "CQ508",
        "bridge-names-grow",
        "warning",
        "A bridge renames topics and gets back under longer names what it carried.",
        "Each time round the name grows, so there is no end of topics; the checks follow a name round once.",
        help="narrow the route by `only` or `but`, so that it takes nothing that comes back",
    ),
    CodeInfo(
        "CQ601",
        "unused-acceptance",
        "warning",
        "An entry of `accept` matches no finding.",
        "What it excused is gone, or its names are misspelt.",
        help="take it away, so that it cannot hide something new",
    ),
    CodeInfo(
        "CQ602",
        "expired-acceptance",
        "warning",
        "An entry of `accept` is past its `until` date and no longer holds.",
        "What was accepted for a time counts again.",
        help="mend what it excused, or decide anew until when it is accepted",
    ),
    CodeInfo(
        "CQ603",
        "unknown-rule",
        "warning",
        "A rule is named in `accept` or `severities` that no installed pack has.",
        "The entry has no effect.",
        help="correct the name; `cqos packs` lists the rules",
    ),
    CodeInfo(
        "CQ604",
        "invalid-check",
        "error",
        "An entry of `checks` cannot be applied: it names an unknown policy, or a value that is none.",
        "The team's rule is not checked until it is corrected.",
    ),
    CodeInfo(
        "CQ605",
        "team-rule",
        "error",
        "An endpoint does not keep one of the team's own rules.",
        "The rule and its reason stand under `checks`.",
    ),
    CodeInfo(
        "CQ606",
        "invalid-baseline",
        "error",
        "The file given as a baseline is none.",
        "Nothing in it can be taken as known.",
        help="write it anew with `cqos check --write-baseline`",
    ),
    CodeInfo(
        "CQ701",
        "rule-failed",
        "error",
        "A rule's own function raised an error, so what it says is not known.",
        "This is a fault of the rule pack, not of the design.",
        help="report it to the pack's authors",
    ),
    CodeInfo(
        "CQ702",
        "importer-failed",
        "error",
        "The importer of a plugin failed while it read the file.",
        "This is a fault of the plugin, whatever the file holds.",
        help="report it to the plugin's authors",
    ),
)
CODES: dict[str, CodeInfo] = {info.code: info for info in (*_READING, *_MODEL)}


_SPELLINGS = {spelling: info for info in CODES.values() for spelling in info.spellings}


def find_code(name: str) -> CodeInfo | None:
    """Return what the core reports under that code, name or alias, or None."""
    return _SPELLINGS.get(name.lower())
