"""What every formatter prints for every report by hand, to the letter: look at the files as a user would."""

from dataclasses import replace

import pytest

from cqos_core import Severity
from cqos_core.files.builtin import register_formatters
from cqos_core.plugins import FormatterInfo

INFOS: list[FormatterInfo] = []
register_formatters(INFOS.append)
FORMATTERS = {info.name: info for info in INFOS if info.name != "html"}
"""A page is more than its text: `plugins/pictures/tests` opens it in a browser."""


@pytest.mark.parametrize("report", ["realistic", "clean", "nothing", "diagram", "hostile"])
@pytest.mark.parametrize("name", FORMATTERS)
def test_output(name, report, reports, style, golden):
    golden(f"{report}.{name}.txt", FORMATTERS[name].load()(reports[report], style))


@pytest.mark.parametrize("name", ["full", "concise", "github", "junit"])
def test_output_with_notes(name, reports, style, golden):
    text = FORMATTERS[name].load()(reports["realistic"], replace(style, show=Severity.NOTE))
    golden(f"realistic.{name}.notes.txt", text)


@pytest.mark.parametrize("name", ["full", "concise"])
def test_output_in_colors(name, reports, style, golden):
    text = FORMATTERS[name].load()(reports["realistic"], replace(style, color=True))
    golden(f"realistic.{name}.colors.txt", text)


def test_full_without_sources(reports, style, golden):
    text = FORMATTERS["full"].load()(reports["realistic"], replace(style, sources={}))
    golden("realistic.full.no-sources.txt", text)


def test_full_in_a_narrow_terminal(reports, style, golden):
    text = FORMATTERS["full"].load()(reports["diagram"], replace(style, width=60))
    golden("diagram.full.narrow.txt", text)
