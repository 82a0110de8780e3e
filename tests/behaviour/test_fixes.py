"""Fixes of findings about behaviour: each ends its finding and brings no error, when it is applied, read back and checked again."""

from __future__ import annotations

import pytest

import cqos_core as cqos
from tests.behaviour.model_text import model
from tests.behaviour.test_cases import cases

FIXED = ("BP101", "BP102", "BP103", "BP105", "BP106", "BP109")


def fixes(text: bytes) -> list[tuple[str, cqos.Remedy]]:
    report = cqos.check(text, importer="bpmn")
    return [(each.code, fix) for each in report.findings if each.code.startswith("BP") for fix in each.remedies]


def errors(report: cqos.Report) -> set[tuple[str, tuple[str, ...]]]:
    return {(each.code, each.endpoints) for each in report.findings if each.severity == "error"}


def test_every_fix_of_a_case_fixes():
    tried = set()
    for each in cases():
        case = each.values[0]
        stated = {name: case[name] for name in ("protocol", "external", "options") if name in case}
        text = model(case["model"], **stated)
        for code, fix in fixes(text):
            edited = cqos.apply(text, [fix], importer="bpmn")
            assert not edited.left, (each.id, fix.text)
            (after,) = edited.texts.values()
            before, now = cqos.check(text, importer="bpmn"), cqos.check(after, importer="bpmn")
            assert errors(now) <= errors(before), (each.id, fix.text)
            left = [found for found in now.findings if found.code == code and set(fix.members) & set(found.endpoints)]
            same = [
                found for found in before.findings if found.code == code and set(fix.members) & set(found.endpoints)
            ]
            assert len(left) < len(same) or code in {"BP106", "BP109"}, (each.id, fix.text)
            if code in {"BP106", "BP109"}:
                assert not any(found.code == code for found in now.findings), (each.id, fix.text)
            tried.add(code)
    assert tried == set(FIXED)


@pytest.mark.parametrize("requested", ["", "deadline=2"])
def test_a_longer_deadline_is_offered_only_where_every_subscriber_takes_it(requested):
    text = model({"A": "s: start R/PT6H\n p: throw x deadline=2\n s -> p -> e", "B": f"c: start x {requested}"})
    offered = [fix.text for code, fix in fixes(text) if code == "BP101"]
    assert offered == ([] if requested else ["offer deadline `6h` on p"])


def test_a_deeper_queue_needs_no_consent():
    """`cqos check --fix` takes it: it weakens nothing."""
    lines = (
        "s: start\n mi: sub times=10\n i: start in=mi\n p: end x in=mi reliability=reliable depth=1\n i -> p\n s -> mi"
    )
    text = model({"A": lines, "B": "c: start x depth=10 reliability=reliable need.loss_free=true"})
    ((code, fix),) = fixes(text)
    assert (code, fix.text, fix.weakens) == ("BP109", "offer depth `10` on p", False)
