"""Evaluates a launch from its entry point, with arguments passed down through includes. Nothing is executed or imported."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final

from cqos_core.model.settings import Place
from cqos_ros2_workspace.launch.entities import Action
from cqos_ros2_workspace.launch.instances import NODES, start
from cqos_ros2_workspace.launch.launch_result import Argument, Launched, ParameterFile, ParameterValues, Remark
from cqos_ros2_workspace.launch.markup import read_xml, read_yaml
from cqos_ros2_workspace.launch.python_names import ContextValue, Function, TooMuchError, Walk
from cqos_ros2_workspace.launch.python_statements import call_function, parsed, run_module
from cqos_ros2_workspace.launch.scope import Scope, place_of
from cqos_ros2_workspace.launch.substitutions import condition, perform
from cqos_ros2_workspace.launch.values import (
    Either,
    Unknown,
    When,
    both,
    cases,
    first_unknown,
    lift,
    only_where,
    replaced,
    shown,
    under,
)

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

    from cqos_ros2_workspace.launch.workspace import Workspace

DEEPEST_INCLUDE: Final = 25
MOST_INCLUDES: Final = 2_000
MOST_ACTIONS: Final = 50_000
_ENTRY: Final = "generate_launch_description"


class Launch:
    """One launch that is read; see `launch`.

    Attributes:
        scope: what holds where the action runs that is read.
        file, via: the launch file that is read, and the places of the includes that lead to it.
        after: the event that actions wait for; empty: none.
        chain: the launch files that include each other, the one that is read last.
        walk: the walk of Python, whose limits hold for the whole launch.
    """

    def __init__(self, workspace: Workspace, given: Mapping[str, str], variables: Mapping[str, str]) -> None:
        self.workspace = workspace
        self.given = dict(given)
        self.variables = dict(variables)
        self.scope = Scope(configurations=dict(given))
        self.found = Launched("", workspace.root)
        self.file: str = ""
        self.via: tuple[Place, ...] = ()
        self.after = ""
        self.chain: list[str] = []
        self.walk = Walk(self, call_function)
        self._actions = 0
        self._includes = 0

    # What Python, substitutions and nodes ask for

    def perform(self, value: Any) -> Any:
        """Return the text of a substitution here and now."""
        return under(perform(value, self), self.scope.guards)

    def environment(self, name: str, default: Any, place: Place) -> Any:
        """Return a variable of the environment: what the launch sets, what the caller gives, else the default."""
        found = self.scope.environment.get(name)
        if found is not None:
            return under(found, self.scope.guards)
        if name in self.variables:
            return self.variables[name]
        if default is not None:
            self.found.assumed.setdefault(name, shown(default))
            return default
        return Unknown(f"the environment variable `{name}` is not given", place, f"environment {name}")

    def read(self, path: Any, place: Place) -> bytes | Unknown:
        """Return the content of a file of the workspace."""
        if not isinstance(path, str):
            return first_unknown(path) or Unknown("no path", place)
        real = self.workspace.find(path, place)
        if isinstance(real, Unknown):
            return real
        data = self.workspace.read(real, place)
        if isinstance(data, bytes):
            self.found.files.setdefault(real, data)
        return data

    def decide(self, action: Any) -> Any:
        """Return whether a condition holds, as a truth value that may have alternatives."""
        if action is None:
            return True
        if isinstance(action, (Either, Unknown)):
            return (
                lift(lambda each: self.decide(each) if isinstance(each, (Action, Unknown)) else True, action)
                if isinstance(action, Either)
                else condition(action, action.place)
            )
        if not isinstance(action, Action) or action.kind not in _CONDITIONS:
            return condition(Unknown("a condition of another kind", getattr(action, "place", None)), None)
        text = _CONDITIONS[action.kind](self, action)
        held = condition(text, action.place)

        def judged(each: Any) -> Any:
            if each is None:
                self.remark(
                    "condition", shown(text), f"it is `{shown(text)[:60]}`, neither true nor false", action.place
                )
                return condition(Unknown(f"condition at {action.place}"), action.place)
            return each

        held = lift(judged, held)
        negative = action.kind in {"UnlessCondition", "LaunchConfigurationNotEquals"}
        return under(lift(lambda each: not each, held) if negative else held, self.scope.guards)

    def remark(self, about: str, what: str, cause: str, place: Place | None, package: str = "") -> None:
        """Note something that is not known of the launch; ``package``: one that the workspace does not have."""
        remark = Remark(about, what, cause, place, self.scope.guards, package)
        if remark not in self.found.remarks[-50:]:
            self.found.remarks.append(remark)

    # Files

    def include(self, path: Any, place: Place | None) -> None:
        """Run the launch file at a path, of each alternative under its guards."""
        for guards, each in cases(path):
            self.within(guards, self._include, each, place)

    def _include(self, path: Any, place: Place | None) -> None:
        if not isinstance(path, str):
            unknown = first_unknown(path) or Unknown("its path is not known", place)
            self.remark("include", shown(path), unknown.cause, unknown.place or place)
            return
        real = self.workspace.find(path, place)
        if isinstance(real, Unknown):
            self.remark("include", path, real.cause, place, self.workspace.missing(path))
            return
        self._includes += 1
        if real in self.chain:
            self.remark("include", self.workspace.short(real), "it includes itself, which is not followed", place)
        elif len(self.chain) >= DEEPEST_INCLUDE or self._includes > MOST_INCLUDES:
            limit = f"limit {DEEPEST_INCLUDE} deep and {MOST_INCLUDES} in all"
            self.remark("include", self.workspace.short(real), f"there are too many includes: {limit}", place)
        else:
            before = self.file, self.via
            self.chain.append(real)
            self.file = real
            self.via = (*self.via, place) if place is not None else self.via
            self.run_file(real)
            self.chain.pop()
            self.file, self.via = before

    def run_file(self, path: str) -> None:
        """Run a launch file of any of the three languages."""
        data = self.workspace.read(path, None)
        if isinstance(data, Unknown):
            self.remark("file", self.workspace.short(path), data.cause, data.place)
            return
        self.found.files[path] = data
        start = data.lstrip(b"\xef\xbb\xbf \t\r\n")[:1]
        if path.endswith(".py"):
            self.run(self._python(path, data))
        elif start == b"<" or path.endswith(".xml"):
            self.run(read_xml(path, data))
        else:
            self.run(read_yaml(path, data))

    def _python(self, path: str, data: bytes) -> Any:
        """Return what a Python launch file describes."""
        tree = parsed(path, data)
        if isinstance(tree, Unknown):
            return tree
        guards = self.walk.guards
        self.walk.guards = list(self.scope.guards)
        try:
            frame = run_module(path, tree, self.walk)
            entry = frame.names.get(_ENTRY)
            if not isinstance(entry, Function):
                return Unknown(f"it has no function `{_ENTRY}`", Place(path, 1, 1))
            return call_function(self.walk, entry, (), {})
        except RecursionError:
            return Unknown("it is nested too deep to be followed", Place(path, 1, 1))
        finally:
            self.walk.guards = guards

    # Actions

    def run(self, entities: Any) -> None:
        """Run actions in order; of alternatives each under its guards."""
        self._actions += 1
        if self._actions > MOST_ACTIONS:
            raise TooMuchError
        if isinstance(entities, (list, tuple)):
            for each in entities:
                self.run(each)
        elif isinstance(entities, When):
            self.within(entities.guards, self.run, entities.value)
        elif isinstance(entities, Either):
            for guards, each in entities.cases:
                self.within(guards, self.run, each)
        elif isinstance(entities, Unknown):
            what = self.workspace.short(entities.place.source) if entities.place else ""
            self.remark("action", what, entities.cause, entities.place)
        elif isinstance(entities, Action):
            for guards, held in cases(self.decide(entities.fields.get("condition"))):
                if held:
                    self.within(guards, self._act, entities)

    def within(self, guards: Any, do: Callable[..., None], *arguments: Any) -> None:
        """Do something under further guards; nothing where they exclude those that hold here."""
        held = both(self.scope.guards, guards)
        if held is None:
            return
        before, self.scope.guards = self.scope.guards, held
        do(*arguments)
        self.scope.guards = before

    def _act(self, action: Action) -> None:
        kind = action.kind
        if kind in NODES:
            start(action, self)
        elif kind in _ACTIONS:
            _ACTIONS[kind](self, action)
        elif kind not in _WITHOUT_EFFECT:
            self.remark("action", kind, f"`{kind}` is not an action that C-QoS follows", action.place)

    def later(self, entities: Any, event: str) -> None:
        """Run actions that wait for an event; what they set does not reach others."""
        before, outer = self.scope, self.after
        self.scope, self.after = before.copy(), event
        self.run(entities)
        self.scope, self.after = before, outer


def _declare(run: Launch, action: Action) -> None:
    name = run.perform(action.fields.get("name"))
    if not isinstance(name, str):
        run.remark("argument", shown(name), "its name is not known", action.place)
        return
    place, given = place_of(action.place), run.scope.configurations.get(name)
    default = action.fields.get("default_value")
    source = "given" if name in run.given else "includer"
    if given is None and default is not None:
        given, source = run.perform(default), "default"
        run.scope.configure(name, given)
    elif given is None:
        source = "none"
        given = Unknown(f"the launch argument `{name}` has no value: it is not given and has no default", place, name)
        run.scope.configure(name, given)
    run.found.arguments.setdefault(name, Argument(name, given, source, place))  # type: ignore[arg-type] # one of four words


def _set(run: Launch, action: Action) -> None:
    name = run.perform(action.fields.get("name"))
    if isinstance(name, str):
        value = action.fields.get("value")
        run.scope.configure(name, None if action.kind.startswith("Unset") else run.perform(value))
    else:
        run.remark("action", action.kind, "the name that it sets is not known", action.place)


def _include(run: Launch, action: Action) -> None:
    source = action.fields.get("source", action.fields.get("launch_description_source"))
    given = action.fields.get("launch_arguments") or []
    pairs = list(given.items()) if isinstance(given, dict) else given
    if isinstance(pairs, (list, tuple)):
        for pair in pairs:
            guards, both_parts = (pair.guards, pair.value) if isinstance(pair, When) else ((), pair)
            if isinstance(both_parts, (list, tuple)) and len(both_parts) == 2:  # noqa: PLR2004 - name and value
                name = run.perform(both_parts[0])
                if isinstance(name, str):
                    value = run.perform(both_parts[1])
                    run.within(guards, run.scope.configure, name, value)
    else:
        unknown = first_unknown(pairs)
        run.remark("include", "launch_arguments", unknown.cause if unknown else "they are not followed", action.place)
    for guards, each in cases(source):
        run.within(guards, _source, run, each, action)


def _source(run: Launch, source: Any, action: Action) -> None:
    if isinstance(source, Action) and source.kind == "LaunchDescription":
        run.run(source.fields.get("entities"))
    elif isinstance(source, Action) and "launch_description" in source.fields:
        run.run(source.fields["launch_description"])
    else:
        location = source.fields.get("location") if isinstance(source, Action) else source
        run.include(run.perform(location), place_of(action.place))


def _group(run: Launch, action: Action) -> None:
    members = action.fields.get("actions")
    text = run.perform(action.fields.get("scoped", "true"))
    held = condition(text, action.place)
    before = run.scope
    if held is not False:
        run.scope = before.copy()
    stated = action.fields.get("launch_configurations")
    kept = {str(name): run.perform(value) for name, value in stated.items()} if isinstance(stated, dict) else {}
    if condition(run.perform(action.fields.get("forwarding", "true")), action.place) is False and held is not False:
        run.scope.configurations = {}
    for name, value in kept.items():
        run.scope.configure(name, value)
    run.run(members)
    if held is not False:
        run.scope = before


def _variable(run: Launch, action: Action) -> None:
    name = run.perform(action.fields.get("name"))
    if not isinstance(name, str):
        run.remark("action", action.kind, "the variable that it sets is not known", action.place)
        return
    value: Any = None if action.kind.startswith("Unset") else run.perform(action.fields.get("value"))
    if action.kind.startswith("Append"):
        earlier = run.scope.environment.get(name)
        value = Unknown(f"`{name}` is appended to", action.place) if earlier is None else earlier
    run.scope.environment[name] = replaced(run.scope.environment.get(name), value, run.scope.guards)
    if value is not None and not action.kind.startswith("Append"):
        run.found.variables[name] = replaced(run.found.variables.get(name), value, run.scope.guards)


def _opaque(run: Launch, action: Action) -> None:
    function = action.fields.get("function")
    if not isinstance(function, Function):
        unknown = first_unknown(function)
        run.remark("action", "OpaqueFunction", unknown.cause if unknown else "its function is not read", action.place)
        return
    arguments = [ContextValue(), *action.members("args")]
    named = action.fields.get("kwargs") or {}
    before, run.walk.guards = run.walk.guards, list(run.scope.guards)
    found = call_function(run.walk, function, arguments, named if isinstance(named, dict) else {})
    run.walk.guards = before
    run.run(found)


def _event(run: Launch, action: Action) -> None:
    handler = action.fields.get("event_handler")
    if not isinstance(handler, Action):
        run.remark("action", action.kind, "its event handler is not read", action.place)
        return
    for name, value in handler.fields.items():
        if name.startswith("on_") or name == "entities":
            found = (
                call_function(run.walk, value, (Unknown("an event"), Unknown("a context")), {})
                if isinstance(value, Function)
                else value
            )
            run.later(found, f"event {handler.kind}")


def _emit(run: Launch, action: Action) -> None:
    event = action.fields.get("event")
    run.found.emits = run.found.emits or not (isinstance(event, Action) and event.kind == "Shutdown")


def _parameter(run: Launch, action: Action) -> None:
    name = run.perform(action.fields.get("name"))
    place = place_of(action.place)
    if action.kind == "SetParametersFromFile":
        path = only_where(run.scope.guards, run.perform(action.fields.get("filename")))
        run.scope.parameters.append(ParameterFile(path, False, place))
        return
    if action.kind == "SetUseSimTime":
        name = "use_sim_time"
    from cqos_ros2_workspace.launch.instances import parameter_value

    value = only_where(run.scope.guards, parameter_value(action.fields.get("value"), run))
    run.scope.parameters.append(ParameterValues({name if isinstance(name, str) else "?": value}, place, rule=True))


def _push(run: Launch, _action: Action) -> None:
    run.scope.stack.append(run.scope.copy())


def _pop(run: Launch, action: Action) -> None:
    if not run.scope.stack:
        return
    earlier = run.scope.stack.pop()
    if action.kind == "PopEnvironment":
        run.scope.environment = earlier.environment
    else:
        run.scope.configurations, run.scope.namespace = earlier.configurations, earlier.namespace
        run.scope.remaps, run.scope.parameters = earlier.remaps, earlier.parameters


def _reset(run: Launch, action: Action) -> None:
    kept = action.fields.get("launch_configurations")
    run.scope.configurations = (
        {str(name): run.perform(value) for name, value in kept.items()} if isinstance(kept, dict) else {}
    )
    run.scope.namespace, run.scope.remaps, run.scope.parameters = "", [], []


def _remap(run: Launch, action: Action) -> None:
    source = only_where(run.scope.guards, run.perform(action.fields.get("src")))
    run.scope.remaps.append((source, run.perform(action.fields.get("dst"))))


def _configured(run: Launch, action: Action) -> Any:
    """Return the text of a condition that compares a launch configuration."""
    from cqos_ros2_workspace.launch.entities import Sub

    place = place_of(action.place)
    left = Sub("LaunchConfiguration", {"name": action.fields.get("name")}, place)
    return run.perform(Sub("EqualsSubstitution", {"left": left, "right": action.fields.get("value")}, place))


_CONDITIONS: Final[dict[str, Callable[[Launch, Action], Any]]] = {
    "IfCondition": lambda run, action: run.perform(action.fields.get("predicate")),
    "LaunchConfigurationEquals": _configured,
    "LaunchConfigurationNotEquals": _configured,
    "UnlessCondition": lambda run, action: run.perform(action.fields.get("predicate")),
}
_WITHOUT_EFFECT: Final = frozenset(
    (
        "LogInfo",
        "PopEnvironment",
        "SetROSLogDir",
        "Shutdown",
        "UnregisterEventHandler",
    )
)
_ACTIONS: Final[dict[str, Callable[[Launch, Action], None]]] = {
    "AppendEnvironmentVariable": _variable,
    "DeclareLaunchArgument": _declare,
    "EmitEvent": _emit,
    "GroupAction": _group,
    "IncludeLaunchDescription": _include,
    "LifecycleTransition": _emit,
    "LaunchDescription": lambda run, action: run.run(action.fields.get("entities")),
    "OpaqueFunction": _opaque,
    "PopEnvironment": _pop,
    "PopLaunchConfigurations": _pop,
    "PushEnvironment": _push,
    "PushLaunchConfigurations": _push,
    "PushROSNamespace": lambda run, action: run.scope.push_namespace(run.perform(action.fields.get("namespace"))),
    "PushRosNamespace": lambda run, action: run.scope.push_namespace(run.perform(action.fields.get("namespace"))),
    "ROSTimer": lambda run, action: run.later(action.fields.get("actions"), "a timer"),
    "RegisterEventHandler": _event,
    "ResetEnvironment": lambda run, _action: run.scope.environment.clear(),
    "ResetLaunchConfigurations": _reset,
    "RosTimer": lambda run, action: run.later(action.fields.get("actions"), "a timer"),
    "SetEnvironmentVariable": _variable,
    "SetLaunchConfiguration": _set,
    "SetParameter": _parameter,
    "SetParametersFromFile": _parameter,
    "SetRemap": _remap,
    "SetUseSimTime": _parameter,
    "TimerAction": lambda run, action: run.later(action.fields.get("actions"), "a timer"),
    "UnsetEnvironmentVariable": _variable,
    "UnsetLaunchConfiguration": _set,
}


def launch(
    workspace: Workspace, entry: str, given: Mapping[str, str], variables: Mapping[str, str] | None = None
) -> Launched:
    """Return what a launch file would start.

    Args:
        workspace: where includes and parameter files are looked up.
        entry: the launch file.
        given: launch arguments by name.
        variables: the environment, as far as the caller states it.
    """
    run = Launch(workspace, given, variables or {})
    run.found.entry = run.file = entry
    run.chain.append(entry)
    try:
        run.run_file(entry)
    except TooMuchError:
        run.remark(
            "limit", workspace.short(run.file), "the launch takes more steps than C-QoS follows", Place(run.file, 1)
        )
    except RecursionError:
        run.remark(
            "limit", workspace.short(run.file), "the launch is nested too deep to be followed", Place(run.file, 1)
        )
    return run.found
