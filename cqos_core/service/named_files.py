"""Routes of the files that `cqos modeler` was started with. The page reads and saves these, and no others.

A request needs the key of this run, which no other page and no other user of the machine knows. A save states the content that
it replaces, so it never overwrites what another program wrote. Drafts are kept here, because the next run has another origin.
"""

from __future__ import annotations

import asyncio
import hashlib
import hmac
import json
from pathlib import Path
from typing import TYPE_CHECKING, Final

from starlette.responses import JSONResponse, Response
from starlette.routing import Route

from cqos_core.files.atomic_writes import ChangedFileError, replace_whole, write_new
from cqos_core.service.modeler_state import Drafts, port_secret, run_key
from cqos_core.service.settings import split_address

if TYPE_CHECKING:
    from collections.abc import Callable, Coroutine
    from typing import Any

    from starlette.requests import Request

    from cqos_core.service.settings import Settings

KEY_HEADER: Final = "x-cqos-key"
_NOT_STORED: Final = {"cache-control": "no-store", "x-content-type-options": "nosniff"}


def routes(settings: Settings) -> list[Route]:
    """Return the routes of the named files; none if the page is served to other machines."""
    if not settings.named_secret:
        return []
    files = _Files(settings)
    return [
        Route("/files", files.guarded(files.listed)),
        Route("/files/key", files.exchanged, methods=["POST"]),
        Route("/files/run", files.run),
        Route("/files/{number:int}", files.guarded(files.read), methods=["GET"]),
        Route("/files/{number:int}", files.guarded(files.saved), methods=["PUT"]),
        Route("/drafts", files.guarded(files.drafts), methods=["GET"]),
        Route("/drafts/{tab}", files.guarded(files.kept), methods=["PUT"]),
        Route("/drafts/{tab}", files.guarded(files.forgotten), methods=["DELETE"]),
    ]


class _Files:
    def __init__(self, settings: Settings) -> None:
        self._paths = [Path(name) for name in settings.named]
        self._secret, self._nonce = settings.named_secret, settings.named_nonce
        self._ticket: str | None = settings.named_ticket or None
        self._most = settings.limits.message_bytes
        self._hosts = {"localhost", split_address("--web", settings.web or "")[0]}
        self._saving = asyncio.Lock()
        self._drafts = Drafts(settings.named)

    def guarded(
        self, answer: Callable[[Request], Coroutine[Any, Any, Response]]
    ) -> Callable[[Request], Coroutine[Any, Any, Response]]:
        """Return a handler that requires the key, and the address of this machine."""

        async def guarded(request: Request) -> Response:
            if not self._is_here(request) or not _equal(request.headers.get(KEY_HEADER, ""), self._key(request)):
                return _refused(
                    403, "the key of this run of `cqos modeler` is missing; open the address that it printed"
                )
            return await answer(request)

        return guarded

    def _resume(self, request: Request) -> str:
        """Return the secret for the next run at the port of the socket, which the request cannot choose."""
        return port_secret(self._secret, request.scope["server"][1])

    def _key(self, request: Request) -> str:
        return run_key(self._resume(request), self._nonce)

    def _is_here(self, request: Request) -> bool:
        """Whether the request names this machine, and not a foreign name that resolves to it."""
        return request.url.hostname in self._hosts

    async def exchanged(self, request: Request) -> Response:
        """Exchange the ticket in the address of the browser for the key, once: other users can see the address."""
        given = request.headers.get(KEY_HEADER, "")
        # A wrong ticket leaves the right one valid: else any page could use it up.
        if self._ticket is None or not self._is_here(request) or not _equal(given, self._ticket):
            return _refused(403, "this address was opened before; open the one that `cqos modeler` printed")
        self._ticket = None
        return JSONResponse({"key": self._key(request)}, headers=_NOT_STORED)

    async def run(self, _request: Request) -> Response:
        """Return the nonce of this run, from which a page of an earlier run at this port makes the key."""
        return JSONResponse({"nonce": self._nonce}, headers=_NOT_STORED)

    async def listed(self, request: Request) -> Response:
        """Return the files by number, with name and path."""
        rows = [{"name": each.name, "path": str(each)} for each in self._paths]
        return JSONResponse({"files": rows, "resume": self._resume(request)}, headers=_NOT_STORED)

    async def drafts(self, _request: Request) -> Response:
        """Return the drafts of earlier runs with these files."""
        return JSONResponse({"drafts": await asyncio.to_thread(self._drafts.earlier)}, headers=_NOT_STORED)

    async def kept(self, request: Request) -> Response:
        """Keep a draft, so that the next run has it."""
        # A draft has the text of a diagram and the bytes of its file, each encoded.
        content = await self._body(request, 4 * self._most)
        if content is None:
            return _refused(413, f"the draft has more than {4 * self._most} bytes")
        try:
            await asyncio.to_thread(self._drafts.keep, request.path_params["tab"], json.loads(content))
        except (ValueError, KeyError, TypeError, AttributeError) as error:
            return _refused(400, f"this is no draft: {error}")
        except OSError as error:
            return _refused(422, f"cannot write {error.filename}: {error.strerror}")
        return Response(status_code=204, headers=_NOT_STORED)

    async def forgotten(self, request: Request) -> Response:
        """Remove a draft."""
        try:
            await asyncio.to_thread(self._drafts.forget, request.path_params["tab"])
        except ValueError as error:
            return _refused(400, str(error))
        except OSError as error:
            return _refused(422, f"cannot remove {error.filename}: {error.strerror}")
        return Response(status_code=204, headers=_NOT_STORED)

    async def read(self, request: Request) -> Response:
        """Return the bytes of a file with their tag; no content if the file does not exist."""
        path = self._path(request)
        if path is None:
            return _unknown()
        content = await asyncio.to_thread(self._content, path)
        if content is None:
            return Response(status_code=204, headers=_NOT_STORED)  # the first save makes it
        if isinstance(content, str):
            return _refused(422, content)
        headers = {**_NOT_STORED, "etag": _tag(content)}
        if request.headers.get("if-none-match") == headers["etag"]:
            return Response(status_code=304, headers=headers)
        return Response(content, media_type="application/octet-stream", headers=headers)

    async def saved(self, request: Request) -> Response:
        """Replace the content with the tag of `if-match`; `if-none-match: *` creates a file."""
        path = self._path(request)
        if path is None:
            return _unknown()
        content = await self._body(request, self._most)
        if content is None:
            return _refused(413, f"the file has more than {self._most} bytes")
        async with self._saving:
            return await asyncio.to_thread(self._replaced, path, content, request.headers.get("if-match"))

    @staticmethod
    async def _body(request: Request, most: int) -> bytes | None:
        """Return the body of a request; None if it is too long."""
        content = bytearray()
        async for part in request.stream():
            content += part
            if len(content) > most:
                return None
        return bytes(content)

    def _replaced(self, path: Path, content: bytes, expected: str | None) -> Response:
        present = self._content(path)
        found = _tag(present) if isinstance(present, bytes) else None
        if isinstance(present, str):
            return _refused(422, present)
        if found != expected:
            what = "changed on disk" if present is not None else "was removed"
            return _refused(412, f"{path} {what} since it was opened")
        try:
            if isinstance(present, bytes):
                replace_whole(str(path), content, present)
            else:
                write_new(str(path), content)
        except ChangedFileError as error:
            return _refused(412, f"{path} is not written: {error.strerror}")
        except OSError as error:
            return _refused(422, f"cannot write {path}: {error.strerror}")
        return Response(status_code=204, headers={**_NOT_STORED, "etag": _tag(content)})

    def _path(self, request: Request) -> Path | None:
        number: int = request.path_params["number"]
        return self._paths[number] if number < len(self._paths) else None

    def _content(self, path: Path) -> bytes | str | None:
        """Return the bytes of a file, None for a file that does not exist, or a sentence that says why it cannot be read."""
        try:
            with path.open("rb") as file:
                content = file.read(self._most + 1)
        except FileNotFoundError:
            return None
        except OSError as error:
            return f"cannot read {path}: {error.strerror}"
        return content if len(content) <= self._most else f"{path} has more than {self._most} bytes"


def _tag(content: bytes) -> str:
    return f'"{hashlib.sha256(content).hexdigest()}"'


def _equal(given: str, wanted: str) -> bool:
    return hmac.compare_digest(given.encode(), wanted.encode())


def _unknown() -> Response:
    return _refused(404, "`cqos modeler` was started without this file")


def _refused(status: int, text: str) -> Response:
    return JSONResponse({"message": text}, status, headers=_NOT_STORED)
