"""Handlers of the requests of the protocol; each calls the module for its feature."""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING, Any, Final

from lsprotocol import types
from pygls.exceptions import JsonRpcException, JsonRpcInvalidParams

from cqos_core.model.problems import CqosError
from cqos_lsp.actions import actions
from cqos_lsp.completion import complete
from cqos_lsp.hints import hints
from cqos_lsp.hover import hover
from cqos_lsp.line_shifts import LineShift
from cqos_lsp.navigation import definition, references, renamable, rename, symbols
from cqos_lsp.positions import lines_of
from cqos_lsp.projects import is_configuration, is_pack

if TYPE_CHECKING:
    from collections.abc import Awaitable, Callable

    from cqos_lsp.document_checks import Analysis
    from cqos_lsp.projects import Project
    from cqos_lsp.server import CqosServer

    Handler = Callable[[CqosServer, Any], Awaitable[object]]


async def _completion(server: CqosServer, params: types.CompletionParams) -> types.CompletionList | None:
    path, state = server.path(params.text_document.uri), server.state
    if path not in state.texts:
        return None
    return complete(
        path, _text(server, path), params.position, state.units, _project(server, path), state.checked.of(path)
    )


async def _hover(server: CqosServer, params: types.HoverParams) -> types.Hover | None:
    path, state = server.path(params.text_document.uri), server.state
    if path not in state.texts:
        return None
    analysis = state.checked.of(path)
    place = _at(server, path, params.position)
    line = None if analysis is None else _shift(server, analysis, path).before(place[0])
    work = partial(hover, path, _text(server, path), place, _project(server, path), analysis, line)
    said = await server.beside(work)
    return types.Hover(types.MarkupContent(types.MarkupKind.Markdown, said)) if said else None


async def _fixes(server: CqosServer, params: types.CodeActionParams) -> list[types.CodeAction] | None:
    path, state = server.path(params.text_document.uri), server.state
    analysis = await server.settled(path)
    if analysis is None:
        return None
    given, notes = params.context.diagnostics, state.settings.notes
    work = partial(actions, analysis, path, params.range, given, state.units, state.uris, notes=notes)
    found: list[types.CodeAction] = await server.beside(work)
    return found


async def _definition(server: CqosServer, params: types.DefinitionParams) -> list[types.Location] | None:
    analysis, source, place = await _settled(server, params)
    return None if analysis is None else definition(analysis, source, *place, server.state.units)


async def _references(server: CqosServer, params: types.ReferenceParams) -> list[types.Location] | None:
    analysis, source, place = await _settled(server, params)
    return None if analysis is None else references(analysis, source, *place, server.state.units)


async def _named(server: CqosServer, params: Any) -> tuple[Analysis, str, tuple[int, int]]:
    """Return the result of `_settled`, or refuse a new name with the reason."""
    analysis, source, place = await _settled(server, params)
    if analysis is not None:
        return analysis, source, place
    path = server.path(params.text_document.uri)
    if is_configuration(path) or is_pack(server.state.texts.get(path, b"")):
        raise JsonRpcInvalidParams(
            "C-QoS changes names in system files only: it does not see all files that use this one"
        )
    raise JsonRpcInvalidParams("the files cannot be read as they are; no name is changed")


async def _may_rename(server: CqosServer, params: types.PrepareRenameParams) -> types.Range | None:
    analysis, source, place = await _named(server, params)
    return renamable(analysis, source, *place, server.state.units)


async def _rename(server: CqosServer, params: types.RenameParams) -> types.WorkspaceEdit | None:
    analysis, source, place = await _named(server, params)
    try:
        work = partial(rename, analysis, source, *place, params.new_name, server.state.units, server.state.uris)
        changes: types.WorkspaceEdit = await server.beside(work)
    except CqosError as error:
        raise JsonRpcInvalidParams(str(error)) from None
    return changes


async def _outline(server: CqosServer, params: types.DocumentSymbolParams) -> list[types.DocumentSymbol] | None:
    analysis, source, _ = await _settled(server, params)
    return None if analysis is None else symbols(analysis, source, server.state.units)


async def _hints(server: CqosServer, params: types.InlayHintParams) -> list[types.InlayHint] | None:
    path, state = server.path(params.text_document.uri), server.state
    analysis = state.checked.of(path)
    source = None if analysis is None else analysis.name_of(path)
    if analysis is None or source is None or state.settings.hints == "none":
        return None
    moved = _shift(server, analysis, path)
    whole = (1, len(analysis.sources[source]) + 1)
    wanted = (params.range.start.line + 1, params.range.end.line + 1) if moved.unchanged else whole
    work = partial(hints, analysis, source, *wanted, state.units, defaults=state.settings.hints == "all")
    found: list[types.InlayHint] = await server.beside(work)
    kept = []
    for each in found:
        line = moved.after(each.position.line + 1)
        if line is not None:
            each.position = types.Position(line - 1, each.position.character)
            kept.append(each)
    return kept


_TRIGGERS: Final = [" ", ":", "{", ",", "[", '"', "=", "."]
_QUICK: Final = [types.CodeActionKind.QuickFix]
_FEATURES: Final[tuple[tuple[str, object, Handler], ...]] = (
    (types.TEXT_DOCUMENT_COMPLETION, types.CompletionOptions(trigger_characters=_TRIGGERS), _completion),
    (types.TEXT_DOCUMENT_HOVER, None, _hover),
    (types.TEXT_DOCUMENT_CODE_ACTION, types.CodeActionOptions(code_action_kinds=_QUICK), _fixes),
    (types.TEXT_DOCUMENT_DEFINITION, None, _definition),
    (types.TEXT_DOCUMENT_REFERENCES, None, _references),
    (types.TEXT_DOCUMENT_PREPARE_RENAME, None, _may_rename),
    (types.TEXT_DOCUMENT_RENAME, types.RenameOptions(prepare_provider=True), _rename),
    (types.TEXT_DOCUMENT_DOCUMENT_SYMBOL, None, _outline),
    (types.TEXT_DOCUMENT_INLAY_HINT, None, _hints),
)


def register(server: CqosServer) -> None:
    """Register all handlers."""
    for name, options, answer in _FEATURES:
        server.feature(name, options)(_guarded(server, answer))


def _guarded(server: CqosServer, answer: Handler) -> Callable[[Any], Awaitable[object]]:
    """Return a handler that logs an exception in one line, and answers nothing."""

    async def handler(params: Any) -> object:
        try:
            return await answer(server, params)
        except JsonRpcException:
            raise  # an answer in words
        except Exception as error:  # noqa: BLE001 - a client has no use for a traceback
            server.report(error)
            return None

    return handler


def _text(server: CqosServer, path: str) -> str:
    return lines_of(server.state.texts.get(path, b"")).text


def _at(server: CqosServer, path: str, position: types.Position) -> tuple[int, int]:
    return server.state.units.at(lines_of(server.state.texts.get(path, b"")), position)


def _project(server: CqosServer, path: str) -> Project:
    return server.state.checked.projects.get(path) or server.checker.projects.of(path, server.state.texts)


async def _settled(server: CqosServer, params: Any) -> tuple[Analysis | None, str, tuple[int, int]]:
    """Return the analysis of the present text of a document, its name in it, and line and column."""
    path = server.path(params.text_document.uri)
    position = getattr(params, "position", types.Position(0, 0))
    analysis = await server.settled(path)
    source = None if analysis is None else analysis.name_of(path)
    return (analysis, source, _at(server, path, position)) if source is not None else (None, "", (1, 1))


def _shift(server: CqosServer, analysis: Analysis, path: str) -> LineShift:
    """Return the shift of lines since a document was checked."""
    source = analysis.name_of(path)
    then = b"" if source is None else analysis.sources[source]
    return LineShift.between(then, server.state.texts.get(path, b""))
