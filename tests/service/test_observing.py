"""Spans of calls: they continue the caller's trace, and say how the call ended."""

import json
import logging

import pytest
from opentelemetry.sdk.trace import TracerProvider
from opentelemetry.sdk.trace.export import SimpleSpanProcessor
from opentelemetry.sdk.trace.export.in_memory_span_exporter import InMemorySpanExporter
from opentelemetry.trace import StatusCode

from cqos_core.service.observing import ALWAYS, JsonLines, Observer, PlainLines
from cqos_core.service.settings import Settings

TRACE = "4bf92f3577b34da6a3ce929d0e0e4736"


@pytest.mark.parametrize(("code", "status"), [("OK", StatusCode.UNSET), ("INTERNAL", StatusCode.ERROR)])
def test_a_span_continues_the_trace_of_the_caller(code, status):
    spans = InMemorySpanExporter()
    provider = TracerProvider()
    provider.add_span_processor(SimpleSpanProcessor(spans))
    observer = Observer(Settings())
    observer._tracer = provider.get_tracer("test")
    given = {"traceparent": f"00-{TRACE}-00f067aa0ba902b7-01", "x-request-id": "mine"}
    observer.begin("/cqos.v1.CheckService/CheckPair", given, "peer", 3).end(code, 4)
    (span,) = spans.get_finished_spans()
    assert (span.name, f"{span.context.trace_id:x}") == ("cqos.v1.CheckService/CheckPair", TRACE)
    assert (span.attributes["cqos.request_id"], span.status.status_code) == ("mine", status)


@pytest.mark.parametrize("given", ["", "a b", "x" * 129, 'a"b', "a\nb"])
def test_an_id_that_could_forge_a_line_is_replaced(given):
    watch = Observer(Settings()).begin("/m", {"x-request-id": given}, "", 0)
    assert watch.request_id != given
    assert len(watch.request_id) == 16


def test_lines_are_one_line_each_whatever_stands_in_them():
    record = logging.LogRecord("n", logging.ERROR, "f", 1, "call", None, None)
    record.told = {"peer": "a\nb", "traceback": "one\ntwo"}
    line = JsonLines().format(record)
    assert "\n" not in line
    assert json.loads(line)["peer"] == "a\nb"
    assert PlainLines().format(record).endswith("one\ntwo")
    record.levelno = ALWAYS
    assert json.loads(JsonLines().format(record))["level"] == "info"
