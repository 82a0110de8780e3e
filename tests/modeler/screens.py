"""The states of the page that people look at, and pictures of them.

`python -m tests.modeler.screens FOLDER [STATE…]` takes each state at both sizes in both themes, to look at before a release.
`python -m tests.modeler.screens --docs [STATE…]` renews pictures in docs/img.
"""

from __future__ import annotations

import contextlib
import sys
import tempfile
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from tests.browser import FLAGS, chromium
from tests.modeler.conftest import NAME, ROOT, Running, Shown, Tab
from tests.modeler.drawings import CATCH, THROW, Event, Pool, drawing
from tests.service.service_process import serving

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from playwright.sync_api import Browser

IMAGES = ROOT / "docs" / "img"
EXAMPLES = ROOT / "examples"
SIZES = {"large": {"width": 1280, "height": 720}, "zoomed": {"width": 640, "height": 360}}
"""A laptop, and the same at 200 %."""
THEMES = ("light", "dark")
PAPER = (EXAMPLES / NAME).read_text(encoding="utf-8")
INCOMPATIBLE = (EXAMPLES / "smart_agriculture_incompatible.bpmn").read_text(encoding="utf-8")
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
FAME = '<qos:policy reliability="1" type="reliability" value="1"/><qos:policy durability="0"/>'
OTHER_TOOLS = drawing(
    Pool("Sensor", (Event("Codes", THROW, "temperature", {"reliability": "1", "deadline": "2"}),)),
    Pool("Station", (Event("Fame", CATCH, "temperature", None, FAME),)),
)
NEEDS = drawing(
    Pool("Sensor", (Event("Temperature", THROW, "temperature"),)),
    Pool("Station", (Event("Log", CATCH, "temperature", None, '<qos:need name="late_join" value="3"/>'),)),
)


def _choose(element: str, seen: str = ".panel .field") -> Callable[[Shown, Path], None]:
    def reach(shown: Shown, _folder: Path) -> None:
        shown.choose(element)
        shown.page.locator(seen).first.wait_for()

    return reach


def _new(shown: Shown, _folder: Path) -> None:
    shown.page.locator(".list-note", has_text="Nothing to check yet").wait_for()


def _first(shown: Shown, _folder: Path) -> None:
    shown.page.locator(".panel").get_by_role("button", name="Add a publisher").click()
    shown.page.keyboard.type("weather")
    shown.page.keyboard.press("Enter")
    shown.page.locator(".qos-badge-unmatched").wait_for()
    shown.page.locator('.panel [data-policy="reliability"]').wait_for()


def _problems(shown: Shown, _folder: Path) -> None:
    shown.choose("Typo")
    shown.page.locator(".problem-line").first.wait_for()
    shown.page.locator(".panel .card").first.wait_for()


def _problem(shown: Shown, _folder: Path) -> None:
    shown.page.locator(".problem-line").first.click()
    shown.page.locator(".problem-details .side").first.wait_for()


def _matrix(shown: Shown, _folder: Path) -> None:
    shown.choose("Temperature")
    shown.page.get_by_role("tab", name="Topic matrix").click()
    shown.page.locator(".topic").first.wait_for()


def _beside(shown: Shown, folder: Path) -> None:
    file = folder / "fleet.yaml"
    file.write_text(FLEET, encoding="utf-8")
    shown.put_beside(file)
    shown.page.locator(".document", has_text="logger").wait_for()
    shown.choose("Temperature")


def _protocol(shown: Shown, _folder: Path) -> None:
    shown.page.locator(".panel .field").get_by_label("Protocol", exact=True).select_option("mqtt")
    shown.page.locator(".panel .convert", has_text="does not know").wait_for()
    shown.page.locator(".qos-badge-error").first.wait_for()


def _mqtt(shown: Shown, folder: Path) -> None:
    _protocol(shown, folder)
    shown.page.get_by_role("button", name="Remove them from all").click()
    shown.page.wait_for_function("() => document.querySelectorAll('.qos-badge-compatible').length === 4")
    shown.choose("Drone_ThrowReq")
    shown.page.locator('.panel [data-policy="qos"]').wait_for()


def _folds(shown: Shown, _folder: Path) -> None:
    shown.choose("Drone_ThrowReq")
    shown.page.locator(".panel .fold").first.wait_for()
    shown.page.evaluate("() => document.querySelectorAll('.panel details').forEach(each => { each.open = true; })")
    shown.page.locator(".panel .fold").first.scroll_into_view_if_needed()


def _suggest(shown: Shown, _folder: Path) -> None:
    shown.choose("Temperature")
    shown.page.get_by_role("button", name="Suggest settings").click()
    shown.page.locator(".suggestion li").first.wait_for()
    shown.page.locator(".suggestion").scroll_into_view_if_needed()


def _away(shown: Shown, _folder: Path) -> None:
    shown.page.route("**/cqos.v1.*/**", lambda route: route.abort())
    shown.choose("Drone_ThrowReq")
    shown.page.locator(".panel .field").get_by_label("Reliability", exact=True).select_option("reliable")
    shown.notice("does not answer").wait_for()


def _help(shown: Shown, _folder: Path) -> None:
    shown.page.get_by_role("button", name="Keyboard help").click()
    shown.page.get_by_role("dialog").wait_for()


def _add(shown: Shown, _folder: Path) -> None:
    shown.choose("Drone_TakeOff").press("n")
    shown.page.get_by_role("dialog").wait_for()


def _leave(shown: Shown, _folder: Path) -> None:
    shown.choose("Drone_TakeOff").press("Delete")
    shown.page.get_by_role("button", name="New", exact=True).click()
    shown.page.get_by_role("dialog").wait_for()


def _menu(shown: Shown, _folder: Path) -> None:
    shown.page.get_by_role("button", name="More ways to save").click()
    shown.page.get_by_role("menuitem").first.wait_for()


def _token(shown: Shown, _folder: Path) -> None:
    shown.page.get_by_role("dialog", name="Token of the service").get_by_label("Token").fill("another-token-0123456789")
    shown.page.keyboard.press("Enter")
    shown.page.get_by_text("The service refused this token.").wait_for()


@dataclass(frozen=True)
class State:
    """A state of the page.

    Attributes:
        text: the diagram; None for a new one.
        reach: how a person gets there.
        picture: name of its picture in the docs, if it has one.
        size, theme: those of that picture.
        is_team: the service is that of a team, with tokens.
    """

    text: str | None
    reach: Callable[[Shown, Path], object]
    picture: str = ""
    size: str = "large"
    theme: str = "light"
    is_team: bool = False


STATES = {
    "new": State(None, _new),
    "first": State(None, _first, "modeler-first"),
    "compatible": State(PAPER, _choose("Drone_ThrowReq")),
    "incompatible": State(INCOMPATIBLE, _choose("Drone_ThrowReq", ".panel .card:has-text('Best effort')"), "modeler"),
    "problems": State(SEVERAL, _problems, "modeler-problems-dark", theme="dark"),
    "zoomed": State(SEVERAL, _problems, "modeler-zoomed-dark", "zoomed", "dark"),
    "problem": State(INCOMPATIBLE, _problem),
    "error": State(SEVERAL, _choose("Guess", ".panel .card")),
    "matrix": State(SEVERAL, _matrix, "modeler-matrix"),
    "beside": State(SEVERAL, _beside, "modeler-beside"),
    "protocol": State(PAPER, _protocol, "modeler-protocol"),
    "mqtt": State(PAPER, _mqtt),
    "folds": State(PAPER, _folds),
    "convert": State(OTHER_TOOLS, _choose("Fame", ".panel .convert:has-text('another tool')"), "modeler-other-tools"),
    "suggest": State(NEEDS, _suggest),
    "away": State(PAPER, _away, "modeler-away"),
    "help": State(PAPER, _help),
    "add": State(PAPER, _add),
    "leave": State(PAPER, _leave),
    "menu": State(PAPER, _menu),
    "token": State(None, _token, "modeler-token", is_team=True),
}
IN_DOCS = {name: state for name, state in STATES.items() if state.picture}


@contextlib.contextmanager
def reached(browser: Browser, state: State, folder: Path, scale: int = 1, **options: Any) -> Iterator[Shown]:
    """Show a state in a modeler of its own."""
    file = folder / NAME
    file.unlink(missing_ok=True)
    if state.text is not None:
        file.write_text(state.text, encoding="utf-8")
    with contextlib.ExitStack() as stack:
        if state.is_team:
            (folder / "tokens").write_text("a-token-of-the-team-0123456789abcdef name=team\n", encoding="utf-8")
            team = ("--web", "127.0.0.1:0", "--modeler", "--token-file", str(folder / "tokens"))
            address = stack.enter_context(serving(*team)).web
        else:
            running = Running(file, folder=folder)
            stack.callback(running.stop)
            address = running.address
        shown = Shown(Tab(browser, device_scale_factor=scale), address, waits=False, **options)
        stack.callback(shown.context.close)
        reach(shown, state, folder)
        yield shown


def reach(shown: Shown, state: State, folder: Path) -> None:
    """Bring a page that has just been opened into a state."""
    if not state.is_team:
        shown.ready()
    if state.text is not None:
        shown.page.locator(".qos-badge").first.wait_for(state="attached")
    state.reach(shown, folder)


def take(browser: Browser, name: str, folder: Path, work: Path) -> None:
    """Take the pictures of one state into a folder."""
    with reached(browser, STATES[name], work) as shown:
        for size, viewport in SIZES.items():
            shown.page.set_viewport_size(viewport)
            for theme in THEMES:
                shown.page.emulate_media(color_scheme=theme)
                shown.page.wait_for_timeout(200)
                shown.page.screenshot(path=folder / f"{name}-{size}-{theme}.png", full_page=size == "zoomed")


def picture(browser: Browser, state: State, folder: Path, work: Path) -> Path:
    """Take the picture of a state for the docs; where it is."""
    viewport = SIZES[state.size]
    scale = SIZES["large"]["width"] // viewport["width"]
    options = {"viewport": viewport, "color_scheme": state.theme}
    file = folder / f"{state.picture}.png"
    with reached(browser, state, work, scale, **options) as shown:
        shown.page.screenshot(path=file, full_page=state.size == "zoomed")
    return file


def main(arguments: list[str]) -> None:
    """Take pictures of all states, of some, or of those in the docs."""
    from playwright.sync_api import sync_playwright

    if not arguments or arguments[0] == "--help" or set(arguments[1:]) - set(STATES):
        sys.exit(f"{__doc__}\nStates: {', '.join(STATES)}")
    with sync_playwright() as playwright, tempfile.TemporaryDirectory() as work:
        browser = playwright.chromium.launch(executable_path=chromium(), args=list(FLAGS))
        if arguments[0] == "--docs":
            for name in arguments[1:] or IN_DOCS:
                picture(browser, STATES[name], IMAGES, Path(work))
        else:
            folder = Path(arguments[0])
            folder.mkdir(parents=True, exist_ok=True)
            for name in arguments[1:] or STATES:
                take(browser, name, folder, Path(work))
        browser.close()


if __name__ == "__main__":
    main(sys.argv[1:])
