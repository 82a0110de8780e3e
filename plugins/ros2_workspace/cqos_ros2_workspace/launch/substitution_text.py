"""The text form of substitutions in XML and YAML launch files: ``$(find-pkg-share nav2_bringup)/params/$(var file)``."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final

from cqos_ros2_workspace.launch.entities import Sub
from cqos_ros2_workspace.launch.values import Unknown

if TYPE_CHECKING:
    from cqos_core.model.settings import Place

_KINDS: Final[dict[str, tuple[str, tuple[str, ...]]]] = {
    "all": ("AllSubstitution", ("*",)),
    "and": ("AndSubstitution", ("left", "right")),
    "anon": ("AnonName", ("name",)),
    "any": ("AnySubstitution", ("*",)),
    "command": ("Command", ("command",)),
    "dirname": ("ThisLaunchFileDir", ()),
    "env": ("EnvironmentVariable", ("name", "default_value")),
    "equals": ("EqualsSubstitution", ("left", "right")),
    "exec-in-pkg": ("ExecutableInPackage", ("executable", "package")),
    "exec-in-package": ("ExecutableInPackage", ("executable", "package")),
    "file-content": ("FileContent", ("path",)),
    "filename": ("ThisLaunchFile", ()),
    "find-exec": ("FindExecutable", ("name",)),
    "find-pkg": ("FindPackageShare", ("package",)),
    "find-pkg-prefix": ("FindPackagePrefix", ("package",)),
    "find-pkg-share": ("FindPackageShare", ("package",)),
    "if": ("IfElseSubstitution", ("condition", "if_value", "else_value")),
    "not": ("NotSubstitution", ("value",)),
    "not-equals": ("NotEqualsSubstitution", ("left", "right")),
    "optenv": ("EnvironmentVariable", ("name", "default_value")),
    "or": ("OrSubstitution", ("left", "right")),
    "var": ("LaunchConfiguration", ("name", "default")),
}
_DEEPEST: Final = 20


class _Reader:
    """Reads one text from left to right."""

    def __init__(self, text: str, place: Place) -> None:
        self.text, self.place, self.at = text, place, 0

    def template(self, stops: str = "", depth: int = 0) -> list[Any]:
        """Return the parts up to one of the characters ``stops``, or to the end."""
        parts: list[Any] = []
        plain: list[str] = []
        while self.at < len(self.text) and self.text[self.at] not in stops:
            character = self.text[self.at]
            if self.text.startswith("$(", self.at):
                parts += ["".join(plain), self.substitution(depth + 1)]
                plain = []
                continue
            if character == "\\" and self.at + 1 < len(self.text):
                self.at += 1
                character = self.text[self.at]
            plain.append(character)
            self.at += 1
        return [part for part in [*parts, "".join(plain)] if part != ""]

    def substitution(self, depth: int) -> Sub | Unknown:
        """Return the substitution that begins here."""
        start = self.at
        self.at += 2
        name = self.word()
        arguments: list[list[Any]] = []
        while self.at < len(self.text) and self.text[self.at] != ")":
            if self.text[self.at].isspace():
                self.at += 1
            else:
                arguments.append(self.argument(depth))
        if self.at >= len(self.text) or depth > _DEEPEST:
            self.at = len(self.text)
            return Unknown(f"the substitution `{self.text[start : start + 60]}` is not closed", self.place)
        self.at += 1
        return self.made(name, arguments)

    def word(self) -> str:
        """Return the name of a substitution."""
        start = self.at
        while self.at < len(self.text) and (self.text[self.at].isalnum() or self.text[self.at] in "-_"):
            self.at += 1
        return self.text[start : self.at]

    def argument(self, depth: int) -> list[Any]:
        """Return one argument: quoted, or up to a blank."""
        quote = self.text[self.at]
        if quote not in "\"'":
            return self.template(" \t\r\n)", depth)
        self.at += 1
        parts = self.template(quote, depth)
        self.at += 1
        return parts

    def made(self, name: str, arguments: list[list[Any]]) -> Sub | Unknown:
        """Return the substitution of a name."""
        if name == "eval":
            words = [part for number, each in enumerate(arguments) for part in ([" "] if number else []) + each]
            return Sub("PythonExpression", {"expression": words}, self.place)
        if name not in _KINDS:
            return Unknown(f"there is no substitution `$({name[:40]} …)` that C-QoS knows", self.place)
        kind, names = _KINDS[name]
        if names == ("*",):
            return Sub(kind, {"*": arguments}, self.place)
        fields: dict[str, Any] = dict(zip(names, arguments, strict=False))
        if name == "optenv":
            fields.setdefault("default_value", "")
        return Sub(kind, fields, self.place)


def parse_text(text: str, place: Place) -> list[Any]:
    """Return the parts of a text: texts, substitutions, and an unknown part for what is no substitution."""
    return _Reader(text, place).template() if "$(" in text or "\\" in text else [text]
