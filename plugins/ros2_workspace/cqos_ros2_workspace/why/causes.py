"""The causes, in the order in which people should look: each is a question to what was read, and says what to do.

A cause that the files cannot decide is not known, and comes with the command that decides it on the robot.
"""

from __future__ import annotations

import re
from typing import TYPE_CHECKING, Final, Literal, NamedTuple

from cqos_core.model.core_findings import asks_less
from cqos_core.model.finding import Severity, Verdict, plural
from cqos_core.model.spelling import nearest
from cqos_core.model.system import PUBLISHER, SUBSCRIBER
from cqos_ros2.names import expand
from cqos_ros2.types import full_type_name
from cqos_ros2_workspace.activation import activation
from cqos_ros2_workspace.launch.values import Unknown
from cqos_ros2_workspace.unread_nodes import UNDECIDED
from cqos_ros2_workspace.why.definitions import Defined
from cqos_ros2_workspace.why.interfaces import LOOPBACK

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Mapping, Sequence

    from cqos_core.model.finding import Finding
    from cqos_core.model.report import Report
    from cqos_core.model.system import System
    from cqos_core.packs.log_mismatches import Occurrence
    from cqos_core.resolving.resolved_endpoint import Resolved
    from cqos_ros2_workspace.system_join import Join, JoinedNode
    from cqos_ros2_workspace.why.security import Access

MIDDLEWARE_FILES: Final = ("CYCLONEDDS_URI", "FASTDDS_DEFAULT_PROFILES_FILE", "FASTRTPS_DEFAULT_PROFILES_FILE")
"""Variables that name the configuration of a middleware."""
_ELSEWHERE: Final = "programs on other machines are not found"
_RANGE: Final = "ROS_AUTOMATIC_DISCOVERY_RANGE"
_FINE: Final = ("SUBNET", "SYSTEM_DEFAULT")
_SPLITS: Final = {"ROS411", "ROS412", "ROS413", "DDS107", "DDS403"}
_SAME_FILES: Final = "build both sides with the same message files"
_UNREAD: Final = {"ROS978", "ROS983"}
"""Notes about nodes of which nothing is known, and about processes."""
_SHOWN: Final = 8
"""So many digits of a hash are shown."""
_QUOTED: Final = re.compile(r"`([^`]+)`")
State = Literal["found", "excluded", "not known"]


class Switched(NamedTuple):
    """A launch argument whose other value starts a node with a missing side of the topic."""

    argument: str
    value: str
    node: str
    role: str


class Evidence(NamedTuple):
    """What was read.

    Attributes:
        topic: the name that is asked about.
        ends: the endpoints on it, by role.
        names: the topics of all endpoints, by role.
        environment: variables that the launch or the caller states.
        said: what logs say about the topic.
        join: of a workspace; None: no launch was read.
        access: what a keystore says of the topic; None: no keystore was read.
        interfaces: those that the configuration of the middleware names, by variable; None: it was not read.
        switched: launch arguments that decide whether a missing publisher starts, or a subscriber where only that is missing.
        untried: programs that only several arguments together start.
        hashes: of the types of endpoints that run, by endpoint.
        defined: what message files of the workspace say of the types on the topic.
    """

    topic: str
    system: System
    report: Report
    ends: Mapping[str, Sequence[Resolved]]
    names: Mapping[str, Sequence[str]]
    environment: Mapping[str, str]
    said: Sequence[Occurrence]
    join: Join | None
    access: Access | None
    interfaces: Mapping[str, Sequence[str] | None]
    switched: Sequence[Switched]
    untried: Sequence[str]
    hashes: Mapping[str, str]
    defined: Mapping[str, Defined | Unknown]

    @property
    def both(self) -> bool:
        """Whether both sides are there."""
        return bool(self.ends[PUBLISHER]) and bool(self.ends[SUBSCRIBER])

    @property
    def findings(self) -> list[Finding]:
        """Return errors and warnings about endpoints of the topic."""
        ids = {each.id for side in self.ends.values() for each in side}
        return [
            each
            for each in self.report.findings
            if each.severity is not Severity.NOTE and (ids & {*each.endpoints} or each.topic == self.topic)
        ]

    @property
    def unread(self) -> list[str]:
        """Return what was not read or is not known, in which a missing side may be; parts that were not read first.

        A node whose start a launch argument decides is none of it: `switched` says what it does.
        """
        parts = [
            each.message
            for each in self.system.notes
            if each.code in _UNREAD or any(not part.cause.startswith(UNDECIDED) for part in each.parts)
        ]
        return list(dict.fromkeys([*parts, *self.noted("ROS979")]))

    def noted(self, *codes: str) -> list[str]:
        """Return what notes of some codes say."""
        return [each.message for each in self.system.notes if each.code in codes]


class Answer(NamedTuple):
    """What the files say of one cause.

    Attributes:
        do: the command or the change; empty where there is nothing to do.
    """

    state: State
    text: str
    do: str = ""


class Cause(NamedTuple):
    """One cause."""

    name: str
    look: Callable[[Evidence], Answer]


def _name(seen: Evidence) -> Answer:
    missing = [role for role in (PUBLISHER, SUBSCRIBER) if not seen.ends[role]]
    if not missing:
        return Answer("excluded", "a publisher and a subscriber have this name")
    opaque = seen.unread or seen.noted("ROS980")
    what = " and no ".join(missing)
    role = missing[0]
    near = nearest(seen.topic, [each for each in seen.names[role] if each != seen.topic])
    last = seen.topic.rpartition("/")[2]
    same = [each for each in seen.names[role] if each != seen.topic and each.rpartition("/")[2] == last]
    meant = same[0] if same else near
    if meant and not seen.unread:
        return Answer(
            "found", f"no {what} has this name; a {role} is on `{meant}`", f"use one name: `{seen.topic}` or `{meant}`"
        )
    if opaque:
        perhaps = f"; perhaps it is the {role} on `{meant}`" if meant else ""
        return Answer(
            "not known", f"no {what} is known; {opaque[0]}{perhaps}", f"ros2 topic info --verbose {seen.topic}"
        )
    if seen.switched:
        return Answer("not known", f"no {what} is started, and a launch argument decides whether one is")
    return Answer("found", f"no {what} in what was read", f"ros2 topic info --verbose {seen.topic}")


def _remap(seen: Evidence) -> Answer:
    for each in seen.system.notes:
        named = {f"/{word.lstrip('/')}" for word in _QUOTED.findall(each.message)}
        if each.code in {"ROS972", "ROS973"} and seen.topic in named:
            return Answer("found", each.message, each.help or "")
    if seen.both:
        return Answer("excluded", "both names are those after remaps")
    if seen.join is None:
        return Answer("not known", "no launch file was read", "name the workspace with --launch FILE")
    if seen.noted("ROS978", "ROS979"):
        return Answer("not known", "some nodes are not wholly known", f"ros2 topic info --verbose {seen.topic}")
    return Answer("excluded", "no remap of the launch is about this topic without effect")


def _type(seen: Evidence) -> Answer:
    sides = [{each.endpoint.type for each in seen.ends[role]} for role in (PUBLISHER, SUBSCRIBER)]
    if not seen.both:
        return Answer("not known", "one side is missing")
    if any(None in side for side in sides):
        return Answer("not known", "an endpoint states no type", f"ros2 topic info --verbose {seen.topic}")
    full = [{full_type_name(each or "") for each in side} for side in sides]
    if not full[0] & full[1]:
        return Answer(
            "found", f"published as {_listed(full[0])}, subscribed as {_listed(full[1])}", "use one type on both sides"
        )
    differ = [each for each in seen.noted("ROS907") if f"`{seen.topic}`" in each]
    if differ:
        return Answer("found", differ[0], _SAME_FILES)
    return _definition(seen, full[0] & full[1])


def _definition(seen: Evidence, types: set[str]) -> Answer:
    """Say whether both sides of a type have one definition: by the hashes of what runs, and by the message files."""
    ends = [each for side in seen.ends.values() for each in side if full_type_name(each.endpoint.type or "") in types]
    by_digest = {seen.hashes[each.id]: each.participant.participant.id for each in ends if each.id in seen.hashes}
    said = _listed(types)
    if len(types) == 1 and len(by_digest) > 1:
        who = " and ".join(f"`{node}` with {digest[:_SHOWN]}…" for digest, node in sorted(by_digest.items()))
        return Answer("found", f"both sides have {said}, from different definitions: {who}", _SAME_FILES)
    (digest, node), *_ = [*by_digest.items(), ("", "")]
    if len(types) == 1 and by_digest and all(each.id in seen.hashes for each in ends):
        return Answer("excluded", f"both sides have {said}, from one definition ({digest[:_SHOWN]}…)")
    file = seen.defined.get(min(types))
    if len(types) == 1 and by_digest and isinstance(file, Defined):
        if file.digest == digest:
            return Answer("excluded", f"both sides have {said}, and what runs has the definition in {file.path}")
        text = f"`{node}` runs another definition of {said} ({digest[:_SHOWN]}…) than {file.path} ({file.digest[:_SHOWN]}…)"
        return Answer("found", text, _SAME_FILES)
    text = f"both sides have {said}; whether both were built from one definition shows only on the robot"
    return Answer("excluded", f"{text} ({file.cause})" if by_digest and isinstance(file, Unknown) else text)


def _domain(seen: Evidence) -> Answer:
    texts = [{_setting(each, "domain") for each in seen.ends[role]} for role in (PUBLISHER, SUBSCRIBER)]
    if seen.both and all(side and None not in side for side in texts):
        if not texts[0] & texts[1]:
            return Answer(
                "found",
                f"ROS_DOMAIN_ID is {_listed(texts[0])} and {_listed(texts[1])}",
                "export ROS_DOMAIN_ID=0  # on both",
            )
        return Answer("excluded", f"both are in domain {_listed(texts[0] & texts[1])}")
    return Answer(
        "not known", "ROS_DOMAIN_ID of both programs is not stated", "printenv ROS_DOMAIN_ID  # on both machines"
    )


def _setting(each: Resolved, name: str) -> str | None:
    settings = each.participant.participant.settings
    found = settings.get(name) or settings.get("ROS_DOMAIN_ID")
    return None if found is None or found.unknown else found.text


def _qos(seen: Evidence) -> Answer:
    if seen.said:
        misfit = seen.said[0].misfit
        policies = f" ({', '.join(misfit.policies)})" if misfit.policies else ""
        return Answer(
            "found", f"a program reports incompatible QoS{policies}", "cqos explain --log LOG FILE…  # names both ends"
        )
    groups = [each for each in seen.report.groups if _same(each.topic, seen.topic)]
    verdicts = {each.verdict for each in groups}
    findings = [each for each in seen.findings if each.verdict is not None]
    if Verdict.INCOMPATIBLE in verdicts and findings:
        return Answer("found", findings[0].message, _fix(findings[0]))
    if any(each.code == "ROS202" for each in seen.findings):
        late = next(each for each in seen.findings if each.code == "ROS202")
        return Answer("found", late.message, _fix(late))
    if not groups:
        return Answer("not known", "no pair was compared")
    if verdicts == {Verdict.COMPATIBLE}:
        pairs = sum(each.pairs for each in groups)
        return Answer("excluded", f"{plural(pairs, 'pair')} {'is' if pairs == 1 else 'are'} compatible")
    return Answer(
        "not known",
        findings[0].message if findings else "a policy of a pair is not known",
        "cqos explain FILE… PUBLISHER SUBSCRIBER",
    )


def _fix(finding: Finding) -> str:
    if not finding.remedies:
        return finding.help or ""
    fix = finding.remedies[0]
    return f"{fix.text} ({asks_less(fix)})" if fix.weakens else fix.text


def _partition(seen: Evidence) -> Answer:
    split = next((each for each in seen.findings if each.code in _SPLITS), None)
    if split is not None and seen.environment.get("RMW_IMPLEMENTATION", "").startswith("rmw_fastrtps"):
        return Answer("found", split.message, "set one partition and one ownership for both sides")
    if split is not None:
        return Answer("not known", split.message, "printenv RMW_IMPLEMENTATION  # on both machines")
    if seen.noted("ROS963"):
        return Answer(
            "not known", seen.noted("ROS963")[0], "set partitions in the default profile, the same on both sides"
        )
    if any(overlay.name.startswith("Fast DDS") for overlay in seen.system.overlays):
        return Answer("excluded", "the profiles of Fast DDS that were read keep nothing apart")
    return Answer(
        "not known",
        "ROS 2 sets none, and an XML file of the middleware may",
        "printenv FASTRTPS_DEFAULT_PROFILES_FILE FASTDDS_DEFAULT_PROFILES_FILE CYCLONEDDS_URI",
    )


def _variable(name: str, silent: Mapping[str, str], harmless: Iterable[str] = ()) -> Callable[[Evidence], Answer]:
    """Return the question after a variable: what its values keep apart, and which keep nothing apart."""
    fine = tuple(harmless)

    def look(seen: Evidence) -> Answer:
        value = seen.environment.get(name)
        if value is None:
            return Answer("not known", f"{name} is not stated", f"printenv {name}  # on both machines")
        if value.upper() in silent:
            return Answer("found", f"{name}={value}: {silent[value.upper()]}", f"unset {name}  # on both machines")
        if value in fine or value.upper() in fine:
            return Answer("excluded", f"{name}={value or '(empty)'} keeps nothing apart")
        return Answer("not known", f"{name}={value}", f"compare {name} on both machines")

    return look


def _peers(seen: Evidence) -> Answer:
    """Say whether static peers are all that programs find; otherwise they only add to what is found."""
    value, reach = (seen.environment.get(name) for name in ("ROS_STATIC_PEERS", _RANGE))
    if (reach or "").upper() in _FINE or (reach is None and value == ""):
        return Answer("excluded", "static peers only add to what is found")
    if value is None or reach is None or not _local(value):
        text = "ROS_STATIC_PEERS is not stated" if value is None else f"ROS_STATIC_PEERS={value}"
        return Answer("not known", text, f"printenv ROS_STATIC_PEERS {_RANGE}  # on both machines")
    text = f"{_RANGE}={reach} and ROS_STATIC_PEERS={value or '(empty)'}: {_ELSEWHERE}"
    return Answer("found", text, "export ROS_STATIC_PEERS=ADDRESS  # of the other machine")


def _servers(seen: Evidence) -> Answer:
    """Say whether the discovery servers of Fast DDS are on this machine only."""
    name, middleware = "ROS_DISCOVERY_SERVER", seen.environment.get("RMW_IMPLEMENTATION", "")
    value = seen.environment.get(name)
    if middleware and "fastrtps" not in middleware:
        return Answer("excluded", f"{middleware} does not read {name}")
    if value is None or not _local(value):
        text = f"{name} is not stated" if value is None else f"{name}={value}"
        return Answer("not known", text, f"printenv {name}  # on both machines")
    if not value:
        return Answer("excluded", f"{name}=(empty) keeps nothing apart")
    return Answer(
        "found", f"{name}={value}: {_ELSEWHERE}", f"export {name}=ADDRESS:PORT  # of the machine of the server"
    )


def _local(addresses: str) -> bool:
    """Whether no address of a list is one of another machine."""
    hosts = (each.rpartition(":")[0] or each for each in re.split("[;,]", addresses) if each)
    return LOOPBACK.issuperset(host.strip("[] ").lower() for host in hosts)


def _interfaces(seen: Evidence) -> Answer:
    """Say whether the middleware uses the loopback interface only."""
    for name, found in seen.interfaces.items():
        if found and LOOPBACK.issuperset(found):
            return Answer(
                "found", f"{name} names {_listed(found)} only: {_ELSEWHERE}", f"unset {name}  # on both machines"
            )
        if found:
            return Answer("not known", f"{name} names {_listed(found)}", "ip address  # on both machines")
    if seen.interfaces and all(found is not None for found in seen.interfaces.values()):
        return Answer("excluded", f"{_listed(seen.interfaces)} names no interface")
    if seen.interfaces:
        name = next(iter(seen.interfaces))
        return Answer("not known", f"{name} is not read", f"--define {name}=FILE")
    if all(seen.environment.get(name) == "" for name in MIDDLEWARE_FILES):
        return Answer("excluded", "no configuration of the middleware is used")
    return Answer("not known", "CYCLONEDDS_URI is not stated", f"printenv {' '.join(MIDDLEWARE_FILES)}")


_VERBS: Final = {"publish": "publish", "subscribe": "subscribe to"}


def _security(seen: Evidence) -> Answer:
    """Say whether access control refuses the topic to programs."""
    enabled = seen.environment.get("ROS_SECURITY_ENABLE")
    if enabled is not None and enabled.lower() != "true":
        return Answer("excluded", f"ROS_SECURITY_ENABLE={enabled or '(empty)'} switches security off")
    found = seen.access
    if found is None or not found.enclaves:
        text = "no keystore was read" if found is None else "the keystore has no permissions"
        return Answer("not known", text, "printenv ROS_SECURITY_ENABLE ROS_SECURITY_KEYSTORE  # then --keystore DIR")
    guarded = [each for each in found.refused if found.guarded.get(each, True)]
    if not guarded:
        return Answer("excluded", "the governance protects neither side of this topic")
    for direction in guarded:
        if len(found.refused[direction]) == len(found.enclaves):
            text = f"no enclave may {_VERBS[direction]} it: {_listed(found.enclaves)}"
            return Answer(
                "found", text, f"allow to {_VERBS[direction]} `rt{seen.topic}` in permissions.xml, and sign it"
            )
    refused = {direction: found.refused[direction] for direction in guarded if found.refused[direction]}
    if not refused:
        return Answer("excluded", f"all enclaves may publish it and subscribe to it: {_listed(found.enclaves)}")
    text = " and ".join(f"{_listed(names)} may not {_VERBS[direction]} it" for direction, names in refused.items())
    return Answer(
        "not known", f"which enclave a program uses is not stated; {text}", "ros2 node info NODE  # and its --enclave"
    )


def _lifecycle(seen: Evidence) -> Answer:
    inactive = [each for each in seen.system.notes if each.code == "ROS976" and each.severity == "warning"]
    owners = {each.participant.participant.id for side in seen.ends.values() for each in side}
    for each in inactive:
        if any(f"`{owner}`" in each.message for owner in owners):
            node = next(owner for owner in owners if f"`{owner}`" in each.message)
            return Answer(
                "found", each.message, f"ros2 lifecycle set {node} configure && ros2 lifecycle set {node} activate"
            )
    if seen.join is None:
        node = next(iter(sorted(owners)), "NODE")
        return Answer(
            "not known", "whether lifecycle nodes are active shows only on the robot", f"ros2 lifecycle get {node}"
        )
    waiting = next((each for each in seen.join.nodes if _waits(each) and _activated(each) & owners), None)
    if waiting is not None:
        manager, node = waiting.placed.address, min(_activated(waiting) & owners)
        ask = f"ros2 service call {manager}/manage_nodes nav2_msgs/srv/ManageLifecycleNodes '{{command: 0}}'"
        if isinstance(waiting.filled.at_start, Unknown):
            return Answer("not known", f"whether `{manager}` activates `{node}` at the start is not known", ask)
        return Answer("found", f"`{manager}` activates `{node}` only when a program asks for it", ask)
    # A node that another one creates is activated by that.
    stated = [node.placed for node in seen.join.nodes if node.filled.lifecycle and not node.placed.depth]
    lifecycle = {placed.address for placed in stated}.intersection(owners)
    unmanaged = min(lifecycle - activation(seen.join).managed, default="")
    if unmanaged:
        return Answer("not known", f"what activates `{unmanaged}` is not known", f"ros2 lifecycle get {unmanaged}")
    if not lifecycle:
        return Answer("excluded", "no lifecycle node that the launch starts is on this topic")
    return Answer("excluded", "a manager of the launch activates the lifecycle nodes on this topic")


def _waits(manager: JoinedNode) -> bool:
    return manager.filled.activates is not None and manager.filled.at_start is not True


def _activated(manager: JoinedNode) -> set[str]:
    """Return the full names of the nodes that a manager activates."""
    activates, placed = manager.filled.activates, manager.placed
    names = activates.value if activates is not None else ()
    listed = names if isinstance(names, (list, tuple)) else ()
    return {expand(str(name), placed.namespace, placed.name) for name in listed}


def _condition(seen: Evidence) -> Answer:
    if seen.join is None:
        return Answer("not known", "no launch file was read", "name the workspace with --launch FILE")
    if seen.switched:
        first = seen.switched[0]
        does = "publishes" if first.role == PUBLISHER else "subscribes to"
        text = f"with `{first.argument}:={first.value}` the launch starts `{first.node}`, which {does} it"
        state: State = "not known" if seen.unread else "found"
        return Answer(state, text, f"--launch-arg {first.argument}:={first.value}")
    open_nodes = seen.join.placing.undecided
    if open_nodes:
        subjects = sorted({guard.subject for each in open_nodes for guard in each.guards})
        return Answer(
            "not known", f"whether nodes start depends on {_listed(subjects)}", f"--launch-arg {subjects[0]}:=VALUE"
        )
    if seen.untried:
        what = _listed(seen.untried)
        return Answer("not known", f"no argument alone starts {what}", "cqos launch FILE  # and its arguments")
    return Answer("excluded", "no condition of the launch is about this topic")


def _same(one: str, other: str) -> bool:
    return one == other or one.split(" ", maxsplit=1)[0] == other


def _listed(names: Iterable[object]) -> str:
    return ", ".join(f"`{each}`" for each in sorted(map(str, names)))


CAUSES: Final = (
    Cause("name", _name),
    Cause("remap", _remap),
    Cause("launch condition", _condition),
    Cause("type", _type),
    Cause("quality of service", _qos),
    Cause("lifecycle", _lifecycle),
    Cause("domain", _domain),
    Cause("partition", _partition),
    Cause(
        "discovery range",
        _variable(_RANGE, {"OFF": "no program is found but static peers", "LOCALHOST": _ELSEWHERE}, _FINE),
    ),
    Cause("static peers", _peers),
    Cause("localhost only", _variable("ROS_LOCALHOST_ONLY", {"1": _ELSEWHERE}, ("0", ""))),
    Cause("discovery server", _servers),
    Cause("network interfaces", _interfaces),
    Cause("security", _security),
)
