"""Telemetry of calls: a log line for each, metrics, and spans, without content of calls and without credentials."""

from __future__ import annotations

import logging
import re
import secrets
import threading
import time
from dataclasses import field
from functools import partial
from importlib.metadata import version
from typing import TYPE_CHECKING, Any, Final

from cqos_core.model.dataclass import dataclass
from cqos_core.service.log_lines import log, log_event

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

    from cqos_core.remote.refusal import Refused
    from cqos_core.service.settings import Settings

REQUEST_ID: Final = "x-request-id"
_LAST_SPANS_SECONDS: Final = 3.0
_GIVEN_ID: Final = re.compile(r"[A-Za-z0-9._:/+=-]{1,128}")
_OUR_FAULT: Final = frozenset({"INTERNAL", "UNKNOWN", "DATA_LOSS"})


class Meter:
    """Updates metrics; does nothing without ``metrics``.

    Attributes:
        depth: returns how many calls wait for a worker.
    """

    def __init__(self, metrics: Mapping[str, Any] | None = None) -> None:
        """Use ``metrics``, by name."""
        self._metrics = metrics
        self.depth: Callable[[], int] = lambda: 0

    def add(self, name: str, *labels: str, more: int = 1) -> None:
        """Change a metric by ``more``."""
        if self._metrics is not None:
            metric = self._metrics[name]
            (metric.labels(*labels) if labels else metric).inc(more)

    def begun(self) -> None:
        """Count a call that begins."""
        self._under_way(1)

    def ended(self, method: str, code: str, seconds: float) -> None:
        """Count a call that ends."""
        self._under_way(-1)
        self.add("calls", method, code)
        if self._metrics is not None:
            self._metrics["seconds"].labels(method).observe(seconds)

    def _under_way(self, more: int) -> None:
        self.add("under_way", more=more)
        if self._metrics is not None:
            self._metrics["waiting"].set(self.depth())


def _metrics() -> Mapping[str, Any]:
    """Register the metrics of Prometheus."""
    from prometheus_client import Counter, Gauge, Histogram

    gauge = partial(Gauge, multiprocess_mode="livesum")
    build = Gauge("cqos_build_info", "Version, as a label", ["version"], multiprocess_mode="liveall")
    build.labels(version("cqos-core")).set(1)
    return {
        "calls": Counter("cqos_calls", "Calls by method and status", ["method", "code"]),
        "seconds": Histogram("cqos_call_duration_seconds", "Duration of calls", ["method"], buckets=_BUCKETS),
        "under_way": gauge("cqos_calls_in_flight", "Calls that have no answer yet"),
        "ended": Counter("cqos_workers_ended", "Workers that took too long or too much memory, or died"),
        "sessions": gauge("cqos_sessions_open", "Open edit sessions"),
        "bytes": gauge("cqos_requests_in_flight_bytes", "Bytes of requests under way"),
        "waiting": gauge("cqos_queue_depth", "Calls that wait for a worker"),
        "refused": Counter("cqos_refusals", "Calls that were not answered, by reason", ["reason"]),
    }


_BUCKETS: Final = (0.0005, 0.001, 0.0025, 0.005, 0.01, 0.025, 0.05, 0.1, 0.25, 0.5, 1, 2.5, 5, 10, 30)


@dataclass(slots=True)
class CallRecord:
    """One call that is under way.

    Attributes:
        request_id: its id in the log.
        size: bytes of its request.
        answered: bytes of its answers.
        caller: name of its caller in the log; empty if it was not admitted.
    """

    _meter: Meter
    _span: Any
    _method: str
    request_id: str
    _peer: str
    size: int = 0
    answered: int = 0
    caller: str = ""
    _began: float = field(default_factory=time.perf_counter)

    def refused(self, refused: Refused) -> None:
        """Record that the call was refused."""
        self._meter.add("refused", refused.reason or refused.code)
        self.end(refused.code, **({"reason": refused.reason} if refused.reason else {}))

    def end(self, code: str, **fields: object) -> None:
        """Record how the call ended."""
        seconds = time.perf_counter() - self._began
        self._meter.ended(self._method, code, seconds)
        if self._span is not None:
            _end_span(self._span, code)
        level = logging.ERROR if code in _OUR_FAULT else logging.INFO
        if log.isEnabledFor(level):
            log_event(
                level,
                "call",
                request_id=self.request_id,
                method=self._method,
                code=code,
                ms=round(seconds * 1000, 3),
                caller=self.caller,
                peer=self._peer,
                bytes_in=self.size,
                bytes_out=self.answered,
                **fields,
            )


class Telemetry:
    """Records all calls."""

    def __init__(self, settings: Settings) -> None:
        """Set up metrics and tracing as the settings ask.

        Raises:
            MissingError: a library for them is not installed.
        """
        self.meter: Meter = _meter(settings)
        self._tracer = _tracer() if settings.tracing else None

    def begin(self, method: str, metadata: Mapping[str, str], peer: str) -> CallRecord:
        """Return the record of a call that begins."""
        given = metadata.get(REQUEST_ID, "")
        request_id = given if _GIVEN_ID.fullmatch(given) else secrets.token_hex(8)
        self.meter.begun()
        span = None if self._tracer is None else _begin_span(self._tracer, method, metadata, request_id)
        return CallRecord(self.meter, span, method, request_id, peer)


def _meter(settings: Settings) -> Meter:
    if settings.metrics is None:
        return Meter()
    try:
        return Meter(_metrics())
    except ImportError as error:
        from cqos_core.model.optional_features import missing

        raise missing("metrics", f"--metrics needs prometheus-client, which is not installed ({error})") from None


def _tracer() -> Any:
    try:
        from opentelemetry import trace
        from opentelemetry.exporter.otlp.proto.grpc.trace_exporter import OTLPSpanExporter
        from opentelemetry.sdk.resources import Resource
        from opentelemetry.sdk.trace import TracerProvider
        from opentelemetry.sdk.trace.export import BatchSpanProcessor
    except ImportError as error:
        from cqos_core.model.optional_features import missing

        raise missing("otel", f"--tracing needs OpenTelemetry, which is not installed ({error})") from None
    # The variables OTEL_* name the collector and the service.
    provider = TracerProvider(resource=Resource.create())
    provider.add_span_processor(BatchSpanProcessor(OTLPSpanExporter()))
    trace.set_tracer_provider(provider)
    return trace.get_tracer("cqos")


def end_tracing() -> None:
    """Send the last spans, without waiting for a slow collector."""
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
