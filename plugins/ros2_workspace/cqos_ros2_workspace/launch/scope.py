"""What holds where an action of a launch runs: launch configurations, environment, namespace, remaps, parameters."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any

from cqos_ros2_workspace.launch.values import join, lift, replaced, under

if TYPE_CHECKING:
    from cqos_core.model.settings import Place
    from cqos_ros2_workspace.launch.launch_result import Parameters
    from cqos_ros2_workspace.launch.values import Guards, Text


@dataclass(slots=True)
class Scope:
    """One scope; groups push a copy of it.

    Attributes:
        configurations: launch arguments and configurations, by name.
        namespace: absolute, empty where none is pushed.
        remaps, parameters: those that hold for all nodes that follow.
        guards: what has to hold for the actions here.
        stack: what ``PushLaunchConfigurations`` and ``PushEnvironment`` put aside.
    """

    configurations: dict[str, Any] = field(default_factory=dict)
    environment: dict[str, Any] = field(default_factory=dict)
    namespace: Text = ""
    remaps: list[tuple[Text, Text]] = field(default_factory=list)
    parameters: list[Parameters] = field(default_factory=list)
    guards: Guards = ()
    stack: list[Scope] = field(default_factory=list)

    def copy(self) -> Scope:
        """Return a scope whose changes leave this one as it is."""
        return replace(
            self,
            configurations=dict(self.configurations),
            environment=dict(self.environment),
            remaps=list(self.remaps),
            parameters=list(self.parameters),
            stack=[],
        )

    def configure(self, name: str, value: Any) -> None:
        """Set a launch configuration, under the guards that hold here."""
        self.configurations[name] = replaced(self.configurations.get(name), value, self.guards)

    def configuration(self, name: str) -> Any:
        """Return a launch configuration; None where it is not set."""
        return under(self.configurations.get(name), self.guards)

    def push_namespace(self, name: Text) -> None:
        """Push a namespace for all that follows."""
        self.namespace = replaced(self.namespace, absolute(inner_namespace(self.namespace, name)), self.guards)


def inner_namespace(base: Text, name: Text) -> Text:
    """Return a namespace below another; an absolute one replaces it."""

    def below(outer: Any, inner: Any) -> Any:
        if inner == "" or inner is None:
            return outer
        if isinstance(inner, str) and (inner.startswith("/") or outer == ""):
            return inner
        return join([outer, "" if outer in {"/", ""} else "/", inner])

    return lift(below, base, name)  # type: ignore[no-any-return]


def absolute(name: Text) -> Text:
    """Return a namespace with a slash at its start; an empty one stays empty."""

    def made(text: Any) -> Any:
        first = text if isinstance(text, str) else getattr(text, "parts", (text,))[0]
        if first == "" or (isinstance(first, str) and first.startswith("/")):
            return text
        return join(["/", text])

    return lift(made, name)  # type: ignore[no-any-return]


def place_of(*candidates: Place | None) -> Place:
    """Return the first place that is known."""
    from cqos_core.model.settings import Place

    return next((each for each in candidates if each is not None), Place("<launch>"))
