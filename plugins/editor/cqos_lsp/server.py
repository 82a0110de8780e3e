"""The language server: takes documents, checks them in a thread, and publishes diagnostics."""

from __future__ import annotations

import asyncio
import os
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field
from functools import partial
from importlib.metadata import metadata, version
from typing import Any, Final

from lsprotocol import types
from pygls.exceptions import JsonRpcException
from pygls.lsp.server import LanguageServer
from pygls.uris import to_fs_path

from cqos_core.model.problems import CqosError, describe
from cqos_lsp.completion import load_schemas
from cqos_lsp.diagnostics import diagnostics_of, uri_of
from cqos_lsp.document_checks import Analysis, Checker, CheckResult
from cqos_lsp.positions import Units, encoded
from cqos_lsp.projects import is_configuration, is_pack
from cqos_lsp.request_handlers import register

_PAUSE: Final = 0.15
"""Seconds without a keystroke before a check begins."""
_LONGEST_WAIT: Final = 10.0
"""Seconds that a request waits for the check of the text that it is about."""


class OutdatedError(Exception):
    """The text changed, so its check is aborted."""


@dataclass(frozen=True)
class Settings:
    """The settings of the user; `editors/vscode/package.json` and `docs/editors.md` describe them.

    Attributes:
        notes: whether findings of severity note are shown.
        hints: which effective values are shown beside endpoints: ``all``, ``stated`` (not the defaults) or ``none``.
    """

    notes: bool = False
    hints: str = "all"

    @classmethod
    def of(cls, given: object) -> Settings:
        """Return the settings that a client sends, below ``cqos`` or directly; others are ignored."""
        if isinstance(given, dict) and isinstance(given.get("cqos"), dict):
            given = given["cqos"]
        values = given if isinstance(given, dict) else {}
        hints = values.get("hints")
        return cls(values.get("notes") is True, hints if hints in {"all", "stated", "none"} else "all")


@dataclass
class State:
    """The state of the server.

    Attributes:
        texts: the open documents by real path; ``uris`` has their URIs.
        checked: the last result.
        folders: of the workspace.
        changes: number of changes of documents, files and settings.
        judged: the number of changes that the last result includes.
    """

    texts: dict[str, bytes] = field(default_factory=dict)
    uris: dict[str, str] = field(default_factory=dict)
    checked: CheckResult = field(default_factory=CheckResult)
    folders: list[str] = field(default_factory=list)
    settings: Settings = field(default_factory=Settings)
    units: Units = field(default_factory=Units)
    changes: int = 0
    judged: int = 0
    published: set[str] = field(default_factory=set)
    documentation: str = ""


class CqosServer(LanguageServer):
    """A language server that checks in one thread, always the newest text."""

    def __init__(self) -> None:
        super().__init__("cqos", version("cqos-lsp"), text_document_sync_kind=types.TextDocumentSyncKind.Full)
        self.state = State(documentation=_documentation())
        self.checker = Checker()
        self.worker = ThreadPoolExecutor(1, "check")
        self._waiting: asyncio.Task[None] | None = None
        self._settled = asyncio.Event()
        self._ready = False

    def path(self, uri: str) -> str:
        """Return the real path of a document."""
        return os.path.realpath(to_fs_path(uri) or uri)

    def changed(self) -> None:
        """Schedule a check; a running check is aborted."""
        self.state.changes += 1
        self._settled.clear()
        if self._waiting is None or self._waiting.done():
            self._waiting = asyncio.get_running_loop().create_task(self._catch_up())

    async def _catch_up(self) -> None:
        """Check until the result is of the newest texts."""
        state = self.state
        while state.judged != state.changes:
            aim = state.changes
            await asyncio.sleep(_PAUSE)
            if aim != state.changes:
                continue
            try:
                state.checked = await self.beside(partial(self._check, aim, dict(state.texts), list(state.folders)))
                self._publish()
            except OutdatedError:
                continue
            except Exception as error:  # noqa: BLE001 - a fault of one check must not end the server
                self.report(error)
            state.judged = aim
        self._settled.set()
        if not self._ready:
            self._ready = True
            # The first completion would otherwise load all packs: half a second.
            self.worker.submit(load_schemas, state.checked.projects.values())

    def _check(self, aim: int, texts: dict[str, bytes], folders: list[str]) -> CheckResult:
        def step(_done: int, _all: int) -> None:
            if self.state.changes != aim:
                raise OutdatedError

        return self.checker.check(texts, folders, step)

    async def beside(self, work: Callable[[], Any]) -> Any:
        """Run work in the thread of checks, because only one thread may use the caches of the core."""
        return await asyncio.get_running_loop().run_in_executor(self.worker, work)

    async def settled(self, path: str) -> Analysis | None:
        """Return the analysis of a document once its newest text is checked; None if it cannot be read."""
        state = self.state
        if state.judged != state.changes:
            try:
                await asyncio.wait_for(self._settled.wait(), _LONGEST_WAIT)
            except asyncio.TimeoutError:
                return None
        analysis = state.checked.of(path)
        return analysis if analysis is not None and state.checked.is_current(analysis) else None

    def _publish(self) -> None:
        state = self.state
        found = diagnostics_of(
            state.checked, state.texts, state.units, notes=state.settings.notes, documentation=state.documentation
        )
        for path in sorted({*found, *state.published, *state.texts}):
            uri = uri_of(path, state.uris)
            params = types.PublishDiagnosticsParams(uri=uri, diagnostics=found.get(path, []))
            self.text_document_publish_diagnostics(params)
        state.published = {*found}

    def report(self, error: Exception) -> None:
        """Log an exception in one line."""
        text = describe(error) if isinstance(error, CqosError) else f"internal error: {describe(error)}"
        self.window_log_message(types.LogMessageParams(types.MessageType.Error, f"cqos: {text}"))

    def report_server_error(self, error: Exception, source: Any) -> None:  # noqa: ARG002 - signature of pygls
        """Log exceptions that pygls reports, instead of showing a window; refusals are answers."""
        if not isinstance(error, JsonRpcException):
            self.report(error)


def _documentation() -> str:
    """Return the URL of the documentation, as the core's distribution states it; empty where it states none."""
    urls = (text.partition(",") for text in metadata("cqos-core").get_all("Project-URL") or ())
    return next((url.strip() for label, _, url in urls if label.strip().lower() == "documentation"), "")


def make_server() -> CqosServer:
    """Return a server with all its handlers."""
    server = CqosServer()
    _documents(server)
    register(server)
    return server


def _documents(server: CqosServer) -> None:
    """Register the handlers of notifications about documents, folders and settings."""
    state = server.state

    @server.feature(types.INITIALIZED)
    def started(_params: types.InitializedParams) -> None:
        workspace = server.workspace
        state.units = Units(str(getattr(workspace.position_encoding, "value", workspace.position_encoding)))
        state.folders = [server.path(uri) for uri in workspace.folders]
        if not state.folders and workspace.root_uri:
            state.folders = [server.path(workspace.root_uri)]

    @server.feature(types.INITIALIZE)
    def initialize(params: types.InitializeParams) -> None:
        state.settings = Settings.of(params.initialization_options)

    @server.feature(types.TEXT_DOCUMENT_DID_OPEN)
    def opened(params: types.DidOpenTextDocumentParams) -> None:
        path = server.path(params.text_document.uri)
        state.uris[path] = params.text_document.uri
        _take(server, path, params.text_document.text)

    @server.feature(types.TEXT_DOCUMENT_DID_CHANGE)
    def edited(params: types.DidChangeTextDocumentParams) -> None:
        uri = params.text_document.uri
        _take(server, server.path(uri), server.workspace.get_text_document(uri).source)

    @server.feature(types.TEXT_DOCUMENT_DID_CLOSE)
    def closed(params: types.DidCloseTextDocumentParams) -> None:
        path = server.path(params.text_document.uri)
        data = state.texts.pop(path, b"")
        if is_configuration(path) or is_pack(data):
            server.checker.projects.forget()
        server.changed()

    @server.feature(types.TEXT_DOCUMENT_DID_SAVE)
    @server.feature(types.WORKSPACE_DID_CHANGE_WATCHED_FILES)
    def written(_params: types.DidSaveTextDocumentParams | types.DidChangeWatchedFilesParams) -> None:
        server.checker.forget()
        server.changed()

    @server.feature(types.WORKSPACE_DID_CHANGE_WORKSPACE_FOLDERS)
    def moved(params: types.DidChangeWorkspaceFoldersParams) -> None:
        gone = {server.path(each.uri) for each in params.event.removed}
        added = [server.path(each.uri) for each in params.event.added]
        state.folders = [*(each for each in state.folders if each not in gone), *added]
        server.changed()

    @server.feature(types.WORKSPACE_DID_CHANGE_CONFIGURATION)
    def configured(params: types.DidChangeConfigurationParams) -> None:
        state.settings = Settings.of(params.settings)
        server.changed()


def _take(server: CqosServer, path: str, text: str) -> None:
    """Take the new text of a document."""
    data, before = encoded(text), server.state.texts.get(path, b"")
    server.state.texts[path] = data
    if is_configuration(path) or is_pack(data) or is_pack(before):
        server.checker.projects.forget()
    server.changed()
