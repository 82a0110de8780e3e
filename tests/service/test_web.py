"""The server for browsers, called as browsers do: Connect in binary and JSON, gRPC-Web, from a page of another origin."""

import base64
import contextlib
import http.client
import json
import struct
import time
from statistics import median

import pytest
from connectrpc.client import ConnectClientSync
from connectrpc.compat import google_protobuf_binary_codec
from connectrpc.errors import ConnectError
from connectrpc.method import IdempotencyLevel, MethodInfo
from connectrpc.method import StreamType as Streams
from google.rpc import error_details_pb2, status_pb2

import cqos_core as cqos
from cqos.v1 import catalogue_pb2, check_pb2, report_pb2
from cqos_core.remote.messages import pair_value
from tests.service.conftest import PAGE

PAIR = "/cqos.v1.CheckService/CheckPair"


@pytest.fixture
def web(service):
    return service


def call(service, method, path, body=b"", **headers):
    """One HTTP exchange: status, headers, body."""
    connection = http.client.HTTPConnection(service.addresses["web"], timeout=20)
    try:
        connection.request(method, path, body, {name.replace("_", "-"): value for name, value in headers.items()})
        answer = connection.getresponse()
        return answer.status, {name.lower(): value for name, value in answer.getheaders()}, answer.read()
    finally:
        connection.close()


def frame(data, flags=0):
    return struct.pack(">BI", flags, len(data)) + data


def frames(data):
    found = []
    while data:
        flags, size = struct.unpack(">BI", data[:5])
        found.append((flags, data[5 : 5 + size]))
        data = data[5 + size :]
    return found


REQUEST = check_pb2.CheckPairRequest(revision=7, protocol="ros2", offered={"reliability": "best_effort"})
EXPECTED = cqos.check_pair("ros2", {"reliability": "best_effort"})


def test_a_connection_that_is_kept_is_faster_than_a_new_one_for_each_call(web):
    """And not slower, as where what is sent in two parts waits for the receipt of the first: 40 ms for each answer."""
    kept = http.client.HTTPConnection(web.addresses["web"], timeout=20)
    body = REQUEST.SerializeToString()
    took: dict[bool, list[float]] = {True: [], False: []}
    for _ in range(31):
        for keep, seconds in took.items():
            connection = kept if keep else http.client.HTTPConnection(web.addresses["web"], timeout=20)
            began = time.monotonic()
            connection.request("POST", PAIR, body, {"content-type": "application/proto"})
            assert connection.getresponse().read()
            seconds.append(time.monotonic() - began)
            if not keep:
                connection.close()
    kept.close()
    assert median(took[True]) < 2 * median(took[False])


def test_connect_binary(web):
    status, headers, body = call(
        web, "POST", PAIR, REQUEST.SerializeToString(), content_type="application/proto", x_request_id="mine"
    )
    assert (status, headers["content-type"], headers["x-request-id"]) == (200, "application/proto", "mine")
    answer = check_pb2.CheckPairResponse.FromString(body)
    assert (answer.revision, pair_value(answer.report)) == (7, EXPECTED)


def test_connect_json(web):
    body = json.dumps({"revision": "7", "protocol": "ros2", "offered": {"reliability": "best_effort"}}).encode()
    status, headers, body = call(web, "POST", PAIR, body, content_type="application/json")
    assert (status, headers["content-type"]) == (200, "application/json")
    answer = json.loads(body)
    assert (answer["revision"], answer["report"]["verdict"]) == ("7", "VERDICT_INCOMPATIBLE")
    assert answer["report"]["findings"][0]["code"] == "ROS101"


def test_connect_get_of_what_has_no_side_effects(web):
    message = base64.urlsafe_b64encode(REQUEST.SerializeToString()).decode().rstrip("=")
    status, _, body = call(web, "GET", f"{PAIR}?connect=v1&encoding=proto&base64=1&message={message}")
    assert status == 200
    assert pair_value(check_pb2.CheckPairResponse.FromString(body).report) == EXPECTED


def test_grpc_web(web):
    status, headers, body = call(
        web, "POST", PAIR, frame(REQUEST.SerializeToString()), content_type="application/grpc-web+proto", x_grpc_web="1"
    )
    assert (status, headers["content-type"]) == (200, "application/grpc-web+proto")
    (kind, message), (last, trailers) = frames(body)
    assert (kind, last) == (0, 0x80)
    assert pair_value(check_pb2.CheckPairResponse.FromString(message).report) == EXPECTED
    assert b"grpc-status: 0" in trailers.lower()


def test_grpc_web_carries_what_is_wrong(web):
    status, _, body = call(
        web, "POST", PAIR, frame(check_pb2.CheckPairRequest().SerializeToString()), content_type="application/grpc-web"
    )
    (_, trailers) = frames(body)[-1]
    answered = dict(line.split(": ", 1) for line in trailers.decode().lower().splitlines())
    assert (status, answered["grpc-status"]) == (200, "3")
    raw = dict(line.split(": ", 1) for line in trailers.decode().splitlines())
    (details,) = [value for name, value in raw.items() if name.lower() == "grpc-status-details-bin"]
    padded = details + "=" * (-len(details) % 4)
    bad = error_details_pb2.BadRequest()
    (detail,) = status_pb2.Status.FromString(base64.b64decode(padded)).details
    assert detail.Unpack(bad)
    assert [each.field for each in bad.field_violations] == ["protocol"]


@pytest.mark.parametrize(
    ("kind", "body", "status", "code"),
    [
        ("application/proto", b"\x0f\xff", 400, "invalid_argument"),
        ("application/proto", b"\x12\x04\xff\xfe\xfd\xfc", 400, "invalid_argument"),
        ("application/json", b"{", 400, "invalid_argument"),
        ("application/json", b"[" * 1_000, 400, "invalid_argument"),
        ("application/json", b'{"offered": {"a": ' + b"[" * 100_000, 400, "invalid_argument"),
        ("application/json", b"", 400, "invalid_argument"),
        ("application/json", b"[]", 400, "invalid_argument"),
        ("application/json", b"null", 400, "invalid_argument"),
        ("application/json", b'{"protocol": 7}', 400, "invalid_argument"),
        ("application/json", b'{"protocol": "\xff"}', 400, "invalid_argument"),
        ("application/proto", b" " * 2_000_001, 429, "resource_exhausted"),
    ],
    ids=[
        *("none", "not utf-8", "half of json", "nesting", "deep nesting", "nothing", "a list", "null", "wrong type"),
        *("json not utf-8", "oversized"),
    ],
)
def test_hostile_bytes_are_refused(web, kind, body, status, code):
    found, _, answer = call(web, "POST", PAIR, body, content_type=kind)
    assert (found, json.loads(answer)["code"]) == (status, code)
    assert call(web, "GET", "/healthz")[::2] == (200, b"serving\n")


@pytest.mark.parametrize(
    ("method", "path", "kind", "status", "expected"),
    [
        ("POST", PAIR, "", 415, "a content-type is needed: it is one of application/json, application/proto, "),
        ("POST", PAIR, "application/x-www-form-urlencoded", 415, "`application/x-www-form-urlencoded` is not spoken"),
        ("POST", PAIR, "application/grpc", 415, "gRPC itself has another address (--listen)"),
        ("POST", PAIR, "application/grpc-web-text", 415, "`application/grpc-web-text` is not spoken here"),
        (
            "POST",
            "/cqos.v1.CheckService/CheckPairs",
            "application/proto",
            404,
            "takes a stream of requests, which gRPC",
        ),
        (
            "POST",
            "/CheckPair",
            "application/proto",
            404,
            "there is no call /CheckPair; there is for instance /cqos.v1.",
        ),
        ("PUT", PAIR, "application/proto", 405, "PUT is not taken: POST is, and GET"),
        ("GET", PAIR, "", 415, "a GET states `encoding=json` or `encoding=proto`, and its `message`"),
        ("GET", f"{PAIR}?encoding=json", "", 400, "'message' parameter is required"),
    ],
)
def test_what_is_no_call_at_all_hears_what_would_be_one(web, method, path, kind, status, expected):
    lines = len(web.lines)
    found, headers, body = call(web, method, path, b"x", **({"content_type": kind} if kind else {}))
    assert (found, headers["content-type"]) == (status, "application/json")
    assert expected in json.loads(body)["message"]
    assert "traceback" not in json.dumps(web.lines[lines:])


def test_what_is_wrong_with_a_body_is_in_the_log_too(web):
    """With the id that the caller gave; nothing of what was sent."""
    call(web, "POST", PAIR, b'{"secret": 1}', content_type="application/json", x_request_id="malformed-1")
    line = web.wait_for(lambda line: line.get("request_id") == "malformed-1", 5)
    assert (line["code"], line["method"], line["bytes_in"]) == ("INVALID_ARGUMENT", PAIR, 13)
    assert "secret" not in json.dumps(line)


def test_a_forwarded_address_in_a_header_is_ignored(web):
    """The service distinguishes callers by address, so a caller must not choose one."""
    given = {"x_forwarded_for": "192.0.2.7", "x_request_id": "forwarded-1"}
    call(web, "POST", PAIR, REQUEST.SerializeToString(), content_type="application/proto", **given)
    assert "192.0.2.7" not in str(web.wait_for(lambda line: line.get("request_id") == "forwarded-1", 5)["peer"])


def test_other_ways_in_are_closed(web):
    assert call(web, "POST", "/cqos.v1.CheckService/Nothing", content_type="application/proto")[0] == 404
    assert call(web, "POST", "/cqos.v1.CheckService/CheckPairs", content_type="application/proto")[0] == 404
    assert call(web, "POST", PAIR, b"x", content_type="text/html")[0] == 415
    assert call(web, "GET", "/../../etc/passwd")[0] == 404


def test_a_page_of_a_known_origin_may_call_and_no_other(web):
    headers = "content-type,x-grpc-web,traceparent"
    asked = {"access_control_request_method": "POST", "access_control_request_headers": headers}
    status, headers, _ = call(web, "OPTIONS", PAIR, origin=PAGE, **asked)
    assert (status, headers["access-control-allow-origin"]) == (200, PAGE)
    _, headers, _ = call(web, "POST", PAIR, REQUEST.SerializeToString(), content_type="application/proto", origin=PAGE)
    assert headers["access-control-allow-origin"] == PAGE
    assert "grpc-status" in headers["access-control-expose-headers"].lower()
    status, headers, _ = call(web, "OPTIONS", PAIR, origin="https://elsewhere.example", **asked)
    assert status == 400
    assert "access-control-allow-origin" not in headers


def info(service, name, request, response):
    return MethodInfo(
        name=name,
        service_name=f"cqos.v1.{service}",
        input=request,
        output=response,
        idempotency_level=IdempotencyLevel.NO_SIDE_EFFECTS,
        stream_type=Streams.UNARY,
    )


def test_the_client_of_connectrpc_gets_the_same(web):
    pack = info("CatalogueService", "GetPack", catalogue_pb2.GetPackRequest, catalogue_pb2.GetPackResponse)
    pair = info("CheckService", "CheckPair", check_pb2.CheckPairRequest, check_pb2.CheckPairResponse)
    with ConnectClientSync(web.web, codec=google_protobuf_binary_codec()) as client, web.client() as native:
        answer = client.execute_unary(request=catalogue_pb2.GetPackRequest(id="ros2"), method=pack, headers=None)
        assert answer.pack == native.pack("ros2")
        assert client.execute_unary(request=REQUEST, method=pair, headers=None).report.verdict == (
            report_pb2.VERDICT_INCOMPATIBLE
        )
        with pytest.raises(ConnectError) as raised:
            client.execute_unary(request=check_pb2.CheckPairRequest(), method=pair, headers=None)
        assert raised.value.details[0].type_name == "google.rpc.BadRequest"


def test_json_that_takes_long_to_read_is_read_by_a_worker(start):
    """The serving process could not end the reading, and would answer no other call meanwhile."""
    endpoints = [{"id": "a"}] * 400_000
    body = json.dumps({"system": {"protocol": "ros2", "endpoints": endpoints}}).encode()
    with start("--web", "127.0.0.1:0", "--max-seconds", "0.5", "--heavy-workers", "1") as own:
        status, _, answer = call(
            own, "POST", "/cqos.v1.CheckService/CheckSystem", body, content_type="application/json"
        )
        assert (status, json.loads(answer)["code"]) == (504, "deadline_exceeded")
        assert own.wait_for(lambda line: line["event"] == "worker ended")["why"].startswith("it took more than 0")


def test_json_of_a_size_that_a_worker_reads_gives_the_same(web):
    given = {"a.yaml": "cqos: 1\nprotocol: ros2\nparticipants: {a: {publishes: {t: }}, b: {subscribes: {t: }}}\n# "}
    documents = [
        {"name": name, "content": base64.b64encode((text + "ä" * 4_000).encode()).decode()}
        for name, text in given.items()
    ]
    for _ in range(2):  # and from memory
        body = json.dumps({"revision": "9", "documents": documents}).encode()
        status, _, answer = call(
            web, "POST", "/cqos.v1.CheckService/CheckDocument", body, content_type="application/json"
        )
        answered = json.loads(answer)
        assert (status, answered["revision"], answered["report"]["verdict"]) == (200, "9", "VERDICT_COMPATIBLE")


def test_a_connection_is_kept_while_its_page_is_read(service):
    """A request that crosses the end of an idle connection is lost; uvicorn ends them after 5 seconds."""
    page = http.client.HTTPConnection(service.addresses["web"], timeout=20)
    with contextlib.closing(page):
        page.request("GET", "/healthz")
        assert page.getresponse().read() == b"serving\n"
        page.sock.settimeout(6)
        with pytest.raises(TimeoutError):  # nothing comes, not even its end
            page.sock.recv(1)
        page.sock.settimeout(20)
        page.request("GET", "/healthz")
        assert page.getresponse().read() == b"serving\n"
