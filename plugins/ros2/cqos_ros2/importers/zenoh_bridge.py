"""Reads configurations of the Zenoh bridge for ROS 2 over DDS (zenoh-plugin-ros2dds; zenoh-bridge-ros2dds by itself).

The bridge is a node in a domain and a peer on Zenoh. It carries the topics of its nodes to Zenoh, below its namespace. It carries
topics of other bridges to the subscriptions of its nodes. ``allow`` and ``deny`` limit both. Each side of a topic copies the first
endpoint that the bridge discovers. It knows all QoS of an endpoint of its own nodes. Of an endpoint behind another bridge it knows
only reliability, durability and history. Lifespan never crosses, and towards subscriptions
the bridge is always reliable (routes_mgr.rs, qos_helpers.rs, liveliness_mgt.rs, route_publisher.rs, route_subscriber.rs).
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import PurePath
from typing import TYPE_CHECKING, Final

from cqos_core.importers.source_reading import described, did_you_mean, listed, shown
from cqos_core.importers.tree import MappingNode, ScalarNode, SequenceNode, kind_of, stated, walk, whole_number
from cqos_core.model.re2_patterns import PatternError, name_matcher
from cqos_core.model.regular_expressions import re
from cqos_core.model.settings import EVERY_OTHER, Setting
from cqos_core.model.system import PUBLISHER, SUBSCRIBER, Bridge, Endpoint, Route
from cqos_ros2.guarantee_terms import SENDING_AGAIN
from cqos_ros2.importers.configuration import Configuration
from cqos_ros2.names import KEY
from cqos_ros2.policies import FROM_FIRST, WAIT_BEFORE_CLOSE, ZENOH_TRANSPORT

if TYPE_CHECKING:
    from collections.abc import Iterator

    from cqos_core.importers.tree import Node
    from cqos_core.model.settings import Settings
    from cqos_core.model.source import Source
    from cqos_core.model.system import Role

NAME: Final = "zenoh_bridge"
PLUGIN: Final = "ros2dds"
_NODE: Final = "zenoh_bridge_ros2dds"
_YAML: Final = (".yaml", ".yml")
_JSON: Final = (".json5", ".json")
_KEYS: Final = (
    *("namespace", "nodename", "domain", "ros_localhost_only", "ros_automatic_discovery_range", "ros_static_peers"),
    *("shm_enabled", "allow", "deny", "pub_max_frequencies", "pub_priorities", "reliable_routes_blocking"),
    *("queries_timeout", "transient_local_cache_multiplier", "work_thread_num", "max_block_thread_num"),
    *("__required__", "__path__", "__config__"),
)
_RANGES: Final = ("SUBNET", "LOCALHOST", "OFF", "SYSTEM_DEFAULT")
_KINDS: Final = (
    *("publishers", "subscribers", "service_servers", "service_clients"),
    *("action_servers", "action_clients"),
)
# It looks for a part that is right, so that others may stand beside it, if only Zenoh takes them as keys (lib.rs, run).
_NAMESPACE: Final = re.compile(r"/|(?:/[^/*$#?]++)++")
_NODENAME: Final = re.compile(r"(?=.*[A-Za-z0-9_])[^/*$#?]++(?:/[^/*$#?]++)*+")
_LARGEST_DOMAIN: Final = 232
_CACHE: Final = "10"
_WAIT: Final = ("transport", "link", "tx", "queue", "congestion_control", "block", "wait_before_close")

_ANNOUNCED: Final = ("durability", "history", "depth")
_COPIED: Final = (*_ANNOUNCED, "deadline", "liveliness", "liveliness_lease_duration")


def _is_json5(source: Source) -> bool:
    """Whether Zenoh reads a file as JSON5, by its ending; without a known one, whether it looks like that."""
    name = source.name.lower()
    if name.endswith((*_YAML, *_JSON)):
        return name.endswith(_JSON)
    return source.data[:64].replace(b"\0", b"").lstrip(b"\xef\xbb\xbf\xfe\xff \t\r\n").startswith((b"{", b"/"))


def _below(node: Node | None, *path: str) -> Node | None:
    """Return what stands below a map at the end of a path, None where there is nothing."""
    for name in path:
        node = stated(node, name) if isinstance(node, MappingNode) else None
    return node


class _Reader(Configuration):
    """Reads a configuration as a bridge between the nodes of its domain and the other bridges on Zenoh.

    ``refuses`` tells that the bridge does not start with it.
    """

    refuses = False

    def run(self) -> None:
        """Find the configuration of the bridge."""
        root = self.document(json5=_is_json5(self.source))
        plugins = self.a_map(root, "configuration")
        _, plugged = plugins.entries.get("plugins", (None, None))
        found = self.a_map(plugged, "plugins").entries.get(PLUGIN)
        if found is None:
            self.problem("CQ010", f"there is no `plugins: {{{PLUGIN}: …}}` in it", root)
        else:
            self.bridge(found[0], self.a_map(found[1], PLUGIN), self.links(plugins))

    def links(self, root: MappingNode) -> Settings:
        """Return what the configuration says of the links of Zenoh, as far as it is clear."""
        found: Settings = {}
        ends = [_below(root, name, "endpoints") for name in ("connect", "listen")]
        locators = [node for node in walk(filter(None, ends)) if isinstance(node, ScalarNode) and "/" in node.text]
        protocols = {node.text.partition("/")[0].replace("-", "_") for node in locators}
        if not protocols:
            found[ZENOH_TRANSPORT.name] = Setting("tcp")  # what a bridge listens to by default
        elif protocols <= {*SENDING_AGAIN} or protocols == {"udp"}:
            found[ZENOH_TRANSPORT.name] = Setting(min(protocols), self.place(locators[0]))
        wait = _below(root, *_WAIT)
        microseconds = whole_number(wait) if isinstance(wait, ScalarNode) else None
        if wait is not None and microseconds is not None:
            text = f"{microseconds}us" if microseconds >= 0 else "infinite"
            found[WAIT_BEFORE_CLOSE.name] = Setting(text, self.place(wait))
        return found

    def bridge(self, key: ScalarNode, entries: MappingNode, links: Settings) -> None:
        """Add the two sides of the bridge, and a route for each direction."""
        for name, (own_key, _) in entries.entries.items():
            if name not in _KEYS:
                message = (
                    f"the bridge refuses keys that it does not know, such as {shown(name)}{did_you_mean(name, _KEYS)}"
                )
                self.note("ROS905", message, own_key, f"C-QoS knows {listed(_KEYS[:-3], 'and')}")
        name = self.a_word(entries, "nodename", _NODENAME, "letters, digits and `_`") or _NODE
        stem = PurePath(self.source.name).stem
        node = f"{name} ({stem})"
        wire = f"{node}/zenoh"
        own: Settings = {"bridge": Setting(node), "network": Setting(stem), "rmw": Setting("cyclonedds")}
        domain = stated(entries, "domain")
        if domain is not None and (number := self.a_count(entries, "domain")) is not None:
            if 0 <= number <= _LARGEST_DOMAIN:
                own["domain"] = self.setting(domain)
            else:
                self.refused(f"{number} is no ROS domain", domain, f"expected a number from 0 to {_LARGEST_DOMAIN}")
        own["bridge_cache"] = self.cache(entries)
        place = self.place(key)
        between: Settings = {"bridge": Setting(node), "rmw": Setting("zenoh_bridge"), **links}
        self.participant(node, place, own)
        self.participant(wire, place, between)
        self.others(entries)
        namespace = self.a_word(entries, "namespace", _NAMESPACE, "`/`, or parts that each begin with a slash") or "/"
        blocking = self.a_flag(entries, "reliable_routes_blocking", otherwise=True)
        routes = tuple(self.routes(key, entries, (node, wire), namespace.rstrip("/"), blocking=blocking))
        self.system.bridges[node] = Bridge(node, routes, place=place)

    def cache(self, entries: MappingNode) -> Setting:
        """Return how many times its depth the bridge keeps of a topic."""
        stated_here = stated(entries, "transient_local_cache_multiplier")
        multiplier = self.a_count(entries, "transient_local_cache_multiplier")
        if stated_here is None or multiplier is None:
            return Setting(_CACHE)
        if multiplier < 0:
            self.refused(f"{multiplier} is no multiplier", stated_here, "expected a whole number from 0")
            return Setting(_CACHE)
        if multiplier == 0:
            message = "with a cache of nothing, no subscription behind the bridge gets what was published before"
            advice = f"leave it at {_CACHE}, or state as many as a topic has publishers"
            self.note("ROS951", message, stated_here, advice)
        return self.setting(stated_here)

    def refused(self, message: str, where: Node, advice: str | None = None) -> None:
        """Report why the bridge does not start."""
        self.refuses = True
        self.note("ROS950", f"the bridge does not start with this: {message}", where, advice)

    def a_word(self, entries: MappingNode, name: str, form: re.Pattern[str], expected: str) -> str:
        """Return a text of a certain form, empty where none is stated."""
        text = self.a_text(entries, name)
        node = stated(entries, name)
        if text and node is not None and not form.fullmatch(text):
            self.refused(f"{shown(text)} is no {name}", node, f"expected {expected}")
            return ""
        return text

    def others(self, entries: MappingNode) -> None:
        """Look at what decides nothing here, but keeps the bridge from starting where it is wrong."""
        for name in ("ros_localhost_only", "shm_enabled"):
            self.a_flag(entries, name, otherwise=False)
        elsewhere = stated(entries, "__config__")
        if elsewhere is not None:
            self.note("ROS905", "more of the configuration is in a file of its own, which is not read", elsewhere)
        span = stated(entries, "ros_automatic_discovery_range")
        if span is not None and not (isinstance(span, ScalarNode) and span.text in _RANGES):
            self.refused(f"{described(span)} is no discovery range", span, f"expected {listed(_RANGES)}")
        for item in self.strings(entries, "pub_max_frequencies"):
            name, _, number = item.text.partition("=")
            if not _is_number(number):
                self.refused(f"{shown(item.text)} is not `<regex>=<hertz>`", item)
                continue
            whole = name == ".*" or (name.startswith("^") and name.endswith("$"))
            part = "" if whole else " in some part of their name"
            message = (
                f"of topics that {shown(name)} matches{part} only {number} samples a second go over the bridge, and it "
                "keeps but one sample in between"
            )
            self.note("ROS952", message, item, f"for whole names write `^{name}$={number}`" if not whole else None)
        for item in self.strings(entries, "pub_priorities"):
            number = item.text.partition("=")[2].removesuffix(":express")
            if number not in {*"1234567"}:
                self.refused(f"{shown(item.text)} is not `<regex>=<1-7>[:express]`", item)

    def strings(self, entries: MappingNode, name: str) -> Iterator[ScalarNode]:
        """Yield the texts of a list; one number in its place stands for all topics."""
        node = stated(entries, name)
        if isinstance(node, ScalarNode) and kind_of(node) == "number":
            yield ScalarNode(f".*={node.text}", node.line, node.column, plain=False)
        elif node is not None:
            for item in self.a_list(node, name):
                if isinstance(item, ScalarNode):
                    yield item
                else:
                    self.refuse(item, name, "a list of texts")

    # Routes

    def routes(
        self, key: ScalarNode, entries: MappingNode, sides: tuple[str, str], namespace: str, *, blocking: bool
    ) -> Iterator[Route]:
        """Yield what is taken to Zenoh and what is brought from there."""
        listed_kinds = {name: stated(entries, name) for name in ("allow", "deny")}
        allowed, denied = listed_kinds["allow"], listed_kinds["deny"]
        if allowed is not None and denied is not None:
            self.refused("it has both `allow` and `deny`", denied, "state one of them")
            return
        about = self.a_map(allowed or denied or MappingNode(key.line, key.column), "allow" if allowed else "deny")
        for name, (own_key, _) in about.entries.items():
            if name not in _KINDS:
                message = f"the bridge knows no kind of interface {shown(name)}{did_you_mean(name, _KINDS)}"
                self.note("ROS951", message, own_key, f"it knows {listed(_KINDS, 'and')}")
        node, wire = sides
        reliable = FROM_FIRST if blocking else "best_effort"
        outward = (
            self.end(SUBSCRIBER, node, "/*", key, ("reliability", *_COPIED)),
            self.end(PUBLISHER, wire, f"{KEY}{namespace}/*", key, _ANNOUNCED, reliability=reliable),
        )
        inward = (
            self.end(SUBSCRIBER, wire, f"{KEY}{namespace}/*", key, ("reliability", *_ANNOUNCED)),
            self.end(PUBLISHER, node, "/*", key, _COPIED, reliability="reliable"),
        )
        ways = [("publishers", outward, ""), ("subscribers", inward, f"{KEY}{namespace}")]
        for family in ("service", "action"):
            server, client = f"{family}_server", f"{family}_client"
            for asking, asked, before in ((node, wire, ""), (wire, node, f"{KEY}{namespace}")):
                names = [f"{KEY}{namespace}/*" if side == wire else "/*" for side in (asking, asked)]
                source = self.end(SUBSCRIBER, asking, names[0], key, (), server)
                target = self.end(PUBLISHER, asked, names[1], key, (), client)
                ways.append((f"{client if asking == node else server}s", (source, target), before))
        for kind, ends, before in ways:
            patterns, unknown = self.patterns(about, kind, before)
            if self.refuses:
                return  # what does not start carries nothing
            # Of an end that may carry nothing, nothing is known.
            perhaps = [replace(end, settings={EVERY_OTHER: unknown[0]}) if unknown else end for end in ends]
            if allowed is None:
                yield Route(perhaps[0], perhaps[1], self.place(key), but=patterns)
                continue
            yield Route(*ends, self.place(key), only=patterns, but=() if patterns else (".*",))
            if unknown:
                yield Route(perhaps[0], perhaps[1], self.place(key), but=patterns)

    def end(
        self,
        role: Role,
        participant: str,
        topic: str,
        where: Node,
        copied: tuple[str, ...],
        kind: str = "message",
        **others: str,
    ) -> Endpoint:
        """Return one end of a route; its partners may be in no file."""
        place = self.place(where)
        settings = {name: Setting(FROM_FIRST, place, derived=True) for name in copied}
        settings |= {name: Setting(text, place, derived=True) for name, text in others.items()}
        return Endpoint(
            id="",
            role=role,
            topic=topic,
            participant=participant,
            settings=settings,
            kind=kind,
            external=True,
            place=place,
        )

    def patterns(self, entries: MappingNode, kind: str, before: str) -> tuple[tuple[str, ...], tuple[Setting, ...]]:
        """Return the regular expressions of one kind of interface, as those of whole names with something before them.

        Beside them stands a setting that is not known for each expression that is not followed.
        """
        node = stated(entries, kind)
        found: list[str] = []
        unknown: list[Setting] = []
        for item in () if node is None else node.items if isinstance(node, SequenceNode) else [node]:
            if not isinstance(item, ScalarNode):
                self.refuse(item, kind, "a regular expression, or a list of them")
                continue
            try:
                found.append(whole_names(item.text, before))
            except PatternError as error:
                message = f"{shown(item.text)} is not followed, so what it lets over the bridge is not known: {error}"
                advice = "where the bridge cannot read it as a regular expression either, it does not start"
                self.note("ROS905", message, item, advice)
                cause = f"whether the bridge carries it: {shown(item.text)} is not followed"
                unknown.append(Setting("", self.place(item), unknown=cause, reported="ROS905"))
        return tuple(found), tuple(unknown)


def whole_names(text: str, before: str = "") -> str:
    """Return what an expression means to the bridge, which searches for ``^text$``, as one of whole names behind ``before``.

    A bar that stands in no brackets parts the ``^`` from the ``$``. Rust also repeats an anchor: behind ``^*`` a name may
    begin anywhere.

    Raises:
        PatternError: it is none, or may mean something else to Rust than to RE2.
    """
    ways = _ways(text)
    if odd := _otherwise(text, ways, before):
        raise PatternError(odd)
    literal = text.removeprefix("^").removesuffix("$")
    if _LITERAL.fullmatch(literal):
        return re.escape(f"{before}{literal}")
    anchored = ways[0].startswith("^")
    ways[0] = ways[0].removeprefix("^")
    start = ""
    if repeated := _REPEATED.match(ways[0]):
        ways[0] = ways[0][repeated.end() :]
        start = "" if anchored or repeated["least"] not in {None, "0"} or repeated[0].startswith("+") else ".*"
    last = len(ways) - 1
    parts = [f"{'.*' if number else start}(?:{way}){'' if number == last else '.*'}" for number, way in enumerate(ways)]
    whole = f"{re.escape(before)}(?:{'|'.join(parts)})"
    name_matcher(whole)
    return whole


_LITERAL: Final = re.compile(r"[\w/~:-]*")
_REPEATED: Final = re.compile(r"(?:[*+?]|\{(?P<least>\d+)(?:,\d*)?\})\??")
_TOKEN: Final = re.compile(
    r"\\.|\[\^?\]?(?:\[:\^?[a-z]+:\]|\\.|[^\]\\])*+\]|\{\d+(?:,\d*)?\}|\(\?(?:P?<\w+>|[imsU-]+\))|.", re.DOTALL
)
_BEGINNINGS: Final = frozenset(("^", r"\A", r"\b", r"\B"))
_NOT_RUST: Final = frozenset((*(rf"\{letter}" for letter in "QECZ<>0"), "{"))
"""What RE2 reads and Rust refuses, or reads in another way."""


def _otherwise(text: str, ways: list[str], before: str) -> str | None:
    """Say which part of an expression may mean something else to Rust than to RE2, or behind ``before``."""
    tokens = _TOKEN.findall(text)
    groups = [token for token in tokens if token.endswith(">") and token.startswith("(?")]
    if len(set(groups)) < len(groups):
        return "two groups have one name"
    for number, token in enumerate(tokens):
        if token in _NOT_RUST or tokens[number : number + 2] == [r"\b", "{"]:
            return f"`{token}` is not read alike by the bridge and here"
        if len(ways) > 1 and token.startswith("(?") and token.endswith(")"):
            return f"`{token}` before a bar is not followed"
        if before and number and token in _BEGINNINGS:
            return f"`{token}` within an expression is not followed"
    return None


def _ways(text: str) -> list[str]:
    """The parts of an expression between bars that stand in no brackets."""
    parts, depth = [[""]], 0
    for token in _TOKEN.findall(text):
        depth += (token.startswith("(") and not token.endswith(")")) - (token == ")")  # noqa: S105 - brackets
        if token == "|" and depth == 0:  # noqa: S105
            parts.append([""])
        else:
            parts[-1].append(token)
    return ["".join(part) for part in parts]


def _is_number(text: str) -> bool:
    try:
        return float(text) > 0
    except ValueError:
        return False


read = _Reader.load
