"""Endpoints of a node from the facts about it: holes filled with the values of parameters, plugins added."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from itertools import count
from typing import TYPE_CHECKING, Any, Final, NamedTuple

from cqos_core.model.settings import EVERY_OTHER, Place, Setting
from cqos_core.model.spelling import nearest
from cqos_core.packs import normalise
from cqos_ros2_workspace.launch.values import LONGEST_TEXT, Either, Joined, Unknown, first_unknown
from cqos_ros2_workspace.nodes import form
from cqos_ros2_workspace.nodes.reading import endpoints
from cqos_ros2_workspace.nodes.version_fit import settled

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Mapping

    from cqos_core.importers.document_form import Entry
    from cqos_core.model.settings import Settings
    from cqos_core.model.system import ImportNote, Room
    from cqos_ros2_workspace.nodes.library import Library
    from cqos_ros2_workspace.nodes.reading import NodeFile, Written
    from cqos_ros2_workspace.nodes.version_fit import Fit

_MOST_PLUGINS: Final = 100
_MOST_COPIES: Final = 10_000
_MOST_PARTS: Final = 2_000
_DEEPEST: Final = 8
_HOLE: Final = "${"
MISSPELT: Final = "a misspelt class"
"""The subject of what is not known because no plugin has the class that a parameter names, and one of nearly that name is there."""
VERBS: Final = {
    "publishes": "publishes",
    "subscribes": "subscribes to",
    "serves": "serves",
    "calls": "calls",
    "action_servers": "serves the action",
    "action_clients": "calls the action",
}
"""What an endpoint does, by its direction."""


class Parameter(NamedTuple):
    """The value of a parameter and where it is given."""

    value: Any
    place: Place | None


@dataclass(frozen=True, slots=True)
class Filled:
    """One endpoint that a node has.

    Attributes:
        direction: as in the node file: ``publishes``, …
        name: as in the code, relative or not; with unknown parts where it is not known.
        type: empty where it is not known.
        preset: the preset that its policies begin with; empty: that of the pack.
        settings: policies over it.
        place: of the endpoint in the node file.
        named_at: where the parameter is given that names it; None where the code does.
        parameter: that parameter; empty where the code names it.
        overridable: policies that `qos_overrides` may set.
        overridable_unknown: why it is not known which; empty where it is.
        decided_at: where the parameter is given that chooses the policies; None where none does.
        doubtful: another version of the package has it, and the sources in the workspace do not name it.
        dialect: of the settings.
        room: where its file has room for further settings.
    """

    direction: str
    name: str | Unknown | Joined
    type: str
    preset: str
    settings: Settings
    place: Place
    named_at: Place | None = None
    parameter: str = ""
    overridable: tuple[str, ...] = ()
    overridable_unknown: str = ""
    optional: bool = False
    own_node: bool = False
    decided_at: Place | None = None
    doubtful: bool = False
    dialect: str = "yaml"
    room: Room | None = None


class Inside(NamedTuple):
    """A further node in the process of another one."""

    node: str
    name: str
    namespace: str


@dataclass(slots=True)
class FilledNode:
    """What a node has.

    Attributes:
        gaps: what is not known of it.
        activates: names of the lifecycle nodes that it activates, with the parameter; None where it activates none.
        at_start: whether it activates them when it starts, and not only when a program asks.
        lifecycle: it is a lifecycle node.
        notes: what reading a configuration of it reports.
    """

    endpoints: list[Filled] = field(default_factory=list)
    inside: list[Inside] = field(default_factory=list)
    gaps: list[Unknown] = field(default_factory=list)
    activates: Parameter | None = None
    at_start: bool | Unknown = True
    lifecycle: bool = False
    notes: list[ImportNote] = field(default_factory=list)


@dataclass(frozen=True, slots=True)
class Filling:
    """Adds to ``result`` what a node or a fragment has, for one distribution.

    Attributes:
        parameters: gives those that are set, by name.
        variables: texts by name: ``node``, ``namespace``, ``above`` (the namespace around it), and those of `for_each` and of plugins.
        distro: the ROS 2 distribution; empty: of every distribution alike.
        file: the node file in which the part stands.
        declared: the parameters that the part declares, with their defaults.
        own_node: the endpoints are of a further node that the node creates.
        depth: how many fragments use each other around the part.
        numbers: number the parts of the whole node.
    """

    library: Library
    parameters: Callable[[str], Parameter | None]
    variables: Mapping[str, str]
    distro: str
    result: FilledNode
    file: NodeFile
    declared: Mapping[str, list[Entry]] = field(default_factory=dict)
    own_node: bool = False
    depth: int = 0
    numbers: Iterator[int] = field(default_factory=count)
    _known: dict[str, Parameter] = field(default_factory=dict, init=False)

    def fill(self, part: Entry) -> None:
        """Add what a part of the file has."""
        if self.depth > _DEEPEST or next(self.numbers) > _MOST_PARTS:
            circle = "fragments use each other in a circle"
            cause = circle if self.depth > _DEEPEST else f"it is made of more than {_MOST_PARTS:,} fragments"
            self.result.gaps.append(Unknown(cause, part.place))
            return
        fit = self.library.fit(self.file, self.distro)
        filling = replace(self, distro=self.distro if fit is None else fit.distro, declared=_declared(part))
        if fit is None or fit.same:
            filling.own(part)
        else:
            filling = filling.beside(part, fit)
        for each in filling.held(part.get(form.INSIDE)):
            texts = [filling.text(each.get(key) or "", each.place) for key in (form.NODE, form.NAME, form.NAMESPACE)]
            self.result.inside.append(Inside(*[text if isinstance(text, str) else "" for text in texts]))
        for each in filling.held(part.get(form.PLUGINS)):
            for plugin, name, named_at in filling.plugins(each):
                self.having({"plugin": plugin}).fragment(name, named_at)
        self.result.lifecycle |= part.get(form.LIFECYCLE) is True
        stated = part.get(form.ACTIVATES)
        if stated:
            self.result.activates = filling.parameter_of(stated.require(form.ACTIVATED))
            self.result.at_start = filling.holds(stated.get(form.WHEN) or ())

    def fragment(self, name: str, place: Place) -> None:
        """Add what a fragment has, by its name."""
        found = self.library.fragment(name)
        if found is None:
            meant = nearest(name, self.library.classes(name.partition("::")[0]))
            cause = (
                f"`{name[:120]}`, did you mean `{meant}`?" if meant else f"no node file has the class `{name[:120]}`"
            )
            self.result.gaps.append(Unknown(cause, place, MISSPELT if meant else ""))
            return
        file, part = found
        known = self.library.fit(file, self.distro) or not file.versions or not self.distro
        if not known and self.distro not in file.versions:
            self.result.gaps.append(Unknown(f"`{name[:120]}` is not known for {self.distro}", place))
            return
        replace(self, file=file, depth=self.depth + 1).fill(part)

    def having(self, variables: Mapping[str, str]) -> Filling:
        """Return the same with further variables."""
        return replace(self, variables={**self.variables, **variables})

    # Values

    def parameter(self, name: str) -> Parameter:
        """Return the value of a parameter: the one that is given, else its default."""
        given = self.parameters(name)
        if given is not None:
            return given
        if name not in self._known:
            place = next((each.place for each in self.declared.get(name, ())), None)
            self._known[name] = Parameter(Unknown("values refer to each other in a circle", place), None)
            self._known[name] = self._default(name)
        return self._known[name]

    def _default(self, name: str) -> Parameter:
        for written, entries in self.declared.items():
            if written != name and (_HOLE not in written or self.text(written, None) != name):
                continue
            for entry in entries:
                holds = self.holds(entry.get(form.WHEN) or ())
                if isinstance(holds, Unknown):
                    return Parameter(holds, entry.place)
                default = entry.get(form.DEFAULT)
                if holds and default is not None:
                    value = default.value
                    return Parameter(self.text(value, entry.place) if isinstance(value, str) else value, None)
        return Parameter(Unknown(f"the parameter `{name[:80]}` is not set and has no default"), None)

    def parameter_of(self, text: str) -> Parameter:
        """Return the value of a text that is one hole, as it is: a list stays a list."""
        if text.startswith(_HOLE) and text.endswith("}") and text.count(_HOLE) == 1:
            name = text[2:-1]
            if name not in self.variables:
                return self.parameter(name)
        return Parameter(self.text(text, None), None)

    def text(self, written: str, place: Place | None) -> str | Unknown:
        """Return a text with its holes filled."""
        if _HOLE not in written:
            return written
        found, _ = self._filled(written, 0, place, inner=False)
        return found

    def _filled(self, written: str, at: int, place: Place | None, *, inner: bool) -> tuple[str | Unknown, int]:
        text, unknown = "", None
        while at < len(written):
            if inner and written[at] == "}":
                return unknown or text, at + 1
            if written.startswith(_HOLE, at):
                name, at = self._filled(written, at + 2, place, inner=True)
                value = name if isinstance(name, Unknown) else self._value(name)
                if isinstance(value, str) and len(text) + len(value) > LONGEST_TEXT:
                    value = Unknown(f"a text of more than {LONGEST_TEXT:,} characters", place)
                unknown = unknown or (value if isinstance(value, Unknown) else None)
                text += value if isinstance(value, str) else ""
            else:
                text += written[at]
                at += 1
        return unknown or text, at

    def _value(self, name: str) -> str | Unknown:
        if name in self.variables:
            return self.variables[name]
        return as_text(self.parameter(name).value)

    def holds(self, tests: tuple[form.Test, ...]) -> bool | Unknown:
        """Return whether a condition holds."""
        unknown = None
        for test in tests:
            if test.subject == form.DISTRO:
                held: bool | Unknown = self.distro in map(normalise, test.values)
                if not self.distro:
                    held = Unknown("the ROS 2 distribution is not stated", test.place)
            else:
                name = self.text(test.subject, test.place)
                value = name if isinstance(name, Unknown) else as_text(self.parameter(name).value)
                held = value if isinstance(value, Unknown) else value in test.values
            if isinstance(held, Unknown):
                unknown = unknown or held
            elif held is test.negated:
                return False
        return unknown or True

    def held(self, entries: list[Entry] | None) -> Iterator[Entry]:
        """Yield the entries whose conditions hold; note those that are not known."""
        for entry in entries or ():
            held = self.holds(entry.get(form.WHEN) or ())
            if isinstance(held, Unknown):
                self.result.gaps.append(held)
            elif held:
                yield entry

    def plugins(self, entry: Entry) -> Iterator[tuple[str, str, Place]]:
        """Yield the plugins of a slot, each with its class and the place that names it."""
        names = self.parameter_of(entry.require(form.NAMES)).value
        unknown = first_unknown(names)
        if unknown is not None:
            self.result.gaps.append(unknown)
            return
        classes = {name: each.value for name, each in (entry.get(form.CLASSES) or {}).items()}
        listed = _listed(names)
        if len(listed) > _MOST_PLUGINS:
            self.result.gaps.append(Unknown(f"it loads more than {_MOST_PLUGINS} plugins", entry.place))
        for plugin in listed[:_MOST_PLUGINS]:
            where = self.having({"plugin": plugin}).text(entry.require(form.CLASS), None)
            given = self.parameters(where) if isinstance(where, str) else None
            name = classes.get(plugin) if given is None else as_text(given.value)
            if not isinstance(name, str):
                cause = name.cause if isinstance(name, Unknown) else f"no parameter `{where}` names its class"
                self.result.gaps.append(
                    Unknown(f"the plugin `{plugin[:80]}`: {cause}", given.place if given else entry.place)
                )
                continue
            yield plugin, name.replace("/", "::"), (given.place if given else None) or entry.place

    # Endpoints

    def own(self, part: Entry) -> None:
        """Add the endpoints that a part states itself or uses, and what is not known of them."""
        for written in endpoints(part):
            self.endpoint(written)
        for each in self.held(part.get(form.UNREAD)):
            self.result.gaps.append(Unknown(f"{each.require(form.WHAT)}: {each.require(form.CAUSE)}", each.place))
        for each in self.held(part.get(form.USES)):
            used = self.text(each.require(form.FRAGMENT), each.place)
            if isinstance(used, Unknown):
                self.result.gaps.append(used)
            else:
                hidden = self.own_node or each.get(form.OWN_NODE) is True
                replace(self, own_node=hidden).fragment(used.replace("/", "::"), each.place)

    def beside(self, part: Entry, fit: Fit) -> Filling:
        """Add the endpoints of a part of another version than the one in the workspace; return the filling with the defaults of that one."""
        found = self.library.read(self.file, part)
        known, read = FilledNode(), FilledNode()
        filling = self
        if found is not None:
            file, theirs = found
            filling = replace(self, declared={**self.declared, **_declared(theirs)})
            replace(filling, file=file, result=read).own(theirs)
        replace(filling, result=known).own(part)
        gaps = read.gaps or ([] if found else known.gaps)
        sources = None if found is None else read.endpoints
        made, gaps = settled(known.endpoints, sources, gaps, fit, self.file.package)
        self.result.endpoints += made
        self.result.gaps += gaps
        return filling

    def endpoint(self, written: Written) -> None:
        """Add an endpoint, or one for each value of its variables."""
        for variables in self._variables(written):
            filling = self.having(variables)
            held = filling.holds(written.entry.get(form.WHEN) or ())
            if isinstance(held, Unknown):
                name = filling.text(written.name, written.place)
                shown = name if isinstance(name, str) else written.name
                self.result.gaps.append(
                    Unknown(f"whether it {VERBS[written.direction]} `{shown[:80]}`: {held.cause}", held.place)
                )
            elif held and (perhaps := written.entry.get(form.PERHAPS)):
                made = filling.made(written)
                known = made.name if isinstance(made.name, str) else written.name
                cause = f"whether it {VERBS[written.direction]} `{known[:80]}`: {perhaps}"
                self.result.gaps.append(Unknown(cause, made.place))
            elif held:
                self.result.endpoints.append(filling.made(written))

    def _variables(self, written: Written) -> Iterator[dict[str, str]]:
        found: list[dict[str, str]] = [{}]
        for variable, member in (written.entry.get(form.FOR_EACH) or {}).items():
            values: list[str] = []
            for setting in member.value:
                value = self.parameter_of(setting.text).value
                unknown = first_unknown(value)
                if unknown is not None:
                    self.result.gaps.append(unknown)
                    return
                values += _listed(value) if setting.text.startswith(_HOLE) else [str(value)]
            if len(found) * len(values) > _MOST_COPIES:
                cause = f"its variables have more than {_MOST_COPIES:,} combinations of values"
                self.result.gaps.append(Unknown(cause, written.place))
                return
            found = [{**each, variable: value} for each in found for value in values]
        yield from found

    def made(self, written: Written) -> Filled:
        """Return an endpoint that is there."""
        entry = written.entry
        name: str | Unknown = self.text(written.name, written.place)
        cause = entry.get(form.UNKNOWN)
        if cause is not None:
            name = Unknown(cause, written.place)
        elif isinstance(name, str) and not name.strip("/ "):
            name = Unknown("its name is empty", written.place)
        parameter, given = self._named_by(written.name)
        type_name = self.text(entry.get(form.TYPE) or "", written.place)
        preset, settings, decided = self.qos(entry.get(form.QOS) or [])
        place = entry.place if entry.place.line else written.place
        if self.file.sources:
            place = source_place(self.file, entry) or place
            settings = {policy: replace(each, place=place) for policy, each in settings.items()}
        overridable, optional = entry.get(form.OVERRIDABLE), entry.get(form.OPTIONAL)
        return Filled(
            written.direction,
            name,
            type_name if isinstance(type_name, str) else "",
            preset,
            settings,
            place,
            given,
            parameter,
            tuple(overridable or ()),
            entry.get(form.OVERRIDABLE_UNKNOWN) or "",
            optional is True,
            self.own_node,
            decided,
        )

    def _named_by(self, written: str) -> tuple[str, Place | None]:
        """Return the first parameter in a name, and where it is given."""
        at = written.find(_HOLE)
        while at >= 0:
            name, end = self._filled(written, at + 2, None, inner=True)
            if isinstance(name, str) and name not in self.variables:
                given = self.parameters(name)
                return name, None if given is None else given.place
            at = written.find(_HOLE, end)
        return "", None

    # Quality of service

    def qos(self, alternatives: list[Entry]) -> tuple[str, Settings, Place | None]:
        """Return preset and policies of the first alternative that holds, and the place of the parameter that decides for it."""
        decided: Place | None = None
        for entry in alternatives:
            tests = entry.get(form.WHEN) or ()
            held = self.holds(tests)
            decided = decided or self._decided(tests)
            if isinstance(held, Unknown):
                return "", {EVERY_OTHER: Setting("", held.place or entry.place, held.cause)}, decided
            if not held:
                continue
            cause = entry.get(form.UNKNOWN)
            if cause is not None:
                return "", {EVERY_OTHER: Setting("", entry.place, cause)}, decided
            preset, settings = self._profile(entry)
            for policy, setting in entry.settings.items():
                text = self.text(setting.text, setting.place)
                cause = text.cause if isinstance(text, Unknown) else ""
                known = text if isinstance(text, str) else ""
                settings[policy] = Setting(known, setting.place, cause, derived=not cause)
            for policy, member in (entry.get(form.UNREAD_POLICIES) or {}).items():
                settings[policy] = Setting("", entry.place, member.value)
            if decided is not None:
                settings = {policy: replace(each, place=decided) for policy, each in settings.items()}
            return preset, settings, decided
        return "", {}, decided

    def _decided(self, tests: tuple[form.Test, ...]) -> Place | None:
        """Return the place of the first given parameter in a condition."""
        for test in tests:
            name = self.text(test.subject, None)
            given = self.parameters(name) if isinstance(name, str) and test.subject != form.DISTRO else None
            if given is not None and given.place is not None:
                return given.place
        return None

    def _profile(self, entry: Entry) -> tuple[str, Settings]:
        name = entry.get(form.PROFILE) or ""
        own = self.file.profiles.get(name)
        if own is None:
            return name, {}
        base = own.get(form.PROFILE) or ""
        preset, settings = self._profile(own) if base in self.file.profiles and base != name else (base, {})
        return preset, {**settings, **{policy: replace(each, derived=True) for policy, each in own.settings.items()}}


def _declared(part: Entry) -> dict[str, list[Entry]]:
    return {name: member.value for name, member in (part.get(form.PARAMETERS) or {}).items()}


def source_place(file: NodeFile, entry: Entry) -> Place | None:
    """Return the line of the source that an entry of a learned node file names; None where it names none."""
    path, _, line = (entry.get(form.AT) or "").rpartition(":")
    return Place(f"{file.sources}/{path}", int(line)) if path and line.isdigit() else None


def as_text(value: Any) -> str | Unknown:
    """Return the value of a parameter as a node file writes it."""
    if isinstance(value, Unknown):
        return value
    if isinstance(value, (Joined, Either)):
        return first_unknown(value) or Unknown("it depends on what the launch leaves open")
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, (list, tuple)):
        return ", ".join(map(str, value))
    return str(value) if isinstance(value, (str, int, float)) else Unknown("it has no value")


def _listed(value: Any) -> list[str]:
    """Return the names in a list, or the words of a text."""
    if isinstance(value, (list, tuple)):
        return [str(each) for each in value]
    return str(value).split() if isinstance(value, (str, int, float)) else []
