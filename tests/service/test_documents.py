"""Files that include others, and several that are one system: checked where their disk is not, and never from a disk there."""

import asyncio
import subprocess
import sys
from pathlib import Path
from typing import Any

import grpc
import pytest

import cqos_core as cqos
from cqos.v1 import check_pb2, check_pb2_grpc
from cqos_core.cli import main
from cqos_core.files.source_files import SentFiles
from cqos_core.model.problems import InputError
from cqos_core.model.source import Source
from cqos_core.remote.client import AsyncClient
from tests.service.service_process import Service, serving
from tests.service.test_contract import DOCUMENTS, ROOT, outcome
from tests.service.test_robustness import refused, violations

ROBOT = """\
cqos: 1
system: robot
protocol: ros2
include: [shared/common.yaml, qos.xml]
participants:
  driver: {publishes: {scan: {profile: fast, reliability: best_effort}}}
"""
COMMON = """\
cqos: 1
include: ../more.json
profiles:
  fast: {depth: 5,
    durability: volatile}
participants:
  planner: {protocol: ros2, subscribes: {scan: {profile: fast, reliability: reliable}}}
"""
MORE = '{"cqos": 1, "participants": {"mapper": {"protocol": "ros2", "subscribes": {"scan": {"durability": "transient_local"}}}}}'
QOS = """\
<dds><qos_library name="L"><qos_profile name="P"><datawriter_qos><reliability>
<kind>RELIABLE_RELIABILITY_QOS</kind></reliability></datawriter_qos></qos_profile></qos_library></dds>
"""
FASTDDS = """\
<dds><profiles><data_writer profile_name="/scan"><qos>
<deadline><period><sec>2</sec><nanosec>0</nanosec></period></deadline></qos></data_writer></profiles></dds>
"""
FILES = {
    "robot.yaml": ROBOT,
    "shared/common.yaml": COMMON,
    "more.json": MORE,
    "qos.xml": QOS,
    "fastdds.xml": FASTDDS,
    "plain.yaml": "cqos: 1\nprotocol: ros2\nparticipants:\n  a: {publishes: {scan: }}\n  b: {subscribes: {scan: {deadline: 1s}}}\n",
    "missing.yaml": "cqos: 1\nsystem: [x]\ninclude: [nowhere.yaml, shared/common.yaml]\n",
    "circle.yaml": "cqos: 1\ninclude: [circle.yaml]\n",
    "broken.yaml": "cqos: 1\ninclude: [bad.yaml]\n",
    "bad.yaml": "cqos: 1\nparticipants: {a: {publishes: [x]}}\n",
    "broker.conf": "listener 1883\nmax_qos 1\nacl_file access.txt\n",
    "unguarded.conf": "listener 1883\nacl_file nowhere.txt\n",
    "access.txt": "user alice\ntopic read site/#\n",
    "site.yaml": "cqos: 1\nprotocol: mqtt\nparticipants:\n"
    "  a: {client: {broker: broker, username: alice}, publishes: {site/x: {qos: 2}}}\n"
    "  b: {client: {broker: broker, username: alice}, subscribes: {site/x: {qos: 2}}}\n",
}
GIVEN = [
    ["robot.yaml"],
    ["./shared/../robot.yaml"],
    ["robot.yaml", "shared/common.yaml"],
    ["fastdds.xml", "plain.yaml"],
    ["plain.yaml", "robot.yaml", "fastdds.xml"],
    ["missing.yaml"],
    ["circle.yaml"],
    ["broken.yaml"],
    ["robot.yaml", "missing.yaml"],
    ["robot.yaml", "broken.yaml", "bad.yaml"],
    ["broker.conf", "site.yaml"],
]


@pytest.fixture
def files(tmp_path, monkeypatch):
    """A folder with all of them, which is where the test is."""
    for name, text in FILES.items():
        file = tmp_path / name
        file.parent.mkdir(exist_ok=True)
        file.write_text(text, encoding="utf-8")
    monkeypatch.chdir(tmp_path)
    return tmp_path


@pytest.mark.parametrize("paths", GIVEN, ids=" ".join)
def test_files_that_include_others_give_the_same_report_or_the_same_problems(paths, client, files):
    here = outcome(cqos.check, *paths)
    assert outcome(client.check, *paths) == here
    absolute = [str(files / path) for path in paths]
    assert outcome(client.check, *absolute) == outcome(cqos.check, *absolute)


@pytest.mark.parametrize(
    "given",
    [
        ["nowhere.yaml", "bad.yaml", "nor here.yaml"],
        ["bad.yaml", b"?", "nowhere.yaml", b"cqos: 1\nx: 1\n"],
        ["nowhere.yaml", "missing.yaml"],
        ["robot.yaml", "nowhere.yaml"],
        [],
    ],
    ids=str,
)
def test_all_problems_of_all_files_are_raised_at_once_if_some_are_missing(given, client, service, files):
    with pytest.raises(InputError) as raised:
        cqos.check(*given)
    here = raised.value.problems

    async def ask(method, **options):
        async with AsyncClient(service.grpc) as waiting:
            await getattr(waiting, method)(*given, **options)

    for method, options in (
        ("check", {}),
        ("explain", {"publisher": "a", "subscriber": "b"}),
        ("convert", {"to": "yaml"}),
    ):
        with pytest.raises(InputError) as raised:
            getattr(client, method)(*given, **options)
        assert raised.value.problems == here
        with pytest.raises(InputError) as raised:
            asyncio.run(ask(method, **options))
        assert raised.value.problems == here


def test_what_was_included_counts_and_is_pointed_at(client, files):
    report = client.check("robot.yaml")
    assert report.sources == ("robot.yaml", "shared/common.yaml", "shared/../more.json", "qos.xml")
    places = {fact.place for finding in report.findings for side in finding.sides for fact in side.facts if fact.place}
    assert ("shared/common.yaml", 5, 17) in {(place.source, place.line, place.column) for place in places}
    guarded = client.check("broker.conf", "site.yaml")
    assert "access.txt" in guarded.sources
    assert guarded == cqos.check("broker.conf", "site.yaml")


def test_a_file_that_a_reader_can_do_without_is_missed_by_both(client, files):
    for check in (cqos.check, client.check):
        (note,) = [each for each in check("unguarded.conf").findings if each.code == "MQTT941"]
        assert "acl_file `nowhere.txt` is not read" in note.message


def test_explain_and_convert_take_what_is_included_too(client, files):
    publisher, subscriber = "driver/publisher/scan", "mapper/subscriber/scan"
    explained = client.explain("robot.yaml", publisher=publisher, subscriber=subscriber)
    assert explained == cqos.explain("robot.yaml", publisher=publisher, subscriber=subscriber)
    assert client.convert("robot.yaml", to="yaml").expressed == 3


def test_the_same_without_waiting(service, files):
    async def ask():
        async with AsyncClient(service.grpc) as client:
            assert await client.check("robot.yaml") == cqos.check("robot.yaml")

    asyncio.run(ask())


@pytest.mark.parametrize("form", ["full", "json", "sarif"])
@pytest.mark.parametrize("paths", GIVEN, ids=" ".join)
def test_the_command_prints_the_same_with_a_server(form, paths, service, files, capsysbinary):
    arguments = ["check", *paths, "--together", "--no-config", "--show", "notes", "--format", form]
    here = main(arguments), capsysbinary.readouterr()
    assert (main([*arguments, "--server", service.grpc]), capsysbinary.readouterr()) == here


# --- as others send them ---


def document(name, text=""):
    return check_pb2.Document(name=name, content=(text or FILES[name]).encode())


@pytest.fixture
def checks(service):
    with grpc.insecure_channel(service.grpc) as channel:
        yield check_pb2_grpc.CheckServiceStub(channel)


def test_documents_include_each_other(checks):
    both = [document("a.yaml", "cqos: 1\ninclude: b.yaml\n"), document("b.yaml", FILES["plain.yaml"])]
    included = check_pb2.CheckDocumentRequest(documents=both[:1], included=both[1:])
    assert checks.CheckDocument(included).report.endpoints == 2
    # One of them named twice is there once, as it is on the command line.
    assert checks.CheckDocument(check_pb2.CheckDocumentRequest(documents=both)).report.endpoints == 2
    unused = check_pb2.CheckDocumentRequest(documents=both[1:], included=[document("c.yaml", "[")])
    assert checks.CheckDocument(unused).report.endpoints == 2


def test_a_document_without_a_name_cannot_include_or_be_included(checks):
    more = document("more.yaml", "cqos: 1\n")
    request = check_pb2.CheckDocumentRequest(documents=[document("", "cqos: 1\ninclude: more.yaml\n")], included=[more])
    error = refused(checks.CheckDocument, request)
    assert violations(error) == {
        "documents[0].content": "<bytes>:2:10: cannot include `more.yaml`: this input was given as bytes, so "
        "there is no folder to look in"
    }
    request = check_pb2.CheckDocumentRequest(documents=[more], included=[document("", "cqos: 1\n")])
    assert violations(refused(checks.CheckDocument, request)) == {
        "included[0].name": "a name is needed, by which it is included"
    }


@pytest.mark.parametrize(
    ("name", "include", "sent"),
    [
        ("a.yaml", "b.yaml", "b.yaml"),
        ("a.yaml", "./b.yaml", "b.yaml"),
        ("x/a.yaml", "../b.yaml", "b.yaml"),
        ("x/a.yaml", "../y/b.yaml", "x/../y/b.yaml"),
        ("/x/a.yaml", "b.yaml", "/x/b.yaml"),
        ("/x/a.yaml", "/y/b.yaml", "/y/b.yaml"),
        ("../a.yaml", "b.yaml", "../b.yaml"),
        ("x\\a.yaml", "..\\b.yaml", "b.yaml"),
        ("x\\a.yaml", "y/b.yaml", "x\\y\\b.yaml"),
        ("C:\\x\\a.yaml", "D:\\y\\b.yaml", "D:\\y\\b.yaml"),
        ("C:\\x\\a.yaml", "../b.yaml", "C:\\b.yaml"),
    ],
)
def test_an_included_file_is_found_by_its_path_as_seen_from_the_one_that_includes_it(name, include, sent):
    wanted = Source(sent, b"")
    opener = SentFiles([Source(name, b""), Source("other/b.yaml", b""), wanted])
    assert opener(include, name) is wanted
    with pytest.raises(InputError, match="no file of this name was sent along"):
        SentFiles([Source(name, b"")])(include, name)


SECRET = "cqos: 1\nsystem: very_secret\nprotocol: ros2\nparticipants: {secret_node: {publishes: {secret: }}}\n"  # noqa: S105


@pytest.fixture(scope="module")
def beside_secrets(tmp_path_factory):
    """A service that runs in a folder whose files it must not read."""
    folder = tmp_path_factory.mktemp("secrets")
    (folder / "secret.yaml").write_text(SECRET, encoding="utf-8")
    (folder / "link.yaml").symlink_to(folder / "secret.yaml")
    (folder / "secret.dtd").write_text('<!ENTITY x "very_secret">', encoding="utf-8")
    (folder / "access.txt").write_text("topic read very_secret\n", encoding="utf-8")
    with serving(folder=folder) as service:
        yield folder, service
    assert isinstance(service, Service)


DEFINITIONS = '<definitions xmlns="http://www.omg.org/spec/BPMN/20100524/MODEL"'


INVITATIONS = {
    "beside it": ("a.yaml", "cqos: 1\ninclude: secret.yaml\n"),
    "a link": ("a.yaml", "cqos: 1\ninclude: link.yaml\n"),
    "a way round": ("a.yaml", "cqos: 1\ninclude: ./x/../secret.yaml\n"),
    "an absolute path": ("a.yaml", "cqos: 1\ninclude: {folder}/secret.yaml\n"),
    "an address": ("a.yaml", "cqos: 1\ninclude: file://{folder}/secret.yaml\n"),
    "a name that is in its folder": ("{folder}/a.yaml", "cqos: 1\ninclude: secret.yaml\n"),
    "a link from below": ("{folder}/x/a.yaml", "cqos: 1\ninclude: ../link.yaml\n"),
    "its own name": ("secret.yaml", "cqos: 1\ninclude: [./secret.yaml, secret.yaml]\n"),
    "an acl_file": ("{folder}/b.conf", "acl_file access.txt\nlistener 1883\n"),
    "an absolute acl_file": ("b.conf", "acl_file {folder}/access.txt\nlistener 1883\n"),
    "an include_dir": ("b.conf", "include_dir {folder}\nlistener 1883\n"),
    "an entity": (
        "a.bpmn",
        '<!DOCTYPE d [<!ENTITY x SYSTEM "file://{folder}/secret.yaml">]>' + DEFINITIONS + ">&x;</definitions>",
    ),
    "a document type": ("{folder}/a.bpmn", '<!DOCTYPE d SYSTEM "secret.dtd">' + DEFINITIONS + ' name="&x;"/>'),
    "XInclude": (
        "a.bpmn",
        DEFINITIONS + ' xmlns:xi="http://www.w3.org/2001/XInclude">'
        '<xi:include href="{folder}/secret.yaml" parse="text"/></definitions>',
    ),
    "a parameter entity": (
        "q.xml",
        '<!DOCTYPE d [<!ENTITY % x SYSTEM "file://{folder}/secret.dtd">%x;]><dds><qos_library name="&x;"/></dds>',
    ),
}


@pytest.mark.parametrize(("name", "text"), INVITATIONS.values(), ids=INVITATIONS)
def test_nothing_is_read_from_the_disk_of_the_service(beside_secrets, name, text):
    folder, service = beside_secrets
    sent = document(name.replace("{folder}", str(folder)), text.replace("{folder}", str(folder)))
    with grpc.insecure_channel(service.grpc) as channel:
        checks: Any = check_pb2_grpc.CheckServiceStub(channel)
        for request in (
            check_pb2.CheckDocumentRequest(documents=[sent]),
            check_pb2.CheckDocumentRequest(
                documents=[document("o.yaml", f"cqos: 1\ninclude: {sent.name}\n")], included=[sent]
            ),
        ):
            try:
                answered = str(checks.CheckDocument(request, timeout=20))
            except grpc.RpcError as error:
                assert error.code() == grpc.StatusCode.INVALID_ARGUMENT  # noqa: PT017 - some can be read
                answered = f"{error.details()} {error.trailing_metadata()}"
            assert "very_secret" not in answered
            assert "secret_node" not in answered
    assert "very_secret" not in service.log


WATCHED = """\
import sys
from pathlib import Path
from cqos.v1 import check_pb2
from cqos_core.service.call_handlers import answer
from cqos_core.remote.refusal import Refused

def ask(path):
    data = Path(path).read_bytes()
    request = check_pb2.CheckDocumentRequest(documents=[check_pb2.Document(name=path, content=data)])
    bare = check_pb2.CheckDocumentRequest(documents=[check_pb2.Document(content=data)])
    return [each.SerializeToString() for each in (request, bare)]

requests = [request for path in sys.argv[1:] for request in ask(path)]
opened, watching = [], False
sys.addaudithook(lambda event, given: opened.append((event, given)) if watching and event in WATCHED else None)
WATCHED = {"open", "os.listdir", "os.scandir", "socket.connect", "socket.getaddrinfo", "subprocess.Popen", "sqlite3.connect"}
for watching in (False, True):
    for request in requests if watching else requests[::2]:  # what is imported once is opened once
        try:
            answer("/cqos.v1.CheckService/CheckDocument", request, 20_000)
        except Refused:
            pass
assert not opened, opened[:5]
print(len(requests))
"""


def test_reading_documents_of_every_format_opens_nothing_at_all():
    """Neither a file nor a connection, whatever stands in them; their own paths, which are there, are no invitation."""
    command = [sys.executable, "-c", WATCHED, *map(str, DOCUMENTS)]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr[-2_000:]
    assert int(done.stdout) == 2 * len(DOCUMENTS) > 100


def test_what_is_sent_is_bounded_in_all(service, checks):
    """A megabyte here and a megabyte there."""
    large = document("b.yaml", "#" * 1_100_000)
    request = check_pb2.CheckDocumentRequest(
        documents=[document("a.yaml", "cqos: 1\n# " + " " * 1_000_000)], included=[large]
    )
    error = refused(checks.CheckDocument, request)
    assert error.code() == grpc.StatusCode.RESOURCE_EXHAUSTED
    assert service.process.poll() is None


def test_a_path_that_is_a_folder_there_is_no_document_here(files, client):
    Path("folder").mkdir()
    Path("folder.yaml").write_text("cqos: 1\ninclude: folder\n", encoding="utf-8")
    assert outcome(client.check, "folder.yaml") == outcome(cqos.check, "folder.yaml")
