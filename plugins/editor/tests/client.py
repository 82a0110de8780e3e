"""A client of the language server: JSON-RPC over its standard input and output."""

import itertools
import json
import os
import subprocess
import sys
import threading
import time
from pathlib import Path
from queue import Empty, Queue
from typing import Any

LONGEST = 20  # seconds; a busy machine


class RefusedError(Exception):
    """The server refuses a request, in words."""


class Client:
    """Starts `cqos lsp`, sends it what an editor sends, and keeps what it says."""

    def __init__(self, folder=None, options=None, encodings=None, settings=None, command=("cqos", "lsp")):
        command = [str(Path(sys.executable).parent / command[0]), *command[1:]]
        self.process = subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.PIPE)
        self.said: Queue[dict[str, Any]] = Queue()
        self.numbers = itertools.count(1)
        self.diagnostics = {}
        self.log = []
        self.opened, self.folders = [], []
        self.versions = itertools.count(2)
        self.listener = threading.Thread(target=self._listen, daemon=True)
        self.listener.start()
        general = {"positionEncodings": encodings} if encodings else {}
        capabilities = {"general": general, "textDocument": {}, "workspace": {"workspaceFolders": True}}
        folders = [{"uri": folder.as_uri(), "name": "test"}] if folder else None
        self.capabilities = self.ask(
            "initialize",
            {
                "processId": os.getpid(),
                "rootUri": folder.as_uri() if folder else None,
                "workspaceFolders": folders,
                "capabilities": capabilities,
                "initializationOptions": options or {},
            },
        )["capabilities"]
        self.tell("initialized", {})

    def __enter__(self):
        return self

    def __exit__(self, *_):
        try:
            self.ask("shutdown", None)
            self.tell("exit", None)
            assert self.process.wait(LONGEST) == 0
            assert self.process.stderr.read() == b""
            assert self.log == []
        finally:
            self.process.kill()
            self.listener.join(LONGEST)
            for stream in (self.process.stdin, self.process.stdout, self.process.stderr):
                stream.close()

    def _send(self, message):
        body = json.dumps({"jsonrpc": "2.0", **message}).encode()
        self.process.stdin.write(b"Content-Length: %d\r\n\r\n" % len(body) + body)
        self.process.stdin.flush()

    def _listen(self):
        stream = self.process.stdout
        while line := stream.readline():
            length = 0
            while line.strip():
                name, _, value = line.partition(b":")
                length = int(value) if name.lower() == b"content-length" else length
                line = stream.readline()
            self.said.put(json.loads(stream.read(length)))

    def _next(self, until):
        message = self.said.get(timeout=max(0.01, until - time.monotonic()))
        if message.get("method") == "textDocument/publishDiagnostics":
            self.diagnostics[message["params"]["uri"]] = message["params"]["diagnostics"]
        elif message.get("method") == "window/logMessage":
            self.log.append(message["params"]["message"])
        elif "method" in message and "id" in message:
            self._send({"id": message["id"], "result": None})
        return message

    def tell(self, method, params):
        self._send({"method": method, "params": params})

    def ask(self, method, params):
        number = next(self.numbers)
        self._send({"id": number, "method": method, "params": params})
        until = time.monotonic() + LONGEST
        while (message := self._next(until)).get("id") != number or "method" in message:
            pass
        if "error" in message:
            raise RefusedError(message["error"]["message"])
        return message["result"]

    def work_in(self, folder):
        """Open a folder in the editor."""
        self.folders.append(folder)
        self._folders([folder], [])

    def _folders(self, added, removed):
        event = {
            "added": [{"uri": each.as_uri(), "name": each.name} for each in added],
            "removed": [{"uri": each.as_uri(), "name": each.name} for each in removed],
        }
        self.tell("workspace/didChangeWorkspaceFolders", {"event": event})

    def close_all(self):
        for path in self.opened:
            self.tell("textDocument/didClose", {"textDocument": {"uri": path.as_uri()}})
        self._folders([], self.folders)
        self.tell("workspace/didChangeConfiguration", {"settings": {}})
        self.opened, self.folders = [], []

    def open(self, path, text=None, language="yaml"):
        self.opened.append(path)
        text = path.read_text(encoding="utf-8") if text is None else text
        document = {"uri": path.as_uri(), "languageId": language, "version": 1, "text": text}
        return self._after(path, "didOpen", {"textDocument": document})

    def change(self, path, text):
        document = {"uri": path.as_uri(), "version": next(self.versions)}
        return self._after(path, "didChange", {"textDocument": document, "contentChanges": [{"text": text}]})

    def _after(self, path, method, params):
        """Return the diagnostics of a document after a change of it, short."""
        self.diagnostics.pop(path.as_uri(), None)
        self.tell(f"textDocument/{method}", params)
        until = time.monotonic() + LONGEST
        while path.as_uri() not in self.diagnostics:
            try:
                self._next(until)
            except Empty:
                raise AssertionError(f"no diagnostics after {method}; log: {self.log}") from None
        # What else changed was published before the answer to any request.
        self.ask("textDocument/documentSymbol", {"textDocument": {"uri": path.as_uri()}})
        return self.shown(path)

    def shown(self, path):
        """Return the code, line and columns of each diagnostic of a document, sorted."""
        return sorted(
            (
                each["code"],
                each["range"]["start"]["line"],
                each["range"]["start"]["character"],
                each["range"]["end"]["character"],
            )
            for each in self.diagnostics[path.as_uri()]
        )

    def at(self, path, method, line, character, **more):
        """Ask about a position of a document."""
        where = {"textDocument": {"uri": path.as_uri()}, "position": {"line": line, "character": character}}
        if method == "references":
            where["context"] = {"includeDeclaration": True}
        return self.ask(f"textDocument/{method}", {**where, **more})
