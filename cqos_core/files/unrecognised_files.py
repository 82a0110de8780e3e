"""Explains files that no importer reads: what they are, and which option or command reads them."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING, Final

from cqos_core.importers.format_detection import SMALLEST_SYSTEM
from cqos_core.model.encoding import decode
from cqos_core.model.problems import Problem
from cqos_core.model.regular_expressions import regular_expression
from cqos_core.model.settings import Place
from cqos_core.model.spelling import nearest
from cqos_core.plugins import FAULTS, named

if TYPE_CHECKING:
    from cqos_core.model.source import Source
    from cqos_core.plugins import Plugins

_HEAD: Final = 65_536
_LINES: Final = 2_000
_COMMENT: Final = regular_expression(r"\s*(?:#|//|;|--).*|\s*")
_XML_COMMENTS: Final = regular_expression(r"\s*(?:<\?xml[^>]*\?>)?\s*(?:<!--.*?-->\s*)+", re.DOTALL)
# Files of C-QoS for other options and commands, by their first lines.
_OURS: Final = (
    (regular_expression(r'\s*\{\s*"baseline"\s*:'), "a baseline of C-QoS", "name it with `--baseline`"),
    (
        regular_expression(r'\s*\{\s*"version"\s*:\s*1\s*,\s*"tool"\s*:\s*\{\s*"name"\s*:\s*"cqos"'),
        "a report of C-QoS, which is what `cqos check` writes",
        "check the files that the report is about",
    ),
    (
        regular_expression(r"(?ms).*^id\s*:.*^policies\s*:"),
        "a rule pack",
        "name it with `--pack`, beside the system to check",
    ),
)
_FORMATS: Final = "`cqos packs` lists the formats that are read, and --from chooses one"
_CONFIGURATION: Final = ("cqos.toml", "pyproject.toml")
_BEGIN: Final = f"a system file begins with `cqos: 1` and `protocol: …`; then write `{SMALLEST_SYSTEM}`"


def unrecognised_problem(source: Source, plugins: Plugins) -> Problem:
    """Return the problem of a source that no importer claims, with the option or command that reads it, if one does."""
    what, advice = _known(source, plugins) or (
        "no installed importer recognises this format",
        _general(source),
    )
    return Problem("CQ003", what, Place(source.name), advice)


def _known(source: Source, plugins: Plugins) -> tuple[str, str] | None:
    head = source.data[:_HEAD]
    if not head.strip():
        return "the file is empty", _BEGIN
    for info in plugins.importers.values():
        try:
            said = named(info.declines) if info.declines else None
            declined = said(source.name, head) if callable(said) else None
        except FAULTS as error:
            plugins.note_failure("importers", info.name, error, f"could not look at {source.name}")
            continue
        if declined:
            return declined  # type: ignore[no-any-return]
    if source.name.endswith(_CONFIGURATION):
        return (
            "this is a configuration, no design",
            "it holds for what is checked below its folder, or name it with `--config`",
        )
    if b"\0" in head and head[:2] not in {b"\xff\xfe", b"\xfe\xff"}:
        return "this is no text", _FORMATS
    text = decode(head)
    if all(_COMMENT.fullmatch(line) for line in text.splitlines()) or _XML_COMMENTS.fullmatch(text):
        return "there is nothing in this file but comments", _BEGIN
    for expression, what, advice in _OURS:
        if expression.match(text):
            return f"this is {what}", advice
    if _is_log(text, plugins):
        return "this is what running programs print", f"explain it with `cqos explain --log {source.name}`"
    return None


def _is_log(text: str, plugins: Plugins) -> bool:
    """Whether a rule pack recognises a log line about QoS in the text."""
    packs = [pack for name in plugins.packs if (pack := plugins.pack(name)) is not None]
    return any(True for line in text.splitlines()[:_LINES] for pack in packs for _ in pack.read_log(line))


def _general(source: Source) -> str:
    if not source.name.lower().endswith((".yaml", ".yml", ".json")):
        return _FORMATS
    if source.name.lower().endswith(".json"):
        return f'a system file in JSON begins with `{{"cqos": 1, "protocol": "…", "participants": {{…}}}}`; {_FORMATS}'
    first = re.match(r"\s*(\w+)\s*:", decode(source.data[:_HEAD]).lstrip("\ufeff"))
    misspelt = first is not None and first[1] != "cqos" and nearest(first[1], ["cqos"])
    return f"{'did you mean `cqos: 1`? ' if misspelt else ''}a system file begins with `cqos: 1`; {_FORMATS}"
