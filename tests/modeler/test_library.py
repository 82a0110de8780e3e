"""The package `cqos-modeler` in another page: the example of its README, built and shown."""

import contextlib
import functools
import http.server
import re
import shutil
import subprocess
import tarfile
import threading
from pathlib import Path
from typing import Any

import pytest

from tests.browser import missing
from tests.modeler.conftest import Shown
from tests.modeler.drawings import CATCH, Event, Pool, drawing, written
from tests.service.service_process import serving

ROOT = Path(__file__).resolve().parents[2]
MODELER = ROOT / "modeler"
TOOLS = MODELER / "node_modules" / ".bin"  # `npx` takes half a second to find them
EXAMPLE = ROOT / "examples" / "smart_agriculture_incompatible.bpmn"
PAGE = """<!doctype html><title>Another page</title><link rel="icon" href="data:,">
<div id="canvas" style="width: 900px; height: 500px"></div><p id="status"></p>
<div id="panel"></div><div id="problems"></div><div id="matrix"></div><div id="beside"></div>
<script type="module" src="/page.ts"></script>
"""


def run(*command, folder):
    done = subprocess.run(command, cwd=folder, capture_output=True, text=True, check=False, timeout=180)
    assert done.returncode == 0, done.stdout + done.stderr


@pytest.fixture
def package(built, tmp_path):
    """A folder with the package as npm packs it, beside what it needs."""
    if not (shutil.which("npm") and (MODELER / "node_modules").is_dir()):
        missing("npm")
    source = tmp_path / "source"
    shutil.copytree(MODELER, source, ignore=shutil.ignore_patterns("node_modules", "dist", "bpmnlint*"))
    (source / "node_modules").symlink_to(MODELER / "node_modules")
    run(TOOLS / "vite", "build", "--config", "vite.library.config.ts", folder=source)
    run(TOOLS / "tsc", "--project", "tsconfig.library.json", folder=source)
    run("npm", "pack", "--pack-destination", str(tmp_path), folder=source)
    (packed,) = tmp_path.glob("*.tgz")
    host = tmp_path / "host"
    (host / "node_modules").mkdir(parents=True)
    for each in (MODELER / "node_modules").iterdir():
        (host / "node_modules" / each.name).symlink_to(each)
    safely: dict[str, Any] = {"filter": "data"} if hasattr(tarfile, "data_filter") else {}  # not before Python 3.11.4
    shutil.unpack_archive(packed, host / "node_modules", "gztar", **safely)
    (host / "node_modules" / "package").rename(host / "node_modules" / "cqos-modeler")
    return host


@contextlib.contextmanager
def served(folder):
    """Serve a folder; yields the address."""

    class Quiet(http.server.SimpleHTTPRequestHandler):
        def log_message(self, *_):
            pass

    server = http.server.ThreadingHTTPServer(("127.0.0.1", 0), functools.partial(Quiet, directory=str(folder)))
    thread = threading.Thread(target=server.serve_forever)
    thread.start()
    try:
        yield f"http://127.0.0.1:{server.server_port}"
    finally:
        server.shutdown()
        thread.join()
        server.server_close()


def swaps_with_a_document_beside(page, folder):
    """Show a document as the diagram and back: no two documents have one name, and one that is no diagram changes nothing."""
    other = drawing(Pool("B", (Event("Elsewhere", CATCH, "t"),)))
    files = [written(folder, "other.bpmn", other), written(folder, "broken.bpmn", "<definitions>")]
    page.evaluate("() => { delete window.showOpenFilePicker; }")  # no test can answer the dialog of the system
    for file in files:
        with page.expect_file_chooser() as waiting:
            page.click("text=Open beside the diagram")
        waiting.value.set_files(file)
    page.locator(".document", has_text="broken.bpmn").get_by_role("button", name="Show as the diagram").click()
    page.wait_for_selector("#status >> text=Nothing is checked: the service cannot read broken.bpmn.")
    page.wait_for_timeout(300)
    assert page.locator("[data-element-id=Drone_ThrowReq].djs-shape").count() == 1
    page.get_by_role("button", name="Remove broken.bpmn").click()
    for shown, beside in (("Elsewhere", "diagram.bpmn"), ("Drone_ThrowReq", "other.bpmn")):
        page.click("text=Show as the diagram")
        page.wait_for_selector(f"[data-element-id={shown}].djs-shape")
        page.wait_for_selector(f"#beside h3 >> text={beside}")
        assert page.locator(".document").count() == 1
    page.wait_for_selector(".qos-badge-incompatible")


def test_the_example_of_the_readme_compiles_and_shows_verdicts(package, tab, tmp_path):
    (example,) = re.findall(r"```ts\n(.*?)```", (MODELER / "README.md").read_text(encoding="utf-8"), re.DOTALL)
    (package / "index.html").write_text(PAGE, encoding="utf-8")
    (package / "public").mkdir()
    shutil.copy(EXAMPLE, package / "public" / "diagram.bpmn")
    shutil.copy(MODELER / "tsconfig.json", package / "tsconfig.json")
    with served(package / "dist") as page, serving("--web", "127.0.0.1:0", "--origin", page) as service:
        (package / "page.ts").write_text(example.replace("http://127.0.0.1:8080", service.web), encoding="utf-8")
        settings = '{"extends": "./tsconfig.json", "include": ["page.ts"]}'
        (package / "tsconfig.page.json").write_text(settings, encoding="utf-8")
        run(TOOLS / "tsc", "--project", "tsconfig.page.json", folder=package)
        run(TOOLS / "vite", "build", "--target", "es2022", folder=package)
        shown = Shown(tab, page)
        try:
            shown.page.wait_for_selector(".qos-incompatible")
            assert shown.page.inner_text("#status") == "Incompatible: 1 of 2 pairs, 2 errors, 4 warnings"
            assert shown.page.locator(".qos-badge-incompatible").count() == 2
            shown.page.click("[data-element-id=Drone_ThrowReq]")
            shown.page.wait_for_selector("#panel >> text=Reliability")
            assert "ROS101" in shown.page.inner_text("#problems")
            swaps_with_a_document_beside(shown.page, tmp_path)
            assert shown.complaints == []
        finally:
            shown.close()
