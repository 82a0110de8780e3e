"""Observation of calls: structured logs, metrics, spans. They hold no content of calls and no credential."""

from __future__ import annotations

import json
import logging
import os
import re
import secrets
import sys
import threading
import time
from importlib.metadata import version
from typing import TYPE_CHECKING, Any, Final

from cqos_core.model.problems import CqosError

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

    from cqos_core.service.refusal import Refused
    from cqos_core.service.settings import Settings

log = logging.getLogger("cqos_core.service")
REQUEST_ID: Final = "x-request-id"
ALWAYS: Final = 60
"""The level of events that every level logs: the service begins and ends."""
# Other loggers, whose lines get the same form.
_OTHERS: Final = ("asyncio", "grpc", "opentelemetry", "uvicorn")
_LAST_SPANS_SECONDS: Final = 3.0
_GIVEN_ID: Final = re.compile(r"[A-Za-z0-9._:/+=-]{1,128}")
_OUR_FAULT: Final = frozenset({"INTERNAL", "UNKNOWN", "DATA_LOSS"})


class JsonLines(logging.Formatter):
    """One JSON object per line."""

    def format(self, record: logging.LogRecord) -> str:
        """Write time, level, what happened, and what belongs to it."""
        fields: dict[str, Any] = {
            "time": _time(record),
            "level": _level(record),
            "event": record.getMessage(),
            **getattr(record, "fields", {}),
        }
        if record.exc_info:
            fields["traceback"] = self.formatException(record.exc_info)
        return json.dumps(fields, ensure_ascii=True, default=str)


class PlainLines(logging.Formatter):
    """The same for people."""

    def format(self, record: logging.LogRecord) -> str:
        """Write it in one line, and a traceback below it."""
        fields = " ".join(
            f"{name}={value}" for name, value in getattr(record, "fields", {}).items() if name != "traceback"
        )
        line = f"{_time(record)} {_level(record):7} {record.getMessage()} {fields}".rstrip()
        trace = getattr(record, "fields", {}).get("traceback", "")
        if record.exc_info:
            trace = self.formatException(record.exc_info)
        return f"{line}\n{trace}".rstrip()


def _level(record: logging.LogRecord) -> str:
    return "info" if record.levelno == ALWAYS else record.levelname.lower()


def _time(record: logging.LogRecord) -> str:
    stamp = time.strftime("%Y-%m-%dT%H:%M:%S", time.gmtime(record.created))
    return f"{stamp}.{int(record.msecs):03d}Z"


def start_logging(level: str, form: str) -> None:
    """Write what the service tells to standard error."""
    # gRPC has a form of its own there, and tells what is wrong with strangers.
    os.environ.setdefault("GRPC_VERBOSITY", "NONE")
    handler = logging.StreamHandler(sys.stderr)
    handler.setFormatter(JsonLines() if form == "json" else PlainLines())
    log.setLevel(level.upper())
    for logger in (log, *map(logging.getLogger, _OTHERS)):
        logger.handlers[:] = [handler]
        logger.propagate = False


def tell(level: int, event: str, **fields: object) -> None:
    """Log an event with what belongs to it."""
    log.log(level, event, extra={"fields": fields})


class Meter:
    """Counts calls: this one nothing, and others what they override."""

    def begun(self, method: str) -> None:
        """Note that a call began."""

    def ended(self, method: str, code: str, seconds: float) -> None:
        """Note how a call ended."""

    def worker_ended(self) -> None:
        """Note that a worker had to be ended."""

    def sessions(self, more: int) -> None:
        """Note that so many more sessions are open, or fewer."""

    def bytes(self, more: int) -> None:
        """Note that the requests under way have so many bytes more, or fewer."""

    def queue(self, depth: Callable[[], int]) -> None:
        """Ask ``depth`` for the number of calls that wait for a worker."""

    def refused(self, reason: str) -> None:
        """Note why a call was refused."""


class PrometheusMeter(Meter):
    """Counts for Prometheus."""

    def __init__(self) -> None:
        """Register what is counted."""
        from prometheus_client import REGISTRY, Counter, Gauge, Histogram

        self._calls = Counter("cqos_calls", "Calls by method and status", ["method", "code"], registry=REGISTRY)
        self._seconds = Histogram(
            "cqos_call_duration_seconds",
            "Duration of calls",
            ["method"],
            buckets=(0.0005, 0.001, 0.0025, 0.005, 0.01, 0.025, 0.05, 0.1, 0.25, 0.5, 1, 2.5, 5, 10, 30),
            registry=REGISTRY,
        )
        self._under_way = Gauge(
            "cqos_calls_in_flight", "Calls that have no answer yet", registry=REGISTRY, multiprocess_mode="livesum"
        )
        self._ended = Counter(
            "cqos_workers_ended", "Workers that took too long or too much memory, or died", registry=REGISTRY
        )
        self._sessions = Gauge(
            "cqos_sessions_open", "Open edit sessions", registry=REGISTRY, multiprocess_mode="livesum"
        )
        self._bytes = Gauge(
            "cqos_requests_in_flight_bytes",
            "Bytes of requests under way",
            registry=REGISTRY,
            multiprocess_mode="livesum",
        )

        self._waiting = Gauge(
            "cqos_queue_depth", "Calls that wait for a worker", registry=REGISTRY, multiprocess_mode="livesum"
        )
        self._refused = Counter(
            "cqos_refusals", "Calls that were not answered, by reason", ["reason"], registry=REGISTRY
        )
        self._depth: Callable[[], int] = lambda: 0
        build = Gauge(
            "cqos_build_info", "Version, as a label", ["version"], registry=REGISTRY, multiprocess_mode="liveall"
        )
        build.labels(version("cqos-core")).set(1)

    def queue(self, depth: Callable[[], int]) -> None:
        """Ask for it whenever a call begins or ends."""
        self._depth = depth

    def refused(self, reason: str) -> None:
        """Count it by reason."""
        self._refused.labels(reason).inc()

    def begun(self, method: str) -> None:  # noqa: ARG002 - of all meters
        """Count it as under way."""
        self._under_way.inc()
        self._waiting.set(self._depth())

    def ended(self, method: str, code: str, seconds: float) -> None:
        """Count it by method and code."""
        self._under_way.dec()
        self._waiting.set(self._depth())
        self._calls.labels(method, code).inc()
        self._seconds.labels(method).observe(seconds)

    def worker_ended(self) -> None:
        """Count it."""
        self._ended.inc()

    def sessions(self, more: int) -> None:
        """Count them."""
        self._sessions.inc(more)

    def bytes(self, more: int) -> None:
        """Count them."""
        self._bytes.inc(more)


class Watch:
    """One call that is under way.

    Attributes:
        request_id: by which the log calls it.
        size: bytes of its request.
        caller: who makes it, as the log says it; empty where it is not let in.
    """

    __slots__ = ("_began", "_meter", "_method", "_peer", "_span", "caller", "request_id", "size")

    def __init__(self, meter: Meter, span: Any, method: str, request_id: str, peer: str, size: int) -> None:
        """Begin."""
        self._began = time.perf_counter()
        self._meter = meter
        self._span = span
        self._method = method
        self._peer = peer
        self.size = size
        self.caller = ""
        self.request_id = request_id

    def refused(self, refused: Refused, size: int = 0) -> None:
        """Tell that it ended by a refusal."""
        self._meter.refused(refused.reason or refused.code)
        self.end(refused.code, size, **({"reason": refused.reason} if refused.reason else {}))

    def end(self, code: str, size: int = 0, **fields: object) -> None:
        """Tell how it ended."""
        seconds = time.perf_counter() - self._began
        self._meter.ended(self._method, code, seconds)
        if self._span is not None:
            _end_span(self._span, code)
        level = logging.ERROR if code in _OUR_FAULT else logging.INFO
        if log.isEnabledFor(level):
            tell(
                level,
                "call",
                request_id=self.request_id,
                method=self._method,
                code=code,
                ms=round(seconds * 1000, 3),
                caller=self.caller,
                peer=self._peer,
                bytes_in=self.size,
                bytes_out=size,
                **fields,
            )


class Observer:
    """Watches all calls."""

    def __init__(self, settings: Settings) -> None:
        """Count and trace as the settings say.

        Raises:
            CqosError: what that needs is not installed.
        """
        self.meter: Meter = _meter(settings)
        self._tracer = _tracer() if settings.tracing else None

    def begin(self, method: str, metadata: Mapping[str, str], peer: str, size: int) -> Watch:
        """Watch a call."""
        given = metadata.get(REQUEST_ID, "")
        request_id = given if _GIVEN_ID.fullmatch(given) else secrets.token_hex(8)
        self.meter.begun(method)
        span = None if self._tracer is None else _begin_span(self._tracer, method, metadata, request_id)
        return Watch(self.meter, span, method, request_id, peer, size)


def _meter(settings: Settings) -> Meter:
    if settings.metrics is None:
        return Meter()
    try:
        return PrometheusMeter()
    except ImportError:
        raise CqosError("--metrics needs the extra `metrics`: pip install 'cqos[metrics]'") from None


def _tracer() -> Any:
    try:
        from opentelemetry import trace
        from opentelemetry.exporter.otlp.proto.grpc.trace_exporter import OTLPSpanExporter
        from opentelemetry.sdk.resources import Resource
        from opentelemetry.sdk.trace import TracerProvider
        from opentelemetry.sdk.trace.export import BatchSpanProcessor
    except ImportError:
        raise CqosError("--tracing needs the extra `otel`: pip install 'cqos[otel]'") from None
    # Where spans go and what the service is called, the variables OTEL_* say.
    provider = TracerProvider(resource=Resource.create())
    provider.add_span_processor(BatchSpanProcessor(OTLPSpanExporter()))
    trace.set_tracer_provider(provider)
    return trace.get_tracer("cqos")


def end_tracing() -> None:
    """Send what is still waiting, to a collector that answers soon; the end of the service waits for no other."""
    from opentelemetry import trace

    shutdown = getattr(trace.get_tracer_provider(), "shutdown", lambda: None)
    ending = threading.Thread(target=shutdown, daemon=True)
    ending.start()
    ending.join(_LAST_SPANS_SECONDS)


def _begin_span(tracer: Any, method: str, metadata: Mapping[str, str], request_id: str) -> Any:
    from opentelemetry.propagate import extract
    from opentelemetry.trace import SpanKind

    service, _, name = method.strip("/").partition("/")
    return tracer.start_span(
        f"{service}/{name}",
        context=extract(metadata),
        kind=SpanKind.SERVER,
        attributes={"rpc.system": "grpc", "rpc.service": service, "rpc.method": name, "cqos.request_id": request_id},
    )


def _end_span(span: Any, code: str) -> None:
    from google.rpc import code_pb2
    from opentelemetry.trace import StatusCode

    span.set_attribute("rpc.grpc.status_code", code_pb2.Code.Value(code))
    if code in _OUR_FAULT:
        span.set_status(StatusCode.ERROR)
    span.end()
