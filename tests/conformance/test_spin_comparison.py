"""The page about SPIN's answers is what was recorded, and no answer contradicts C-QoS."""

import json

from cqos_core.packs import LINK
from tests.conformance.spin_comparison import DOCUMENT, RECORDED, cases, document


def test_the_page_is_what_was_recorded():
    assert DOCUMENT.read_text(encoding="utf-8") == document(), "run: python -m tests.conformance.spin_comparison"


def test_no_answer_contradicts_what_c_qos_gives():
    runs = json.loads(RECORDED.read_text(encoding="utf-8"))["runs"]
    assert {(each["design"], each["fault"]) for each in runs} == {
        (design, LINK if fault is None else str(fault)) for design, _, fault in cases()
    }
    assert [text for each in runs for text in each["contradicted"]] == []
    broken = {word for each in runs for word, holds in each["holds"].items() if not holds}
    assert {"latest", "loss_free", "duplicate_free", "late_join", "offline", "max_age", "max_gap"} <= broken
