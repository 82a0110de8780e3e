"""A process that answers calls which may take long: ``python -m cqos_core.service.worker``. Frames come on standard input.

It ends when its input ends, and when a call used all memory that it may have: that frees its caches, and no answer made
without memory goes out. The service kills it when a call takes too long.
"""

from __future__ import annotations

import os
import signal
import sys
import traceback
from contextlib import suppress
from pathlib import Path
from typing import BinaryIO, Final

from cqos_core.model.garbage_collection import collect_new_objects_only
from cqos_core.remote.edit_session import EditSession
from cqos_core.remote.open_models import OpenModel
from cqos_core.remote.refusal import Refused, too_much
from cqos_core.service import worker_frames
from cqos_core.service.call_handlers import METHODS, answer, answer_json, answer_of_stream

_NEARLY_ALL: Final = 0.9
METHOD_NAMES: Final = tuple(METHODS)


class Worker:
    """Answers one call after another."""

    def __init__(self, most_endpoints: int, memory: int) -> None:
        """Answer calls over systems of at most so many endpoints, with so many bytes of memory (0: any)."""
        self._most = most_endpoints
        self._memory = memory
        self._sessions: dict[int, EditSession | OpenModel] = {}
        allowed = f"the {memory} bytes that are allowed" if memory else "there is"
        status = too_much("request", f"answering it takes more memory than {allowed}").status()
        # Made now, while there is memory.
        self._spent = worker_frames.Frame(worker_frames.SPENT, 0, status.SerializeToString()).encoded()

    def serve(self, calls: BinaryIO, answers: BinaryIO) -> None:
        """Answer until there are no more calls, or no memory for them."""
        spent = False
        while not spent and (answer := self._next(calls)) is not None:
            answers.write(answer)
            answers.flush()
            spent = answer is self._spent

    def _next(self, calls: BinaryIO) -> bytes | None:
        try:
            call = worker_frames.read(calls)
            return None if call is None else self._answer(call).encoded()
        except MemoryError:
            return self._spent

    def _answer(self, call: worker_frames.Frame) -> worker_frames.Frame:
        try:
            if call.kind == worker_frames.EDIT_SESSION and call.number not in self._sessions:
                return worker_frames.Frame(worker_frames.GONE, call.number, b"")
            return worker_frames.Frame(worker_frames.OK, call.number, self._do(call))
        except Refused as refused:
            return worker_frames.Frame(worker_frames.REFUSED, call.number, refused.status().SerializeToString())
        except MemoryError:
            raise
        except Exception:  # noqa: BLE001 - the log gets it, and the caller no details
            # Extensions turn a MemoryError into errors of their own, protobuf into a DecodeError.
            if _nearly_all_used(self._memory):
                raise MemoryError from None
            return worker_frames.Frame(
                worker_frames.FAILED, call.number, traceback.format_exc().encode("utf-8", "replace")
            )

    def _do(self, call: worker_frames.Frame) -> bytes:
        match call.kind:
            case worker_frames.ANSWER:
                return answer(METHOD_NAMES[call.number], call.data, self._most)
            case worker_frames.ANSWER_JSON:
                return answer_json(METHOD_NAMES[call.number], call.data, self._most)
            case worker_frames.ANSWER_PAIR:
                return answer_of_stream(call.data)
            case worker_frames.REOPEN_SESSION:
                again = self._sessions[call.number] = EditSession(self._most)
                again.repeat(worker_frames.unpack_messages(call.data))
            case worker_frames.OPEN_SESSION:
                self._sessions[call.number] = EditSession(self._most)
            case worker_frames.OPEN_MODEL:
                model = OpenModel(self._most)
                opened = model.open(call.data)
                self._sessions[call.number] = model
                return opened
            case worker_frames.EDIT_SESSION:
                return self._sessions[call.number].edit(call.data)
            case worker_frames.CLOSE_SESSION:
                self._sessions.pop(call.number, None)
        return b""


def main(arguments: list[str]) -> None:
    """Serve with the limits that the arguments give: endpoints, and bytes of memory (0: any)."""
    most_endpoints, memory = map(int, arguments)
    # Ctrl-C in a terminal reaches all its processes; the service ends its workers itself.
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    _bound(memory)
    # Printed text must not come between frames.
    with os.fdopen(os.dup(sys.stdout.fileno()), "wb") as answers:
        os.dup2(sys.stderr.fileno(), sys.stdout.fileno())
        with suppress(BrokenPipeError):  # the service is gone
            answer("/cqos.v1.CatalogueService/ListPacks", b"", 0)  # loads every rule pack
            collect_new_objects_only()
            answers.write(worker_frames.Frame(worker_frames.OK, 0, b"").encoded())
            answers.flush()
            Worker(most_endpoints, memory).serve(sys.stdin.buffer, answers)
    # Without freeing each object, which takes long.
    os._exit(0)


def _nearly_all_used(memory: int) -> bool:
    """Whether memory was nearly used up."""
    if not memory or sys.platform != "linux":
        return False
    (peak,) = (line for line in Path("/proc/self/status").read_text(encoding="ascii").splitlines() if "VmPeak" in line)
    return int(peak.split()[1]) * 1024 > memory * _NEARLY_ALL


def _bound(memory: int) -> None:
    """Limit the memory of this process (RLIMIT_AS)."""
    if memory and sys.platform == "linux":
        import resource

        with suppress(ValueError, OSError):  # less is allowed already
            resource.setrlimit(resource.RLIMIT_AS, (memory, memory))


if __name__ == "__main__":
    main(sys.argv[1:])
