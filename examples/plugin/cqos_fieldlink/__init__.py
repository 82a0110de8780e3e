"""Fieldlink for C-QoS. This module has only the hooks; C-QoS imports the objects that they name on first use."""

from __future__ import annotations

from typing import TYPE_CHECKING

from cqos_core.plugins import CommandInfo, FormatterInfo, ImporterInfo, RulePackInfo, hookimpl

if TYPE_CHECKING:
    from collections.abc import Callable


@hookimpl
def register_rule_packs(register: Callable[[RulePackInfo], None]) -> None:
    """The protocol. Link lists are always Fieldlink, so they need not state it."""
    register(
        RulePackInfo(
            id="fieldlink",
            summary="Fieldlink telegrams between devices",
            pack="cqos_fieldlink.pack:PACK",
            default_for=("links",),
        )
    )


@hookimpl
def register_importers(register: Callable[[ImporterInfo], None]) -> None:
    """The lists that the planning department exports."""
    register(
        ImporterInfo(
            name="links",
            summary="Fieldlink link lists",
            suffixes=(".csv",),
            claims="cqos_fieldlink.detect:claims",
            reader="cqos_fieldlink.reader:read",
        )
    )


@hookimpl
def register_formatters(register: Callable[[FormatterInfo], None]) -> None:
    """A table for merge requests; it works with every protocol."""
    register(
        FormatterInfo(
            name="markdown",
            summary="a table for merge requests",
            renderer="cqos_fieldlink.markdown:render",
        )
    )


@hookimpl
def register_commands(register: Callable[[CommandInfo], None]) -> None:
    """``cqos graph``; it works with every protocol too."""
    register(
        CommandInfo(
            name="graph",
            summary="Draw who talks to whom, for Graphviz.",
            command="cqos_fieldlink.graph:graph",
        )
    )
