"""A session of documents equals a fresh check of them, after any series of edits; what it answers makes the one of the other."""

from __future__ import annotations

from hypothesis import given
from hypothesis import strategies as st

from cqos.v1 import check_pb2, report_pb2, session_pb2
from cqos_core.remote.open_models import OpenModel
from cqos_core.service.call_handlers import check_document, describe_system

MOST = 20_000
LARGE = "<!--" + " " * 40_000 + "-->"
"""Makes a document so large that its plain parts are read apart."""
BESIDE = """cqos: 1
protocol: ros2
participants: {beside: {publishes: {rain: {reliability: %s}, wind: {deadline: 2s}}}}
"""

attributes = st.fixed_dictionaries(
    {},
    optional={
        "reliability": st.sampled_from(["reliable", "best_effort", "1", "nonsense", "best_available"]),
        "durability": st.sampled_from(["volatile", "transient_local", "0"]),
        "deadline": st.sampled_from(["1", "2", "0.5", "100ms", "0"]),
        "depth": st.sampled_from(["1", "7", "-3"]),
        "leaseDuration": st.sampled_from(["3", "infinite"]),
        "profile": st.sampled_from(["sensor_data", "nowhere"]),
        "protocol": st.sampled_from(["mqtt", "dds"]),
        "external": st.sampled_from(["true", "maybe"]),
        "colour": st.just("red"),
    },
)
inside = st.sampled_from(
    [
        "",
        "",
        '<qos:need name="late_join" value="true"/>',
        '<qos:accept rule="ROS101" because="tried"/>',
        '<qos:need name="latest"/>',
    ]
)
events = st.tuples(
    st.sampled_from(["startEvent", "intermediateCatchEvent", "intermediateThrowEvent", "endEvent"]),
    st.sampled_from(["S0", "S1", "S2", "nowhere"]),
    attributes,
    inside,
)
models = st.fixed_dictionaries(
    {
        "pools": st.lists(st.dictionaries(st.sampled_from("abcdef"), events, max_size=4), min_size=1, max_size=2),
        "names": st.lists(st.sampled_from(["rain", "wind", "sun", ""]), min_size=3, max_size=3),
        "facts": st.sampled_from(["", 'qos:latched="true"', 'qos:period="1s"']),
        "rules": st.sampled_from(
            ["", '<qos:option protocol="ros2" name="rmw" value="zenoh"/>', '<qos:accept rule="CQ401" because="tried"/>']
        ),
        "check": st.sampled_from(
            ["", '<qos:check name="sure" because="tried" policy="reliability" exactly="reliable" role="publisher"/>']
        ),
        "lines": st.integers(0, 3),
        "once": st.booleans(),
    }
)
edits = st.lists(st.tuples(models, st.sampled_from([None, "reliable", "best_effort", "gone", "broken"])), max_size=5)


def drawn(model, size=""):
    """The BPMN document of a model; ids are those of letters, so that most edits are of events that stay."""
    lines = "\n" * model["lines"]
    signals = "".join(
        f'<bpmn:signal id="S{number}" name="{name}" {model["facts"] if not number else ""}/>'
        for number, name in enumerate(model["names"])
    )
    pools, processes = "", ""
    for number, pool in enumerate(model["pools"]):
        pools += f'<bpmn:participant id="P{number}" name="pool {number}" processRef="R{number}"/>'
        own = "" if model["once"] else number
        processes += f'{lines}<bpmn:process id="R{number}">' + "".join(
            f'\n<bpmn:{tag} id="{letter}{own}" name="{letter}"'
            + "".join(f' qos:{name}="{value}"' for name, value in values.items())
            + f"><bpmn:extensionElements>{children}</bpmn:extensionElements>" * bool(children)
            + ">" * (not children)
            + f'<bpmn:signalEventDefinition signalRef="{signal}"/></bpmn:{tag}>'
            for letter, (tag, signal, values, children) in pool.items()
        )
        processes += "</bpmn:process>"
    return (
        '<bpmn:definitions xmlns:bpmn="http://www.omg.org/spec/BPMN/20100524/MODEL" xmlns:qos="http://qos">'
        f"<bpmn:extensionElements>{model['rules']}{model['check']}</bpmn:extensionElements>{signals}"
        f"<bpmn:collaboration>{pools}</bpmn:collaboration>{processes}{size}</bpmn:definitions>"
    ).encode()


class Caller:
    """One who opens documents, edits them, and follows the answers."""

    def __init__(self, documents):
        self.documents, self.model, self.revision = dict(documents), OpenModel(MOST), 1
        request = session_pb2.OpenSessionRequest(revision=1, documents=self._message(), describe=True)
        answer = session_pb2.OpenSessionResponse.FromString(self.model.open(request.SerializeToString()))
        self.report = answer.report
        self.endpoints = {each.id: each for each in answer.endpoints}
        self.participants = list(answer.participants)

    def _message(self):
        given = [check_pb2.Document(name=name, content=data) for name, data in self.documents.items()]
        return check_pb2.Documents(documents=given)

    def edit(self, put, removed=()):
        """Make an edit, and take it for done unless it is refused."""
        put = {name: data for name, data in put.items() if self.documents.get(name) != data}
        removed = [name for name in removed if name in self.documents]
        changes = session_pb2.DocumentChanges(
            put=[check_pb2.Document(name=name, content=data) for name, data in put.items()], removed=removed
        )
        request = session_pb2.EditSessionRequest(
            revision=self.revision + 1, base_revision=self.revision, documents=changes
        )
        answer = session_pb2.EditSessionResponse.FromString(self.model.edit(request.SerializeToString()))
        if answer.HasField("refusal"):
            return answer
        self.revision += 1
        self.documents = {name: data for name, data in self.documents.items() if name not in removed} | put
        if answer.HasField("report"):
            self.report = answer.report
            self.endpoints, self.participants = {}, list(answer.participants)
        else:
            self.report = followed(self.report, answer.delta)
            self.participants = list(answer.participants) or self.participants
        for name in answer.removed_endpoints:
            del self.endpoints[name]
        self.endpoints |= {each.id: each for each in answer.endpoints}
        return answer

    def is_up_to_date(self):
        """Compare with a fresh check, and a fresh description, of documents that are read as a session does."""
        documents = self._message()
        documents.reading.switches["bpmn"].settings["lines"] = "false"
        asked = check_pb2.CheckDocumentRequest(documents=documents.documents, reading=documents.reading)
        assert content_of(self.report) == content_of(check_document(asked, MOST).report)
        found = describe_system(check_pb2.DescribeRequest(documents=documents), MOST)
        assert self.endpoints == {each.id: each for each in found.endpoints}
        assert sorted(map(str, self.participants)) == sorted(map(str, found.participants))


def followed(report, delta):
    made = report_pb2.Report()
    made.CopyFrom(delta.summary)
    for field, gone, added in (
        ("groups", delta.removed_groups, [(each.position, each.group) for each in delta.added_groups]),
        ("findings", delta.removed_findings, [(each.position, each.finding) for each in delta.added_findings]),
    ):
        kept = [each for at, each in enumerate(getattr(report, field)) if at not in set(gone)]
        for at, each in added:
            kept.insert(at, each)
        getattr(made, field).extend(kept)
    return made


def content_of(report):
    """What a report says; findings that differ only in what they are made of have no order."""
    bare = report_pb2.Report()
    bare.CopyFrom(report)
    bare.ClearField("findings")
    return str(bare), sorted(map(str, report.findings))


@given(models, edits, st.sampled_from(["", LARGE]), st.booleans())
def test_a_session_of_documents_equals_a_fresh_check(first, steps, size, with_another):
    beside = {"beside.yaml": (BESIDE % "reliable").encode()} if with_another else {}
    caller = Caller({"model.bpmn": drawn(first, size), **beside})
    caller.is_up_to_date()
    for model, other in steps:
        put = {"model.bpmn": drawn(model, size)}
        if other in {"reliable", "best_effort"}:
            put["beside.yaml"] = (BESIDE % other).encode()
        before = caller.report
        if other == "broken":
            refused = caller.edit({"model.bpmn": b"<bpmn"})
            assert refused.HasField("refusal")
            assert [each.code for each in refused.refusal.documents] == ["CQ001"]
            assert [each.field for each in refused.refusal.problems] == ["documents.put[0].content"]
            assert caller.report is before
            caller.is_up_to_date()
        caller.edit(put, ["beside.yaml"] if other == "gone" else ())
        caller.is_up_to_date()


@given(models)
def test_an_edit_that_nothing_reads_changes_nothing(model):
    caller = Caller({"model.bpmn": drawn(model)})
    answer = caller.edit({"model.bpmn": drawn({**model, "lines": model["lines"] + 7})})
    assert (answer.judged, list(answer.endpoints), list(answer.participants)) == (0, [], [])
    assert answer.HasField("delta") or not (answer.report.findings or answer.report.groups)
    assert [*answer.delta.added_findings, *answer.delta.removed_findings, *answer.delta.added_groups] == []
