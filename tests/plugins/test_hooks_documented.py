"""The page about plugins explains every hook, every argument, and everything that plugins are given."""

import re
from collections.abc import Callable
from dataclasses import fields
from inspect import signature
from pathlib import Path
from typing import Any

import pytest

from cqos_core.files.export import ExportContext, Writer
from cqos_core.model.source import Claim, ReadContext, Reader, Source
from cqos_core.model.style import Style
from cqos_core.plugins import KINDS, LOAD_VARIABLE, Hooks

PAGE = (Path(__file__).resolve().parents[2] / "docs" / "plugins.md").read_text(encoding="utf-8")
HOOKS: dict[str, Callable[..., Any]] = {name: hook for name, hook in vars(Hooks).items() if not name.startswith("_")}
SECTIONS = dict(re.findall(r"^### (\w+)\n(.*?)(?=^##)", PAGE, re.MULTILINE | re.DOTALL))
GIVEN: dict[str, dict[str, type[Any]]] = {
    "register_importers": {"source": Source, "context": ReadContext},
    "register_exporters": {"context": ExportContext},
    "register_formatters": {"style": Style},
}
CALLED: dict[str, dict[str, Callable[..., Any]]] = {
    "register_importers": {"claims": Claim.__call__, "reader": Reader.__call__},
    "register_exporters": {"writer": Writer.__call__},
}


def rows(section):
    """What tables of a section explain."""
    return re.findall(r"^\| `([\w.]+)` +\| \S", section, re.MULTILINE)


def test_every_hook_has_a_section_and_no_other():
    assert list(SECTIONS) == list(HOOKS) == [kind.hook for kind in KINDS.values()]
    for name in HOOKS:
        assert f"| [`{name}`](#{name})" in PAGE


@pytest.mark.parametrize("name", HOOKS)
def test_every_argument_of_a_hook_is_explained(name):
    arguments = [argument for argument in signature(HOOKS[name]).parameters if argument != "self"]
    assert arguments == ["register"], "explain it in the introduction to the hooks, and here"
    introduction = PAGE.partition("\n## The hooks\n")[2].partition("\n### ")[0]
    assert "Each takes one argument, the function `register`." in introduction


@pytest.mark.parametrize("kind", KINDS.values(), ids=lambda kind: kind.name)
def test_every_field_of_a_descriptor_is_explained(kind):
    section = SECTIONS[kind.hook]
    assert f"`register` takes a `{kind.descriptor.__name__}`" in section.replace(" an `", " a `")
    given = [f"{name}.{each.name}" for name, type_ in GIVEN.get(kind.hook, {}).items() for each in fields(type_)]
    assert rows(section) == [each.name for each in fields(kind.descriptor)] + given


@pytest.mark.parametrize("hook", CALLED)
def test_functions_are_explained_with_their_arguments(hook):
    for name, protocol in CALLED[hook].items():
        arguments = ", ".join(list(signature(protocol).parameters)[1:])
        assert f"**`{name}({arguments})`**" in SECTIONS[hook]


def test_the_variable_is_explained():
    assert f"`{LOAD_VARIABLE}`" in PAGE
