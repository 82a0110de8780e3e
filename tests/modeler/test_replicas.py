"""A team behind a proxy: a person edits in the page while one replica is killed and the other replaced, and notices nothing."""

import pytest

from tests.modeler.conftest import NAME, ROOT, Shown
from tests.modeler.test_page import DROP
from tests.service.service_process import Service
from tests.service.test_replicas import Proxy

NOTICED = """() => {
    const noticed = window.noticed = [];
    const listen = changes => changes.forEach(change => change.addedNodes.forEach(node => noticed.push(node.textContent)));
    new MutationObserver(listen).observe(document.querySelector('.notices'), { childList: true });
}"""


@pytest.fixture
def replicas():
    """Two replicas that serve the page, by name; those that are still there are ended."""

    def start():
        return Service("--no-config", "--listen", "127.0.0.1:0", "--web", "127.0.0.1:0", "--modeler", "--leaving", "0")

    found = {"first": start(), "second": start()}
    yield found, start
    for each in found.values():
        each.stop()


def test_a_person_at_the_page_notices_no_replica_that_goes(built, tab, replicas):
    running, start = replicas
    proxy = Proxy([running["first"].addresses["web"], running["second"].addresses["web"]])
    shown = Shown(tab, f"http://127.0.0.1:{proxy.port}/")
    try:
        page = shown.page
        page.evaluate(DROP, [NAME, (ROOT / "examples" / NAME).read_text(encoding="utf-8")])
        page.wait_for_function("() => document.querySelectorAll('.qos-badge-compatible').length === 4")
        page.evaluate(NOTICED)
        shown.choose("Station_CatchReq")
        reliability = page.locator(".panel .field").get_by_label("Reliability", exact=True)
        for number in range(6):
            if number == 2:
                running["first"].process.kill()
            if number == 4:
                running["third"] = start()
                proxy.replicas = [running["third"].addresses["web"]]
                running["second"].process.terminate()
                running["second"].process.wait(30)
            state, value = (("incompatible", "reliable"), ("compatible", "best_effort"))[number % 2]
            reliability.select_option(value)
            count = {"incompatible": 2, "compatible": 4}[state]
            page.wait_for_function(
                "([state, count]) => document.querySelectorAll(`.qos-badge-${state}`).length === count",
                arg=[state, count],
            )
        assert page.evaluate("window.noticed") == []
    finally:
        shown.close()
        proxy.close()
