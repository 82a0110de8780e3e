"""The states of the page that the docs show. `CQOS_SCREENSHOTS=1` writes them there: pixels depend on the fonts of a machine."""

import os

import pytest

from tests.modeler.conftest import NAME, ROOT
from tests.modeler.drawings import CATCH, THROW, Event, Pool, drawing

PAPER = (ROOT / "examples" / NAME).read_text(encoding="utf-8")
LARGE = {"width": 1280, "height": 720}
ZOOMED = {"width": 640, "height": 360}
FLEET = """cqos: 1
protocol: ros2
participants:
  logger: {subscribes: {temperature: {reliability: reliable}, temprature: {}}}
"""
SEVERAL = drawing(
    Pool("Sensor", (Event("Temperature", THROW, "temperature", {"reliability": "best_effort"}),)),
    Pool(
        "Station",
        (
            Event("Fast", CATCH, "temperature", {"reliability": "best_effort"}),
            Event("Safe", CATCH, "temperature", {"reliability": "reliable"}),
            Event("Guess", CATCH, "temperature", {"reliability": "reliabel"}),
            Event("Typo", CATCH, "temprature"),
        ),
    ),
)


def matrix(shown, _folder):
    shown.choose("Temperature")
    shown.page.get_by_role("tab", name="Topic matrix").click()
    shown.page.locator(".topic").first.wait_for()


def problems(shown, _folder):
    shown.choose("Typo")
    shown.page.locator(".problem-line").first.wait_for()
    shown.page.locator(".panel .card").first.wait_for()


def beside(shown, tmp_path):
    file = tmp_path / "fleet.yaml"
    file.write_text(FLEET, encoding="utf-8")
    shown.page.get_by_role("tab", name="Other documents").click()
    shown.page.locator('.tab-content input[type="file"]').set_input_files(file)
    shown.page.locator(".document", has_text="logger").wait_for()
    shown.choose("Temperature")


def mqtt(shown, _folder):
    shown.page.locator(".panel .field").get_by_label("Protocol", exact=True).select_option("mqtt")
    shown.page.locator(".panel .convert", has_text="does not know").wait_for()


STATES = {
    "matrix": (SEVERAL, matrix, LARGE, "light"),
    "problems-dark": (SEVERAL, problems, LARGE, "dark"),
    "beside": (SEVERAL, beside, LARGE, "light"),
    "protocol": (PAPER, mqtt, LARGE, "light"),
    "zoomed-dark": (SEVERAL, problems, ZOOMED, "dark"),
}


@pytest.mark.parametrize("state", STATES)
def test_the_screens_of_the_docs(opens, tmp_path, state):
    text, reach, viewport, theme = STATES[state]
    shown = opens(text, viewport=viewport, color_scheme=theme, device_scale_factor=LARGE["width"] // viewport["width"])
    shown.page.wait_for_selector(".qos-badge")
    reach(shown, tmp_path)
    folder = ROOT / "docs" / "img" if os.environ.get("CQOS_SCREENSHOTS") else tmp_path
    file = folder / f"modeler-{state}.png"
    shown.page.screenshot(path=file)
    assert file.stat().st_size > 10_000
