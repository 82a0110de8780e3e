"""The pytest plugin: system files are tests, and failed assertions about reports show the findings.

pytest loads this module in every run, so it imports nothing else of C-QoS until a test uses it.
"""

from __future__ import annotations

import sys
from typing import TYPE_CHECKING, Any

import pytest

if TYPE_CHECKING:
    from collections.abc import Generator, Iterator
    from pathlib import Path
    from types import TracebackType

    from pluggy import Result

    from cqos_core import PairReport, Report

_FILES = "cqos_files"


def pytest_addoption(parser: pytest.Parser) -> None:
    """Add the setting that names the files to check."""
    text = "patterns of system files; each file is a test that passes if `cqos check` finds no error"
    parser.addini(_FILES, text, type="args", default=["*.cqos.yaml"])


def pytest_collect_file(file_path: Path, parent: pytest.Collector) -> SystemFile | None:
    """Collect a file that a pattern of `cqos_files` matches."""
    if any(file_path.match(pattern) for pattern in parent.config.getini(_FILES)):
        return SystemFile.from_parent(parent, path=file_path)
    return None


class SystemFile(pytest.File):
    """A file with a system."""

    def collect(self) -> Iterator[SystemCheck]:
        """Return the one test of the file."""
        yield SystemCheck.from_parent(self, name="cqos")


class SystemCheck(pytest.Item):
    """The check of one system file."""

    def runtest(self) -> None:
        """Check the file."""
        import cqos_core

        report = cqos_core.check(self.path)
        if not report.ok:
            pytest.fail(_explained(report), pytrace=False)

    def repr_failure(self, excinfo: pytest.ExceptionInfo[BaseException], style: Any = None) -> Any:
        """Show an unreadable file as its problems, without a traceback."""
        from cqos_core import CqosError

        return str(excinfo.value) if isinstance(excinfo.value, CqosError) else super().repr_failure(excinfo, style)

    def reportinfo(self) -> tuple[Path, None, str]:
        """Name the test as the command that does the same."""
        return self.path, None, f"cqos check {self.path.name}"


@pytest.hookimpl(hookwrapper=True)
def pytest_runtest_call() -> Generator[None, Result[None], None]:
    """Append the findings to a failed assertion about a report: ``assert cqos.check("system.yaml").ok``."""
    outcome = yield
    error, trace = outcome.excinfo[1:] if outcome.excinfo else (None, None)
    if isinstance(error, AssertionError) and trace is not None and "cqos_core.model.report" in sys.modules:
        texts = [_explained(report) for report in _reports(trace)]
        if texts:
            error.args = ("\n".join([*map(str, error.args[:1]), *texts]), *error.args[1:])


def _reports(trace: TracebackType) -> list[Report | PairReport]:
    """Return the reports with findings that the failed line or its function holds, each once."""
    from cqos_core import PairReport, Report, Verdict

    while trace.tb_next is not None:
        trace = trace.tb_next
    # pytest keeps the parts of a rewritten assertion among the local variables.
    held = {id(value): value for value in trace.tb_frame.f_locals.values()}.values()
    return [
        value
        for value in held
        if (isinstance(value, Report) and not value.ok)
        or (isinstance(value, PairReport) and value.verdict is not Verdict.COMPATIBLE)
    ]


def _explained(report: Report | PairReport) -> str:
    """Return what `cqos check` prints about a report."""
    from pathlib import Path

    from cqos_core import Report, Severity
    from cqos_core.formatters.full import render_full
    from cqos_core.model.style import Style

    if not isinstance(report, Report):
        return str(report)
    sources = {name: Path(name).read_bytes() for name in report.sources if Path(name).is_file()}
    show = Severity.ERROR if report.fails() else Severity.WARNING
    return render_full(report, Style(sources=sources, show=show)).rstrip()
