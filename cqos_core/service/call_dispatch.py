"""Decides where a call is answered: from memory, at once in this process, or by a worker. It also admits callers.

Both servers come through here, with the bytes of messages.
"""

from __future__ import annotations

import asyncio
import hmac
import logging
import re
import time
import traceback
from collections.abc import AsyncIterator, Callable, Iterator, Mapping
from contextlib import AbstractContextManager, contextmanager
from datetime import date
from functools import partial
from typing import TYPE_CHECKING, Any, Final

from google.protobuf import json_format

from cqos_core.remote.asked import decode, decode_json
from cqos_core.remote.refusal import Refused, session_lost, too_much
from cqos_core.service import worker_frames
from cqos_core.service.answer_cache import AnswerCache
from cqos_core.service.call_handlers import METHODS, PAIRS, answer, answer_of_stream, answer_to
from cqos_core.service.caller_quotas import Caller, Callers, caller_address
from cqos_core.service.log_lines import log_event
from cqos_core.service.open_sessions import SESSIONS, OpenSessions
from cqos_core.service.session_host import SessionHost
from cqos_core.service.settings import Settings, token_sum
from cqos_core.service.worker_pool import WorkerPool
from cqos_core.service.worker_process import CallFailedError

if TYPE_CHECKING:
    from cqos_core.service.telemetry import Telemetry


_REMEMBERED_SIZE: Final = 64 * 1024

_KEPT_ENTRIES: Final = 2_048

_KEPT_BYTES: Final = 32 * 1024 * 1024

_BEARER: Final = "bearer "

ENDS: Final = "the service ends"

EVICTED: Final = "you have most of all calls under way, and others need the place"
_REVISION: Final = re.compile(rb"\x08[\x80-\xff]{0,8}[\x00-\x7f]")
"""Field 1, a number; the decoder reads longer ones."""


class CallDispatcher:
    """Answers the calls of both servers."""

    def __init__(self, settings: Settings, telemetry: Telemetry) -> None:
        """Answer within the limits of ``settings``."""
        self.settings = settings
        self.limits = settings.limits
        self.telemetry = telemetry
        self.pool = WorkerPool(self.limits, self._worker_ended)
        self.draining = False
        self.listening: set[MessageStream] = set()
        self.leaving = False
        self._shares = {token: share for token, _, share in settings.quotas}
        self._names = {token: name for token, name, _ in settings.quotas if name}
        self.callers = Callers(self.limits, telemetry.meter, self._shares)
        self.sessions = SessionHost(self.limits, self.callers.copies, self._worker_ended)
        telemetry.meter.depth = lambda: self.pool.waiting
        self.open = OpenSessions(self.sessions, self.callers, telemetry.meter, settings.tokens)
        self._answers = AnswerCache(_KEPT_ENTRIES, _KEPT_BYTES)

    def _worker_ended(self, why: str) -> None:
        self.telemetry.meter.add("ended")
        log_event(logging.WARNING, "worker ended", why=why)

    def warm(self) -> None:
        """Load all rule packs, so that no call waits for one."""
        answer("/cqos.v1.CatalogueService/ListPacks", b"", 0)

    def admit(self, metadata: Mapping[str, str]) -> str:
        """Check the token of a caller; return its hash, or an empty text if no tokens are configured.

        Raises:
            Refused: the token is missing or unknown.
        """
        if not self.settings.tokens:
            return ""
        given = metadata.get("authorization", "")
        if given[: len(_BEARER)].lower() == _BEARER:
            found = token_sum(given[len(_BEARER) :].strip(" \t"))
            # Every token is compared, so that the time it takes tells nothing.
            if any([hmac.compare_digest(found, token) for token in self.settings.tokens]):  # noqa: C419
                return found
        raise Refused("UNAUTHENTICATED", "a bearer token is needed, and this is none that is known")

    def count_call(
        self, metadata: Mapping[str, str], peer: str, certificate: str = ""
    ) -> AbstractContextManager[Caller]:
        """Admit a caller for one call, within its quota.

        Raises:
            Refused: it has no token that is known, or too many calls under way.
        """
        return self.callers.count_call(self.admit(metadata) or certificate or caller_address(peer))

    def count_watch(self, peer: str) -> AbstractContextManager[None]:
        """Count a health watch.

        Raises:
            Refused: there are too many.
        """
        return self.callers.count_watch(caller_address(peer))

    def shown(self, caller: Caller) -> str:
        """Return the name of a caller for the log: that of its token, else the beginning of the token's hash."""
        name = caller.name
        return self._names.get(name) or (f"token {name[:8]}" if name in self.settings.tokens else name)

    def hold_request(self, caller: Caller) -> AbstractContextManager[Callable[[int], None]]:
        """Count the bytes of a request that arrives in pieces; the yielded function adds them.

        Raises:
            Refused: there are too many under way.
        """
        return self.callers.hold_request(caller)

    async def unary(
        self,
        caller: Caller,
        method: str,
        data: bytes,
        remaining: float | None,
        *,
        browser: bool = False,
        json: bool = False,
    ) -> bytes:
        """Answer a call of one message: from memory, at once, or by a worker.

        A modeler sends the same model whenever a shape moves, so equal requests are answered from memory. HTTP already takes
        a turn of the loop for each request of a browser, so workers do the rest, also the conversion from and to JSON.

        Raises:
            Refused: it is not answered.
            FailedError: a worker failed.
        """
        with self._held(caller, data):
            seconds = self.limits.seconds if remaining is None else min(remaining, self.limits.seconds)
            if method in SESSIONS:
                return await self._of_session(caller, method, data, seconds, json=json)
            kind = worker_frames.ANSWER_JSON if json else worker_frames.ANSWER
            if len(data) > _REMEMBERED_SIZE:
                return await self.pool.call(caller.name, kind, method, data, seconds)
            if not json:
                return await self._unary(caller, method, data, seconds, browser=browser)
            key = (f"json {method}", date.today(), data)  # noqa: DTZ011 - as the check has it
            known = self._answers.get(key)
            if known is None:
                known = await self.pool.call(caller.name, kind, method, data, seconds)
                self._answers.put(key, known)
            return known

    async def _of_session(self, caller: Caller, method: str, data: bytes, seconds: float, *, json: bool) -> bytes:
        """Answer a call for a session. JSON is converted in a thread, because that is slow."""
        if not json:
            return await self.open.answer(caller, method, data, seconds)
        asked, answer = SESSIONS[method]
        request = await asyncio.to_thread(decode_json, asked, data)
        answered = await self.open.answer(caller, method, request.SerializeToString(), seconds)
        return await asyncio.to_thread(
            lambda: json_format.MessageToJson(answer.FromString(answered), indent=None).encode()
        )

    @contextmanager
    def _held(self, caller: Caller, data: bytes) -> Iterator[None]:
        if len(data) > self.limits.message_bytes:
            raise too_much("request", f"it has {len(data)} bytes, this service takes {self.limits.message_bytes}")
        with self.callers.hold_request(caller) as hold:
            hold(len(data))
            yield

    async def _unary(self, caller: Caller, method: str, data: bytes, seconds: float, *, browser: bool) -> bytes:
        found = METHODS[method]
        revision, asked = _split(data)
        # Accepted exceptions depend on the day.
        key = (method, date.today(), asked)  # noqa: DTZ011 - as the check has it
        known = self._answers.get(key)
        if known is None:
            request = decode(found.request, asked)
            if request.revision:  # it stands where no writer puts it
                revision = found.request(revision=request.revision).SerializeToString()
                request.revision = 0
                asked = request.SerializeToString()
                key = (method, key[1], asked)
            small = len(asked) <= self.limits.inline_bytes and not found.apart(request)
            if small and not browser and self.callers.may_answer_here(caller):
                known = await self._here(caller, partial(answer_to, method, request, self.limits.endpoints))
            else:
                known = await self.pool.call(caller.name, worker_frames.ANSWER, method, asked, seconds)
            self._answers.put(key, known)
        return revision + known  # whose field has the same number

    async def pairs(self, caller: Caller, requests: AsyncIterator[bytes]) -> AsyncIterator[bytes]:
        """Answer a stream of pairs, one by one.

        Raises:
            Refused: a message cannot be decoded, or none came in time.
        """
        heard = MessageStream(self, caller, requests, _stream_ended)
        while (data := await heard.next()) is not None:
            if len(data) > self.limits.inline_bytes:
                raise too_much("pair", f"it has {len(data)} bytes, in a stream {self.limits.inline_bytes} are taken")
            if self.callers.may_answer_here(caller):
                yield await self._here(caller, partial(answer_of_stream, data))
            else:
                yield await self.pool.call(caller.name, worker_frames.ANSWER_PAIR, PAIRS, data, self.limits.seconds)

    async def edit(self, caller: Caller, requests: AsyncIterator[bytes]) -> AsyncIterator[bytes]:
        """Answer the edits of a session.

        Raises:
            Refused: there are too many sessions, or this one is lost.
            FailedError: a worker failed.
        """
        heard = MessageStream(self, caller, requests, session_lost)
        with self.callers.count_session(caller):
            data = await heard.next()
            if data is None:
                return
            session = await self.sessions.begin(caller)
            self.telemetry.meter.add("sessions")
            try:
                while data is not None:
                    with self._held(caller, data):
                        answered = await session.edit(data)
                    yield answered
                    data = await heard.next()
            finally:
                self.telemetry.meter.add("sessions", more=-1)
                # Also if the caller is gone.
                await asyncio.shield(asyncio.ensure_future(session.close()))

    async def _here(self, caller: Caller, work: Callable[[], bytes]) -> bytes:
        """Answer in this process; other callers come between two answers for one caller."""
        if caller.calls == 1:  # its answers follow each other anyway
            return self._timed(caller, work)
        async with caller.turn:
            done = self._timed(caller, work)
            await asyncio.sleep(0)
        return done

    def _timed(self, caller: Caller, work: Callable[[], bytes]) -> bytes:
        began = time.perf_counter()
        try:
            return work()
        finally:
            self.callers.answered_here(caller, time.perf_counter() - began)

    def drain(self) -> None:
        """End the streams that wait for a message, now and from now on."""
        self.draining = True
        for each in [*self.listening]:
            each.end(ENDS)

    async def close(self) -> None:
        """End all workers."""
        await self.pool.close()
        await self.sessions.close()


def _stream_ended(why: str) -> Refused:
    return Refused("ABORTED", f"the stream of pairs is ended: {why}; begin another one")


class MessageStream:
    """The messages of a stream. The wait for the next one ends when it takes too long, or the service ends."""

    def __init__(
        self, calls: CallDispatcher, caller: Caller, requests: AsyncIterator[bytes], ended: Callable[[str], Refused]
    ) -> None:
        """Take the requests of a caller; ``ended`` makes the refusal when the wait ends."""
        self._calls = calls
        self._caller = caller
        self._requests = requests
        # The first message should come at once: a stream without one must not keep its place.
        self._patience = min(calls.limits.seconds, calls.limits.idle_seconds)
        self._ended = ended
        self._why = ""
        self._task: asyncio.Task[Any] | None = None

    async def next(self) -> bytes | None:
        """Return the next message; None at the end.

        Raises:
            Refused: the service ends, or it took too long.
        """
        # A task for each message, or for each wait, would take as long as a verdict.
        self._task = asyncio.current_task()
        why = f"nothing was heard for {self._patience:g} seconds"
        late = asyncio.get_running_loop().call_later(self._patience, self.end, why)
        self._calls.listening.add(self)
        if self._calls.draining:
            asyncio.get_running_loop().call_soon(self.end, ENDS)
        try:
            with self._calls.callers.waiting_place(self._caller, partial(self.end, EVICTED)):
                data = await anext(self._requests, None)
        except asyncio.CancelledError:
            if not self._why:
                raise
            raise self._ended(self._why) from None
        finally:
            late.cancel()
            self._calls.listening.discard(self)
        self._patience = self._calls.limits.idle_seconds
        return data

    def end(self, why: str) -> None:
        """End the wait, if there is one."""
        if self in self._calls.listening and self._task is not None:
            self._why = why
            self._task.cancel()


def _split(data: bytes) -> tuple[bytes, bytes]:
    """Split a request into its revision, which is field 1 and comes first, and the rest."""
    revision = _REVISION.match(data)
    return (b"", data) if revision is None else (revision[0], data[revision.end() :])


def internal_error(error: BaseException, request_id: str) -> Refused:
    """Log an internal error, and return the refusal for the caller, which only has the request id."""
    trace = str(error) if isinstance(error, CallFailedError) else "".join(traceback.format_exception(error))
    log_event(logging.ERROR, "internal error", request_id=request_id, traceback=trace)
    return Refused("INTERNAL", f"internal error; the service's log has it under request id {request_id}")
