"""Serves the built page of the modeler from memory, each file plain and compressed."""

from __future__ import annotations

import gzip
import hashlib
import mimetypes
from typing import TYPE_CHECKING, Final, NamedTuple

from starlette.responses import Response
from starlette.routing import Route

from cqos_core.service.settings import PAGE

if TYPE_CHECKING:
    from pathlib import Path

    from starlette.requests import Request

HEADERS: Final = {
    "content-security-policy": (
        "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self' data:; font-src 'self'; "
        "connect-src 'self'; base-uri 'none'; form-action 'none'; frame-ancestors 'none'"
    ),
    "cross-origin-opener-policy": "same-origin",
    "cross-origin-resource-policy": "same-origin",
    "referrer-policy": "no-referrer",
    "x-content-type-options": "nosniff",
}
_KINDS: Final = {".js": "text/javascript", ".woff": "font/woff", ".woff2": "font/woff2", ".ttf": "font/ttf"}
"""Media types that the tables of some systems lack, or have wrong."""
_WORTH_IT: Final = 0.9
"""A file is sent compressed if that is smaller than this part of its size."""
_FOR_EVER: Final = "public, max-age=31536000, immutable"


class _File(NamedTuple):
    kind: str
    plain: bytes
    compressed: bytes | None
    tag: str
    caching: str


def routes() -> list[Route]:
    """Return one route for each file of the page, and ``/`` for its index."""
    files = {path.relative_to(PAGE).as_posix(): path for path in sorted(PAGE.rglob("*")) if path.is_file()}
    made = [_route(f"/{name}", _read(path, name)) for name, path in files.items() if name != "index.html"]
    return [*made, _route("/", _read(files["index.html"], "index.html"))]


def _read(path: Path, name: str) -> _File:
    plain = path.read_bytes()
    compressed = gzip.compress(plain, mtime=0)
    kind = _KINDS.get(path.suffix) or mimetypes.guess_type(path.name)[0] or "application/octet-stream"
    return _File(
        kind=f"{kind}; charset=utf-8" if kind.startswith("text/") else kind,
        plain=plain,
        compressed=compressed if len(compressed) < _WORTH_IT * len(plain) else None,
        tag=f'"{hashlib.sha256(plain).hexdigest()[:32]}"',
        # Names of assets have a hash of the content, so only the other files are requested again.
        caching=_FOR_EVER if name.startswith("assets/") else "no-cache",
    )


def _route(path: str, file: _File) -> Route:
    async def answer(request: Request) -> Response:
        headers = {**HEADERS, "cache-control": file.caching, "etag": file.tag, "vary": "accept-encoding"}
        if request.headers.get("if-none-match") == file.tag:
            return Response(status_code=304, headers=headers)
        content = file.plain
        if file.compressed is not None and "gzip" in request.headers.get("accept-encoding", ""):
            content, headers["content-encoding"] = file.compressed, "gzip"
        return Response(content, media_type=file.kind, headers=headers)

    return Route(path, answer)
