"""``cqos completion``: scripts by which shells complete commands, options, rules, packs, formats and files."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Iterator
from typing import Any, Final

import click
from click.shell_completion import CompletionItem, get_completion_class

from cqos_core.cli.console import emit
from cqos_core.cli.parameters import AssignmentType, Registered, debug_option
from cqos_core.model.codes import CODES
from cqos_core.plugins import load_plugins

VARIABLE: Final = "_CQOS_COMPLETE"
"""The variable by which a script asks for completions."""
_FILES: Final = frozenset({"DIR", "FILE", "LOG", "PACK", "PATH", "SOURCE"})

_Word = tuple[str, str]
"""A completion with its description."""


@click.command(
    epilog="bash: cqos completion bash > ~/.local/share/bash-completion/completions/cqos; zsh: cqos completion zsh > "
    '"${fpath[1]}/_cqos"; fish: cqos completion fish > ~/.config/fish/completions/cqos.fish. '
    "Exit codes: 0 printed; 2 wrong usage; 3 internal error."
)
@click.argument("shell", type=click.Choice(["bash", "zsh", "fish"]))
@debug_option
@click.pass_context
def completion(ctx: click.Context, *, shell: str) -> None:
    """Print a script by which a shell completes `cqos`.

    The shell then knows commands, options, codes and names of rules, packs and their options, formats and files.

    \b
    Examples:
      source <(cqos completion bash)
      cqos completion fish > ~/.config/fish/completions/cqos.fish
    """  # noqa: D301 - \b is click's mark for lines that are not to be wrapped
    found = get_completion_class(shell)
    if found is not None:
        complete = found(ctx.find_root().command, {}, "cqos", VARIABLE)
        emit(complete.source_template % complete.source_vars())


class _KnownWords(click.ParamType):  # type: ignore[type-arg]  # generic since click 8.5 only
    """A parameter whose values are looked up when a shell completes it."""

    name = "text"

    def __init__(self, words: Callable[[], Iterable[_Word]], *, listed: bool = False) -> None:
        """Complete ``words``; the last one of several between commas if they are ``listed``."""
        self._words, self._listed = words, listed

    def shell_complete(self, ctx: click.Context, param: click.Parameter, incomplete: str) -> list[CompletionItem]:  # noqa: ARG002 - click's signature
        """Return the words that begin with ``incomplete``, ignoring case."""
        head, comma, start = incomplete.rpartition(",") if self._listed else ("", "", incomplete)
        words = sorted(each for each in self._words() if each[0].lower().startswith(start.lower()))
        return [CompletionItem(f"{head}{comma}{word}", help=" ".join(about.split())) for word, about in words]


def with_completion(command: click.Command) -> click.Command:
    """Return the command with shell completion for the values of its parameters."""
    for param in command.params:
        param.type = _type_of(param)
    return command


def _type_of(param: click.Parameter) -> Any:
    named = param.name if isinstance(param, click.Argument) else ""
    metavar = re.findall("[A-Z]+", param.metavar or (named or "").upper() or "-")[:1]
    kind = param.type
    if isinstance(kind, Registered):
        return _KnownWords(lambda: _registered(kind.kind))
    if isinstance(kind, AssignmentType):
        return _KnownWords(_options) if kind.form.startswith("PACK.") else kind
    if kind is not click.STRING:
        return kind
    if param.name == "show":
        words = (param.metavar or "").strip("[]").split("|")[:-1]
        return _KnownWords(lambda: [*((word, "") for word in words), *_rules()])
    if metavar in (["CODE"], ["CODES"]):
        return _KnownWords(_rules, listed=metavar == ["CODES"])
    if metavar == ["ID"]:
        return _KnownWords(lambda: _registered("packs"))
    return click.Path() if _FILES.issuperset(metavar) and metavar else kind


def _registered(kind: str) -> Iterator[_Word]:
    return ((name, info.summary) for name, info in getattr(load_plugins(), kind).items())


def _rules() -> Iterator[_Word]:
    yield from ((code, info.name) for code, info in CODES.items())
    for pack in filter(None, map(load_plugins().pack, load_plugins().packs)):
        yield from ((rule.code, rule.name) for rule in pack.rules)
        yield from ((info.code, info.name) for info in pack.codes)


def _options() -> Iterator[_Word]:
    """Yield assignments of the options with few values."""
    for pack in filter(None, map(load_plugins().pack, load_plugins().packs)):
        for policy in pack.policies:
            if policy.level == "option":
                values = policy.domain.describe().get("values") or [""]
                yield from ((f"{pack.id}.{policy.name}={value}", policy.doc) for value in values)
