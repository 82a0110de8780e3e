"""Spans of calls: they continue the caller's trace, say how the call ended, and reach the collector."""

import json
import logging
import time
from concurrent.futures import ThreadPoolExecutor
from typing import Any

import grpc
import pytest
from google.rpc import code_pb2
from opentelemetry.proto.collector.trace.v1 import trace_service_pb2, trace_service_pb2_grpc
from opentelemetry.proto.trace.v1 import trace_pb2
from opentelemetry.sdk.trace import TracerProvider
from opentelemetry.sdk.trace.export import SimpleSpanProcessor
from opentelemetry.sdk.trace.export.in_memory_span_exporter import InMemorySpanExporter
from opentelemetry.trace import StatusCode

from cqos.v1 import check_pb2, check_pb2_grpc
from cqos_core.service.log_lines import ALWAYS, JsonLines, PlainLines
from cqos_core.service.settings import Settings
from cqos_core.service.telemetry import Telemetry

TRACE = "4bf92f3577b34da6a3ce929d0e0e4736"


@pytest.mark.parametrize(("code", "status"), [("OK", StatusCode.UNSET), ("INTERNAL", StatusCode.ERROR)])
def test_a_span_continues_the_trace_of_the_caller(code, status):
    spans = InMemorySpanExporter()
    provider = TracerProvider()
    provider.add_span_processor(SimpleSpanProcessor(spans))
    telemetry = Telemetry(Settings())
    telemetry._tracer = provider.get_tracer("test")
    given = {"traceparent": f"00-{TRACE}-00f067aa0ba902b7-01", "x-request-id": "mine"}
    telemetry.begin("/cqos.v1.CheckService/CheckPair", given, "peer").end(code)
    (span,) = spans.get_finished_spans()
    assert (span.name, f"{span.context.trace_id:x}") == ("cqos.v1.CheckService/CheckPair", TRACE)
    assert (span.attributes["cqos.request_id"], span.status.status_code) == ("mine", status)


class Collector(trace_service_pb2_grpc.TraceServiceServicer):
    """A collector of OpenTelemetry, as far as traces go.

    Attributes:
        resources: what each batch said of its sender.
        headers: what came beside each batch.
    """

    def __init__(self):
        self.resources = []
        self.headers = []
        self.spans = {}
        self._server = grpc.server(ThreadPoolExecutor(2))
        trace_service_pb2_grpc.add_TraceServiceServicer_to_server(self, self._server)
        self.address = f"127.0.0.1:{self._server.add_insecure_port('127.0.0.1:0')}"

    def __enter__(self):
        self._server.start()
        return self

    def __exit__(self, *_):
        self._server.stop(None).wait()

    def Export(self, request, context):  # noqa: N802 - the method's name
        self.headers.append(dict(context.invocation_metadata()))
        for sent in request.resource_spans:
            self.resources.append(values(sent.resource.attributes))
            for scope in sent.scope_spans:
                for span in scope.spans:
                    self.spans[values(span.attributes)["cqos.request_id"]] = span
        return trace_service_pb2.ExportTraceServiceResponse()

    def wait_for(self, *names):
        until = time.monotonic() + 60
        while not self.spans.keys() >= set(names):
            assert time.monotonic() < until, f"only {self.spans.keys()} came"
            time.sleep(0.02)


def values(attributes):
    return {each.key: getattr(each.value, each.value.WhichOneof("value")) for each in attributes}


def by(name):
    """What a caller says beside its message, in a trace of its own."""
    return (("x-request-id", name), ("traceparent", f"00-{TRACE}-00f067aa0ba902b7-01"))


def exporting(address):
    """How an operator says where spans go."""
    return {
        "OTEL_EXPORTER_OTLP_ENDPOINT": f"http://{address}",
        "OTEL_EXPORTER_OTLP_HEADERS": "x-of-tests=yes",
        "OTEL_EXPORTER_OTLP_TIMEOUT": "2",
        "OTEL_SERVICE_NAME": "checks-of-tests",
        "OTEL_RESOURCE_ATTRIBUTES": "deployment.environment.name=test",
        "OTEL_BSP_SCHEDULE_DELAY": "50",
    }


def test_spans_reach_a_collector_where_the_variables_say(start):
    with Collector() as collector:
        with (
            start("--tracing", environment=exporting(collector.address)) as service,
            grpc.insecure_channel(service.grpc) as channel,
        ):
            checks: Any = check_pb2_grpc.CheckServiceStub(channel)
            pair = check_pb2.CheckPairRequest(protocol="ros2", topic={"name": "a_very_secret_topic"})
            checks.CheckPair(pair, metadata=by("one"))
            list(checks.CheckPairs(iter([check_pb2.CheckPairsRequest(pair=pair)] * 3), metadata=by("stream")))
            document = check_pb2.Document(content=b"cqos: 1\nparticipants: {}\n")
            checks.CheckDocument(check_pb2.CheckDocumentRequest(documents=[document]), metadata=by("in a worker"))
            with pytest.raises(grpc.RpcError):
                checks.CheckPair(check_pb2.CheckPairRequest(), metadata=by("refused"))
            collector.wait_for("one", "stream", "refused")
            # What has not been sent yet is sent at the end.
            checks.CheckPair(pair, metadata=by("last"))
        collector.wait_for("last")
    one, refused = collector.spans["one"], collector.spans["refused"]
    assert (one.trace_id.hex(), one.parent_span_id.hex()) == (TRACE, "00f067aa0ba902b7")
    assert (one.name, one.kind) == ("cqos.v1.CheckService/CheckPair", trace_pb2.Span.SPAN_KIND_SERVER)
    assert values(one.attributes) == {
        "rpc.system": "grpc",
        "rpc.service": "cqos.v1.CheckService",
        "rpc.method": "CheckPair",
        "rpc.grpc.status_code": code_pb2.OK,
        "cqos.request_id": "one",
    }
    assert 0 < one.end_time_unix_nano - one.start_time_unix_nano < 20e9
    assert values(refused.attributes)["rpc.grpc.status_code"] == code_pb2.INVALID_ARGUMENT
    assert refused.status.code == trace_pb2.Status.STATUS_CODE_UNSET  # it is no fault of the service
    assert collector.spans["stream"].name == "cqos.v1.CheckService/CheckPairs"
    assert {each["x-of-tests"] for each in collector.headers} == {"yes"}
    assert {each["service.name"] for each in collector.resources} == {"checks-of-tests"}
    assert {each["deployment.environment.name"] for each in collector.resources} == {"test"}
    assert "secret" not in str(collector.spans)


def test_without_a_collector_calls_are_answered_and_the_end_is_not_kept_waiting(start):
    patient = {**exporting("127.0.0.1:1"), "OTEL_EXPORTER_OTLP_TIMEOUT": "60"}
    with start("--tracing", environment=patient) as service:
        with service.client() as client:
            for _ in range(3):
                assert client.check_pair("ros2").verdict == "compatible"
        logged = service.wait_for(lambda line: "traces" in str(line["event"]))
        assert logged["level"] in {"warning", "error"}  # and it is a line as all are
        began = time.monotonic()
        assert service.stop() == 0
        assert time.monotonic() - began < 10


@pytest.mark.parametrize("given", ["", "a b", "x" * 129, 'a"b', "a\nb"])
def test_an_id_that_could_forge_a_line_is_replaced(given):
    watch = Telemetry(Settings()).begin("/m", {"x-request-id": given}, "")
    assert watch.request_id != given
    assert len(watch.request_id) == 16


def test_lines_are_one_line_each_whatever_stands_in_them():
    record = logging.LogRecord("n", logging.ERROR, "f", 1, "call", None, None)
    record.fields = {"peer": "a\nb", "traceback": "one\ntwo"}
    line = JsonLines().format(record)
    assert "\n" not in line
    assert json.loads(line)["peer"] == "a\nb"
    assert PlainLines().format(record).endswith("one\ntwo")
    record.levelno = ALWAYS
    assert json.loads(JsonLines().format(record))["level"] == "info"
