"""Tables of the page: requirements hop by hop, guarantees under faults, recorded runs."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final

from cqos_core.formatters.proofs import timeline
from cqos_core.model.finding import Verdict, plural
from cqos_core.packs.guarantee import LINK
from cqos_core.packs.prover import Event
from cqos_pictures.graph import rank
from cqos_pictures.page_text import WORDS, first_names, state, symbol

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping

    from cqos_core.model.report import Guarantee
    from cqos_pictures.anchors import Anchors
    from cqos_pictures.picture_parts import Picture, RequirementPath

_MOST_LINES: Final = 60
_MOST_CODES: Final = 4


def requirements(picture: Picture, anchors: Anchors) -> list[dict[str, Any]]:
    """Return pairs with what their subscribers require and get, over every hop; pairs that get the same together."""
    found: dict[str, dict[str, Any]] = {}
    for path in picture.paths:
        data = _requirement(path)
        if data is None:
            continue
        anchor = anchors.give("guarantees", "", path.publisher, path.subscriber)
        key = (
            repr((data["verdict"], data["table"], data["faults"], data["proofs"], data["reasons"]))
            + str(path) * data["path"]
        )
        if key in found:
            found[key]["others"].append({"anchor": anchor, "pair": f"{path.publisher} → {path.subscriber}"})
            found[key]["has_others"] = True
        else:
            found[key] = {**data, "anchor": anchor}
    return list(found.values())


def _requirement(path: RequirementPath) -> dict[str, Any] | None:
    pair, hops = path.pair, path.pair.hops
    if not pair.guarantees:
        return None
    # Over several hops, what is left of a connected path has a column of its own.
    faults = [cell.fault for cell in pair.guarantees[0].cells if not hops or cell.fault != LINK]
    reasons = dict(reason for each in pair.guarantees for reason in _losses(each))
    by_hop = [{each.word: each.value for each in hop.guarantees} for hop in hops]
    return {
        "publisher": path.publisher,
        "subscriber": path.subscriber,
        "needs": [{"word": word, "limit": _limit(text)} for word, text in path.needs.items()],
        "has_needs": bool(path.needs),
        "path": bool(hops),
        "state": state(wrong=rank(pair.verdict) > 0),
        "verdict": WORDS[pair.verdict],
        "symbol": symbol(pair.verdict),
        "steps": list(_steps(path)),
        "heads": [f"hop {number}" for number in range(1, len(hops) + 1)],
        "table": [
            {
                "word": each.word,
                "needed": each.word in path.needs,
                "limit": _limit(path.needs.get(each.word, "")),
                "hops": [_given(hop.get(each.word, "unknown")) for hop in by_hop],
                "end": _given(each.value),
                "cells": _cells(each, faults),
                "lost": first_names(list(dict.fromkeys(code for code, _ in _losses(each))), _MOST_CODES),
            }
            for each in pair.guarantees
        ],
        "faults": ["connected" if fault == LINK else fault.replace("_", " ") for fault in faults],
        "reasons": [{"code": code, "because": because} for code, because in reasons.items()],
        "has_reasons": bool(reasons),
        "proofs": _proofs(pair.guarantees),
        "others": [],
        "has_others": False,
    }


def _limit(text: str) -> str:
    """Return the limit of a requirement, if it has one."""
    return "" if text in {"", "true"} else text


def _steps(path: RequirementPath) -> Iterator[dict[str, Any]]:
    """Yield the steps of a path: both ends, and topics and bridges between them."""
    yield {"kind": "end", "text": path.publisher, "detail": "publisher", "verdict": "", "symbol": ""}
    for number, hop in enumerate(path.pair.hops, 1):
        verdict = {"verdict": WORDS[hop.verdict], "symbol": symbol(hop.verdict)}
        yield {"kind": "topic", "text": hop.topic, "detail": f"hop {number}, {hop.protocol}", **verdict}
        if hop.bridge is not None:
            yield {"kind": "bridge", "text": hop.bridge, "detail": "bridge", "verdict": "", "symbol": ""}
    yield {"kind": "end", "text": path.subscriber, "detail": "subscriber", "verdict": "", "symbol": ""}


def _given(value: str) -> dict[str, str]:
    kind = value if value in {"yes", "no", "unknown"} else "no" if value == "none" else "number"
    return {"value": value, "kind": kind}


def _cells(guarantee: Guarantee, faults: list[str]) -> list[dict[str, str]]:
    by_fault = {cell.fault: cell for cell in guarantee.cells}
    cells = []
    for fault in faults:
        cell = by_fault.get(fault)
        proven = ", ".join(cell.proven) if cell else ""
        cells.append({**_given(cell.value if cell else "unknown"), "proven": proven})
    return cells


def _losses(guarantee: Guarantee) -> list[tuple[str, str]]:
    return [*guarantee.lost, *(reason for cell in guarantee.cells for reason in cell.lost)]


def _proofs(guarantees: tuple[Guarantee, ...]) -> list[str]:
    """Return on which middleware guarantees were proven, and for which ones derived."""
    cells = [cell for each in guarantees for cell in each.cells]
    proven = dict.fromkeys(name for cell in cells for name in cell.proven)
    derived = dict.fromkeys(name for cell in cells for name in cell.derived)
    if not proven:
        return []
    return [f"proven on {', '.join(proven)}" + (f"; derived for {', '.join(derived)}" if derived else "")]


def runs(picture: Picture) -> list[dict[str, Any]]:
    """Return the runs that ``cqos prove`` recorded."""
    return [_run(each) for each in picture.runs[:_MOST_LINES]]


def _run(run: Mapping[str, Any]) -> dict[str, Any]:
    fault = (run.get("plan") or {}).get("fault")
    lines = timeline(Event(**each) for each in run["events"])
    return {
        "publisher": run["publisher"],
        "subscriber": run["subscriber"],
        "topic": run["topic"],
        "on": run["on"],
        "fault": f"{fault['kind'].replace('_', ' ')} of {fault['seconds']:g} s" if fault else "no fault",
        "state": state(wrong=run["verdict"] != Verdict.COMPATIBLE or not run["agrees"]),
        "verdict": run["verdict"],
        "fixes": run["fixes"],
        "matched": "connected" if run["matched"] else "not connected",
        "arrived": f"{len(run['arrived'])} of {plural(len(run['sent']), 'sample')} arrived",
        "kind": "agrees" if run["agrees"] else "error",
        "answer": "as C-QoS says" if run["agrees"] else "not as C-QoS says",
        "disagreements": run["disagreements"],
        "lines": first_names(lines, _MOST_LINES),
    }
