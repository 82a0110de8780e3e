"""What launch files are made of, whatever language they are in: actions and substitutions as data, not yet evaluated."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, Final

if TYPE_CHECKING:
    from cqos_core.model.settings import Place

POSITIONAL: Final[dict[str, tuple[str, ...]]] = {
    # Actions of launch.
    "AppendEnvironmentVariable": ("name", "value"),
    "DeclareLaunchArgument": ("name",),
    "EmitEvent": (),
    "ExecuteLocal": (),
    "ExecuteProcess": (),
    "ForEach": ("input_values", "function"),
    "ForLoop": ("length", "function"),
    "GroupAction": ("actions",),
    "IncludeLaunchDescription": ("source",),
    "LaunchDescription": ("entities",),
    "LogInfo": (),
    "OpaqueFunction": (),
    "PopEnvironment": (),
    "PopLaunchConfigurations": (),
    "PushEnvironment": (),
    "PushLaunchConfigurations": (),
    "RegisterEventHandler": ("event_handler",),
    "ResetEnvironment": (),
    "ResetLaunchConfigurations": ("launch_configurations",),
    "SetEnvironmentVariable": ("name", "value"),
    "SetLaunchConfiguration": ("name", "value"),
    "Shutdown": (),
    "TimerAction": (),
    "UnregisterEventHandler": (),
    "UnsetEnvironmentVariable": ("name",),
    "UnsetLaunchConfiguration": ("name",),
    # Actions of launch_ros.
    "ComposableNodeContainer": (),
    "LifecycleNode": (),
    "LifecycleTransition": (),
    "LoadComposableNodes": (),
    "Node": (),
    "PushROSNamespace": ("namespace",),
    "PushRosNamespace": ("namespace",),
    "ROSTimer": (),
    "RosTimer": (),
    "SetParameter": ("name", "value"),
    "SetParametersFromFile": ("filename",),
    "SetROSLogDir": ("new_log_dir",),
    "SetRemap": ("src", "dst"),
    "SetUseSimTime": ("value",),
    # Descriptions and sources.
    "AnyLaunchDescriptionSource": ("location",),
    "ComposableLifecycleNode": (),
    "ComposableNode": (),
    "FrontendLaunchDescriptionSource": ("location",),
    "Parameter": ("name",),
    "ParameterFile": ("param_file",),
    "ParameterValue": ("value",),
    "PythonLaunchDescriptionSource": ("location",),
    "XMLLaunchDescriptionSource": ("location",),
    "YAMLLaunchDescriptionSource": ("location",),
    "LaunchDescriptionSource": ("launch_description",),
    # Conditions.
    "IfCondition": ("predicate",),
    "LaunchConfigurationEquals": ("name", "value"),
    "LaunchConfigurationNotEquals": ("name", "value"),
    "UnlessCondition": ("predicate",),
    # Event handlers.
    "OnExecutionComplete": (),
    "OnProcessExit": (),
    "OnProcessIO": (),
    "OnProcessStart": (),
    "OnShutdown": (),
    "OnStateTransition": (),
}
"""The classes whose objects are actions or parts of them, with the names of their positional parameters."""

SUBSTITUTIONS: Final[dict[str, tuple[str, ...]]] = {
    "AllSubstitution": ("*",),
    "AndSubstitution": ("left", "right"),
    "AnonName": ("name",),
    "AnySubstitution": ("*",),
    "Command": ("command",),
    "EnvironmentVariable": ("name", "default_value"),
    "EqualsSubstitution": ("left", "right"),
    "ExecutableInPackage": ("executable", "package"),
    "FileContent": ("path",),
    "FindExecutable": ("name",),
    "FindPackage": ("package",),
    "FindPackagePrefix": ("package",),
    "FindPackageShare": ("package",),
    "IfElseSubstitution": ("condition", "if_value", "else_value"),
    "LaunchConfigAsBool": ("name",),
    "LaunchConfiguration": ("name", "default"),
    "LaunchLogDir": (),
    "LocalSubstitution": ("expression",),
    "NotEqualsSubstitution": ("left", "right"),
    "NotSubstitution": ("value",),
    "OrSubstitution": ("left", "right"),
    "PathJoinSubstitution": ("substitutions",),
    "PathSubstitution": ("path",),
    "PythonExpression": ("expression", "python_modules"),
    "ReplaceString": ("source_file", "replacements", "condition"),
    "RewrittenYaml": ("source_file", "param_rewrites", "root_key", "key_rewrites", "convert_types", "value_rewrites"),
    "StringJoinSubstitution": ("substitutions", "delimiter"),
    "TextSubstitution": ("text",),
    "ThisLaunchFile": (),
    "ThisLaunchFileDir": (),
}
"""The classes whose objects become text when the launch file runs, with the names of their positional parameters."""


@dataclass(frozen=True, slots=True, eq=False)
class Sub:
    """A substitution, by the name of its class, with its arguments."""

    kind: str
    fields: dict[str, Any]
    place: Place


@dataclass(slots=True, eq=False)
class Action:
    """An action, description, source or condition, by the name of its class, with its arguments."""

    kind: str
    fields: dict[str, Any] = field(default_factory=dict)
    place: Place | None = None

    def members(self, name: str) -> list[Any]:
        """Return the members of a list, an empty one where it states none."""
        value = self.fields.get(name)
        return list(value) if isinstance(value, (list, tuple)) else [] if value is None else [value]
