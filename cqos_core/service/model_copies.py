"""A copy of a session of single calls, from which another process can continue it."""

from __future__ import annotations

from typing import TYPE_CHECKING

from cqos.v1 import session_pb2
from cqos_core.service import worker_frames

if TYPE_CHECKING:
    from collections.abc import Iterator


class ModelCopy:
    """The present documents of a session; for a model, its first form and all changes."""

    def __init__(self, opening: bytes) -> None:
        """Keep the request that opened it."""
        self._opening = session_pb2.OpenSessionRequest.FromString(opening)
        self._changes: list[bytes] = []

    def follow(self, edit: bytes, answer: bytes) -> None:
        """Apply an edit to the copy, unless it was refused."""
        if session_pb2.EditSessionResponse.FromString(answer).HasField("refusal"):
            return
        request = session_pb2.EditSessionRequest.FromString(edit)
        if request.HasField("changes"):
            self._changes.append(edit)
            return
        self._opening.revision = request.revision
        documents = {each.name: each for each in self._opening.documents.documents}
        for name in request.documents.removed:
            documents.pop(name, None)
        documents |= {each.name: each for each in request.documents.put}
        kept = [*documents.values()]
        del self._opening.documents.documents[:]
        self._opening.documents.documents.extend(kept)

    def frames(self) -> Iterator[tuple[int, bytes]]:
        """Yield the calls that open the session again, each with its kind of `worker_frames`."""
        yield worker_frames.OPEN_MODEL, self._opening.SerializeToString()
        for each in self._changes:
            yield worker_frames.EDIT_SESSION, each
