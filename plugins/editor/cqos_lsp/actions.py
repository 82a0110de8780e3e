"""Code actions: fixes of findings, and the comment that accepts a finding."""

from __future__ import annotations

import os
import re
from typing import TYPE_CHECKING

from lsprotocol.types import CodeAction, CodeActionKind, Range, TextEdit, WorkspaceEdit

from cqos_core.files.edited_files import replacements_of
from cqos_core.formatters import phrases
from cqos_core.importers.format_detection import claims_yaml
from cqos_lsp.diagnostics import shown_findings, uri_of
from cqos_lsp.positions import lines_of, located

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping, Sequence

    from lsprotocol.types import Diagnostic

    from cqos_core.model.finding import Finding, Remedy
    from cqos_lsp.document_checks import Analysis
    from cqos_lsp.positions import Units


def actions(
    analysis: Analysis,
    path: str,
    extent: Range,
    given: Sequence[Diagnostic],
    units: Units,
    uris: Mapping[str, str],
    *,
    notes: bool,
) -> list[CodeAction]:
    """Return the actions for findings in a range: their fixes, the smallest first, and their acceptance.

    Args:
        analysis: of the present text.
        path: of the document.
        extent: the range.
        given: the diagnostics of the editor; each action names the ones that it fixes.
        units: how columns are counted.
        uris: how the client calls its open documents.
        notes: whether findings of severity note are shown.
    """
    found = []
    for finding in shown_findings(analysis, notes=notes):
        if not _touches(finding, path, extent, analysis, units):
            continue
        fixed = [each for each in given if each.code == finding.code and each.message.startswith(finding.message)]
        best = next((each for each in finding.remedies if each.is_automatic), None)
        for remedy in finding.remedies:
            edit = _edit(remedy, analysis, units, uris)
            if edit is not None:
                preferred = remedy is best
                title = f"{finding.code}: {phrases.fix(remedy)}"
                found.append(CodeAction(title, CodeActionKind.QuickFix, fixed, is_preferred=preferred, edit=edit))
        found += _acceptance(finding, fixed, analysis, units, uris)
    return found


def _touches(finding: Finding, path: str, extent: Range, analysis: Analysis, units: Units) -> bool:
    place = finding.place
    if place is None or os.path.realpath(place.source) != path:
        return False
    shown = units.of(place, analysis.sources)
    return shown.start <= extent.end and extent.start <= shown.end


def _edit(remedy: Remedy, analysis: Analysis, units: Units, uris: Mapping[str, str]) -> WorkspaceEdit | None:
    """Return a fix as text edits; None if one of its edits cannot be applied."""
    changes = {
        uri_of(name, uris): [
            TextEdit(units.replaced(lines_of(analysis.sources[name]), change), change.text) for change in changed
        ]
        for name, changed in replacements_of(analysis.sources, remedy.edits).items()
    }
    return WorkspaceEdit(changes=changes) if changes else None


def _acceptance(
    finding: Finding, fixed: list[Diagnostic], analysis: Analysis, units: Units, uris: Mapping[str, str]
) -> Iterator[CodeAction]:
    """Yield the action that adds an accepting comment; the person has to write the reason."""
    found = located(finding.place, analysis.sources)
    if found is None or not finding.endpoints or not claims_yaml(found[0], analysis.sources[found[0]]):
        return
    source, line, *_ = found
    lines = lines_of(analysis.sources[source])
    text = lines.line(line)
    if re.search(r"(?:^|\s)#", text) or lines.text.lstrip().startswith("{"):
        return
    end = units.position(lines, line, len(text) + 1)
    edit = TextEdit(Range(end, end), f"  # cqos: ignore[{finding.code}] ")
    changes = {uri_of(source, uris): [edit]}
    title = f"{finding.code}: accept it here (write the reason behind the comment)"
    yield CodeAction(title, CodeActionKind.QuickFix, fixed, edit=WorkspaceEdit(changes=changes))
