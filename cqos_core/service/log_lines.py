"""Log lines of the service, as JSON or text, without content of calls and without credentials."""

from __future__ import annotations

import json
import logging
import os
import sys
import time
import traceback
from typing import Any, Final

log = logging.getLogger("cqos_core.service")
ALWAYS: Final = 60
"""The level of events that are always logged: start and end of the service."""
# Other loggers, whose lines get the same form.
_OTHERS: Final = ("asyncio", "grpc", "opentelemetry", "uvicorn")
_OUR_COLLECTOR: Final = ("opentelemetry.exporter", "opentelemetry.sdk")
"""Loggers about the collector of spans, whose lines have no data of callers."""


class JsonLines(logging.Formatter):
    """One JSON object per line."""

    def format(self, record: logging.LogRecord) -> str:
        """Return time, level, event and fields as JSON."""
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
    """One text line per event."""

    def format(self, record: logging.LogRecord) -> str:
        """Return one line, and a traceback below it."""
        given = getattr(record, "fields", {})
        fields = " ".join(f"{name}={value}" for name, value in given.items() if name != "traceback")
        line = f"{_time(record)} {_level(record):7} {record.getMessage()} {fields}".rstrip()
        trace = self.formatException(record.exc_info) if record.exc_info else given.get("traceback", "")
        return f"{line}\n{trace}".rstrip()


class _NoValues(logging.Filter):
    """Removes data of callers from log lines of libraries.

    Libraries log input that they cannot read, such as a token in a header that is not UTF-8. So the text of a line stays without
    arguments, and an exception keeps its type and its lines of code.
    """

    def filter(self, record: logging.LogRecord) -> bool:
        if record.name == log.name or record.name.startswith(_OUR_COLLECTOR):
            return True
        record.msg, record.args = str(record.msg).partition("\n")[0], ()
        kind, _, frames = record.exc_info or (None, None, None)
        record.exc_info = record.exc_text = None
        if kind is not None:
            trace = "".join(traceback.format_tb(frames)) + kind.__qualname__
            record.fields = {"logger": record.name, "traceback": trace}
        return True


def _level(record: logging.LogRecord) -> str:
    return "info" if record.levelno == ALWAYS else record.levelname.lower()


def _time(record: logging.LogRecord) -> str:
    stamp = time.strftime("%Y-%m-%dT%H:%M:%S", time.gmtime(record.created))
    return f"{stamp}.{int(record.msecs):03d}Z"


def start_logging(level: str, form: str) -> None:
    """Log the service and its libraries on standard error."""
    # gRPC itself would log mistakes of clients there, in another form.
    os.environ.setdefault("GRPC_VERBOSITY", "NONE")
    handler = logging.StreamHandler(sys.stderr)
    handler.setFormatter(JsonLines() if form == "json" else PlainLines())
    handler.addFilter(_NoValues())
    logging.lastResort = handler  # of all loggers that nobody named here
    log.setLevel(level.upper())
    for logger in (log, *map(logging.getLogger, _OTHERS)):
        logger.handlers[:] = [handler]
        logger.propagate = False


def log_event(level: int, event: str, **fields: object) -> None:
    """Log an event with its fields."""
    log.log(level, event, extra={"fields": fields})
