"""Library, command and service never disagree: every case file and every example, by all interfaces."""

import asyncio
import json
from pathlib import Path
from typing import Any, cast

import grpc
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import cqos_core as cqos
from cqos.v1 import check_pb2, check_pb2_grpc, report_pb2
from cqos_core import check
from cqos_core.cli import main
from cqos_core.model.problems import InputError
from cqos_core.packs.guarantee import FAULTS, LINK, WORDS
from cqos_core.remote.asked import write_pair
from cqos_core.remote.client import AsyncClient, PairQuestion, PairRefusedError
from cqos_core.remote.messages import pair_value, report_value, system_message, system_value, word_of
from cqos_core.testing import _settings, load_cases
from tests.effort import EXPLORE
from tests.laws.systems import BOTH, systems
from tests.made_up_protocol import pair_system

ROOT = Path(__file__).resolve().parents[2]
EVERY = 1 if EXPLORE else 3
"""One of so many files of cases is asked for, and of each one of so many cases: what travels is the same for every rule."""
MOST_BY_WEB = None if EXPLORE else 1
"""Cases of each kind that each file asks the server for browsers for."""
PACK_OF = {"ros2": "ros2", "dds_full": "dds", "mqtt": "mqtt"}
CASE_FILES = sorted(ROOT.glob("plugins/*/tests/cases/*.yml"))[::EVERY]
DOCUMENTS = sorted(
    path
    for folder in ("examples", "tests/importers/cases", "plugins/ros2/tests/importers", "plugins/*/tests/importers")
    for path in ROOT.glob(f"{folder}/**/*")
    if path.is_file() and path.suffix not in {".py", ".pyc", ".txt", ".md", ".csv", ".toml"}
)[:: 1 if EXPLORE else 2]


def ask_web(service, method, request, response):
    """Call the server for browsers as a page does: binary Connect over HTTP, over a connection that is kept."""
    headers = {"content-type": "application/proto", "connect-protocol-version": "1"}
    service.page.request("POST", f"/cqos.v1.CheckService/{method}", request.SerializeToString(), headers)
    answer = service.page.getresponse()
    assert answer.status == 200
    return response.FromString(answer.read())


def of_case(case):
    """What a case asks, in the form that all ways take."""
    content = case.content
    options = _settings(content.get("options", {}))
    if "system" in content:
        return "document", json.dumps(content["system"], default=str).encode(), options
    topic = _settings(content.get("topic", {}))
    if "offered" in content or "requested" in content:
        offered, requested = _settings(content.get("offered", {})), _settings(content.get("requested", {}))
        return "pair", PairQuestion(case.pack, offered, requested, options, topic), options
    role = "publisher" if "publisher" in content else "subscriber"
    offered, requested = (_settings(content.get(each, {})) for each in ("publisher", "subscriber"))
    system = pair_system(case.pack, offered, requested, options, topic)
    system.endpoints = [endpoint for endpoint in system.endpoints if endpoint.role == role]
    return "system", system, options


def ask_web_of_pair(service, pair):
    request = check_pb2.CheckPairRequest(
        protocol=pair.protocol,
        offered=pair.offered,
        requested=pair.requested,
        options=pair.options,
        topic=pair.topic,
    )
    return pair_value(ask_web(service, "CheckPair", request, check_pb2.CheckPairResponse).report)


def ask_web_of_system(service, system):
    model = check_pb2.CheckSystemRequest(system=system_message(system))
    return report_value(ask_web(service, "CheckSystem", model, check_pb2.CheckSystemResponse).report)


@pytest.mark.explored
@pytest.mark.parametrize("file", CASE_FILES, ids=lambda path: path.stem)
def test_every_case_gives_the_same_report_by_library_and_service(file, service, client):
    """By gRPC, and some by the server for browsers too; `dev.py explore` asks for every case at both."""
    pack = PACK_OF[file.parents[2].name]
    pairs = []
    systems = []
    for case in load_cases(file, pack)[::EVERY]:
        kind, asked, options = of_case(case)
        if kind == "pair":
            pairs.append((asked, cqos.check_pair(*asked)))
        elif kind == "system":
            judged = check(asked)
            assert client.check_system(asked) == judged, case
            systems.append((asked, judged))
        else:
            given: dict[str, Any] = {"importer": "yaml", "protocol": pack, "options": {pack: options}}
            read = cqos.check(asked, **given)
            assert client.check(asked, **given) == read, case
    # Their stream, in one go, and one of them by itself.
    assert list(client.check_pairs([pair for pair, _ in pairs])) == [expected for _, expected in pairs]
    for pair, expected in pairs[:1]:
        assert client.check_pair(*pair) == expected
    for pair, expected in pairs[:MOST_BY_WEB]:
        assert ask_web_of_pair(service, pair) == expected
    for system, judged in systems[:MOST_BY_WEB]:
        assert ask_web_of_system(service, system) == judged


def outcome(check, *arguments):
    """A report, or the problems of an input that cannot be read."""
    try:
        return check(*arguments)
    except InputError as error:
        return error.problems


@pytest.mark.explored
@pytest.mark.parametrize("path", DOCUMENTS, ids=lambda path: path.name)
def test_every_document_gives_the_same_report_or_the_same_problems(path, client, monkeypatch):
    monkeypatch.chdir(ROOT)
    data = path.read_bytes()
    assert outcome(client.check, data) == outcome(cqos.check, data)


def test_documents_and_problems_keep_the_names_of_their_files(client, monkeypatch, tmp_path):
    monkeypatch.chdir(tmp_path)
    Path("good.yaml").write_bytes((ROOT / "examples" / "smart_agriculture.yaml").read_bytes())
    Path("bad.yaml").write_text("cqos: 1\nparticipants: {a: {publishes: [x]}}\n", encoding="utf-8")
    for paths in (["good.yaml"], ["good.yaml", "bad.yaml"], ["bad.yaml"]):
        assert outcome(client.check, *paths) == outcome(cqos.check, *paths)
    assert client.check("good.yaml").sources == ("good.yaml",)


@pytest.mark.parametrize("words", BOTH[1:], ids=lambda words: words.protocol)
@settings(max_examples=10)
@given(data=st.data())
def test_any_system_gives_the_same_report(words, data, client):
    system = data.draw(systems(words))
    assert client.check_system(system) == check(system)


def test_explain_and_convert_are_those_of_the_library(client, monkeypatch):
    monkeypatch.chdir(ROOT)
    file = "examples/smart_agriculture_incompatible.bpmn"
    report = cqos.check(file)
    group = next(group for group in report.groups if group.verdict == "incompatible")
    ends: dict[str, Any] = {"publisher": group.publishers[0], "subscriber": group.subscribers[0]}
    assert client.explain(file, **ends) == cqos.explain(file, **ends)
    assert client.explain(cqos.read(file), **ends) == cqos.explain(file, **ends)
    written = client.convert(file, to="yaml")
    assert client.check(written.text.encode()).verdict == report.verdict
    assert written.expressed == report.endpoints
    assert client.convert(cqos.read(file), to="yaml").text == written.text


def test_a_comparison_is_that_of_the_library(client, monkeypatch):
    monkeypatch.chdir(ROOT)
    files = ("examples/smart_agriculture.yaml", "examples/smart_agriculture_incompatible.bpmn")
    expected = cqos.diff(*files)
    assert expected.different
    assert client.diff(*files) == expected
    a, b = map(cqos.read, files)
    assert client.diff(a, files[1], ignored=["*rain*"]) == cqos.diff(a, b, ignored=["*rain*"])
    b.endpoints.pop()
    assert client.diff(a, b) == cqos.diff(a, b)
    assert client.diff(a, b).missing
    with pytest.raises(InputError):
        client.diff(a, b"cqos: 1\nparticipants: {a: {publishes: [x]}}\n")


def test_words_of_guarantees_and_faults_have_numbers():
    words = {word_of(value) for value in report_pb2.GuaranteeWord.DESCRIPTOR.values if value.number}
    assert words == set(WORDS)
    faults = {word_of(value) for value in report_pb2.Fault.DESCRIPTOR.values if value.number}
    assert faults == {LINK, *FAULTS}
    message = write_pair(report_pb2.PairReport(), cqos.check_pair("ros2", requested={"reliability": "reliable"}))
    for guarantee in message.guarantees:
        assert report_pb2.GuaranteeWord.Name(guarantee.word_value) == f"GUARANTEE_WORD_{guarantee.word.upper()}"
        assert len(guarantee.survives_values) == len(guarantee.survives)
        assert all(guarantee.survives_values)
        assert all(cell.fault_value for cell in guarantee.cells)


def test_lists_travel_as_lists_too(service):
    names = ["a b", "c"]
    with grpc.insecure_channel(service.grpc) as channel:
        checks = check_pb2_grpc.CheckServiceStub(channel)
        request = check_pb2.CheckPairRequest(
            protocol="dds", offered={"partition": "x"}, requested_lists={"partition": check_pb2.NameList(items=names)}
        )
        report = checks.CheckPair(request, timeout=20).report
    (partition,) = [each for each in report.policies if each.policy.startswith("partition")]
    assert (partition.requested.value, list(partition.requested.items)) == ('["a b", c]', names)
    message = system_message(pair_system("dds", {"partition": '["a b", c]'}, {}, {}, {}))
    endpoint = message.endpoints[0]
    del endpoint.settings["partition"]
    endpoint.settings_stated.add(name="partition", items=names)
    assert system_value(message).endpoints[0].settings["partition"].text == '["a b", c]'


def test_a_pair_that_cannot_be_judged_does_not_end_the_stream(client):
    answers = list(
        client.check_pairs([PairQuestion("ros2"), PairQuestion("telegraph"), PairQuestion("ros2", {"depth": "x"})])
    )
    assert [type(answer).__name__ for answer in answers] == ["PairReport", "PairRefusedError", "PairReport"]
    assert isinstance(answers[1], PairRefusedError)
    assert answers[1].fields[0].field == "pair.protocol"


@pytest.mark.parametrize("form", ["full", "concise", "json", "sarif", "junit", "github"])
@pytest.mark.parametrize(
    "paths",
    [
        ["examples/smart_agriculture_incompatible.bpmn"],
        ["examples/mobile_robot.yaml", "--option", "ros2.rmw=zenoh", "--show", "notes"],
        ["examples/smart_agriculture.yaml", "examples/smart_agriculture.bpmn", "--each"],
        ["examples/robot_workspace"],
    ],
    ids=["one file", "with options", "each", "workspace"],
)
def test_the_command_prints_the_same_with_a_server(form, paths, service, capsysbinary, monkeypatch):
    monkeypatch.chdir(ROOT)
    arguments = ["check", *paths, "--no-config", "--format", form]
    here = main(arguments), capsysbinary.readouterr().out
    there = main([*arguments, "--server", service.grpc]), capsysbinary.readouterr().out
    assert there == here


def test_a_bridge_to_a_missing_participant_is_a_finding_with_a_server_too(service, capsysbinary, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    route = "{from: {participant: nobody, topic: x}, to: {participant: a, topic: y}}"
    text = f"cqos: 1\nprotocol: ros2\nparticipants: {{a: {{}}}}\nbridges: {{b: {{routes: [{route}]}}}}\n"
    Path("bridge.yaml").write_text(text, encoding="utf-8")
    arguments = ["check", "bridge.yaml", "--no-config"]
    here = main(arguments), capsysbinary.readouterr().out
    assert b"CQ501" in here[1]
    assert (main([*arguments, "--server", service.grpc]), capsysbinary.readouterr().out) == here


def test_the_command_says_what_is_wrong_with_a_server(capsys, monkeypatch):
    monkeypatch.chdir(ROOT)
    assert main(["check", "examples/smart_agriculture.yaml", "--no-config", "--server", "127.0.0.1:1"]) == 2
    assert "the service answers UNAVAILABLE" in capsys.readouterr().err
    pack = "examples/opcua/opcua_pack.yaml"
    arguments = ["check", "examples/opcua/press_line.yaml", "--no-config", "--pack", pack, "--server", "127.0.0.1:1"]
    assert main(arguments) == 2
    assert "a service has rule packs of its own" in capsys.readouterr().err


def faulty():
    """Two questions; the second one has an invalid setting."""
    yield PairQuestion("ros2")
    yield PairQuestion("ros2", {"depth": cast("Any", 5.5)})


def failing():
    """A question, then an exception of the generator itself."""
    yield PairQuestion("ros2")
    raise LookupError("no more of them")


@pytest.mark.parametrize(("questions", "fault"), [(faulty, "5.5 is no setting"), (failing, "no more of them")])
def test_faults_of_the_questions_are_raised_unchanged(questions, fault, client, service):
    answers = client.check_pairs(questions())
    assert next(answers).verdict == "compatible"
    with pytest.raises((TypeError, LookupError), match=fault):
        next(answers)

    async def ask():
        answered = []
        async with AsyncClient(service.grpc) as waiting:
            try:
                async for answer in waiting.check_pairs(questions()):
                    answered.append(answer)  # noqa: PERF401 - what came before the fault counts
            finally:
                assert [each.verdict for each in answered] == ["compatible"]

    with pytest.raises((TypeError, LookupError), match=fault):
        asyncio.run(ask())
