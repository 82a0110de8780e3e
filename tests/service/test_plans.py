"""The calls that plan changes: what the library plans, by both servers, and what they refuse."""

import importlib.util
import os
import sys

import pytest

import cqos_core as cqos
from cqos.v1 import check_pb2
from cqos_core.model import optional_features
from cqos_core.plugins import load_plugins
from cqos_core.remote.client import ServiceError
from cqos_core.remote.refusal import Refused
from cqos_core.service.call_handlers import answer
from tests.service.test_contract import ask_web

needs_solver = pytest.mark.skipif(
    importlib.util.find_spec("ortools") is None and os.environ.get("CI") != "true",
    reason="OR-tools is not installed: pip install ./plugins/planning",
)
OPEN = b"""\
cqos: 1
protocol: ros2
participants:
  a: {publishes: {t: }}
  b: {subscribes: {t: {needs: {late_join: 3, latest: true}}}}
"""
BROKEN = b"""\
cqos: 1
protocol: ros2
participants:
  a: {publishes: {t: {reliability: best_effort}}}
  b: {subscribes: {t: {reliability: reliable}}}
"""


def documents(*texts):
    sent = [check_pb2.Document(name=f"{number}.yaml", content=text) for number, text in enumerate(texts)]
    return check_pb2.Documents(documents=sent)


def seen(plan):
    return [(each.text, tuple(each.members), each.weight, tuple(each.because)) for each in plan.changes]


@needs_solver
def test_the_service_suggests_what_the_library_suggests(service, client):
    planned = cqos.suggest(OPEN)
    found = client.suggest(OPEN)
    assert planned.changes
    assert seen(found) == seen(planned)
    assert (found.confirmed, found.proven, found.weight) == (True, True, planned.weight)
    web = ask_web(service, "Suggest", check_pb2.SuggestRequest(documents=documents(OPEN)), check_pb2.SuggestResponse)
    assert [each.text for each in web.plan.changes] == [each.text for each in planned.changes]
    (edit,) = web.plan.changes[0].edits
    assert (edit.place.source, edit.place.line) == ("0.yaml", 4)


@needs_solver
def test_the_service_repairs_what_the_library_repairs(client, tmp_path):
    file = tmp_path / "a.yaml"
    file.write_bytes(BROKEN)
    for keep in ((), ("a",)):
        assert seen(client.repair(file, keep=keep)) == seen(cqos.repair(file, keep=keep))
    kept = client.repair(BROKEN, keep=("a", "b"))
    assert not kept.confirmed
    assert any("ROS101" in part for part in kept.conflicts[0].parts)
    (change,) = client.repair(file).changes
    assert change.edits[0].place.column == cqos.repair(file).changes[0].edits[0].place.column


def test_documents_need_names_of_their_own():
    for names in (("", "b.yaml"), ("a.yaml", "a.yaml")):
        sent = check_pb2.Documents(documents=[check_pb2.Document(name=name, content=OPEN) for name in names])
        with pytest.raises(Refused) as refused:
            answer("/cqos.v1.CheckService/Suggest", check_pb2.SuggestRequest(documents=sent).SerializeToString(), 100)
        assert refused.value.code == "INVALID_ARGUMENT"
        assert refused.value.fields[0].field.startswith("documents.documents[")


def test_systems_that_are_too_large_are_refused(narrow):
    more = BROKEN + b"  c: {subscribes: {t: , u: }}\n"
    with narrow.client() as client, pytest.raises(ServiceError) as refused:
        client.repair(more)
    assert (refused.value.code, refused.value.reason) == ("RESOURCE_EXHAUSTED", "TOO_LARGE")


@pytest.mark.parametrize("lacking", ["the solver", "the distribution"])
def test_without_what_plans_the_refusal_names_the_distribution_and_no_path(monkeypatch, lacking):
    if lacking == "the solver":
        monkeypatch.setitem(sys.modules, "ortools.sat.python", None)
    else:
        monkeypatch.delitem(load_plugins().functions, "suggest")
        monkeypatch.setattr(optional_features, "_is_installed", lambda name: name != "cqos-planning")
    request = check_pb2.SuggestRequest(documents=documents(OPEN)).SerializeToString()
    with pytest.raises(
        Refused, match=r"not installed.*: the service lacks the distribution `cqos-planning`$"
    ) as refused:
        answer("/cqos.v1.CheckService/Suggest", request, 100)
    assert refused.value.code == "FAILED_PRECONDITION"
