"""How the service is run: who is let in, how it ends, how several processes share a port, what its log says."""

import datetime as dt
import ipaddress
import json
import os
import signal
import socket
import subprocess
import sys
import tempfile
import time
import tomllib
import urllib.error
import urllib.request
from pathlib import Path
from typing import Any

import grpc
import pytest
from cryptography import x509
from cryptography.hazmat.primitives import hashes, serialization
from cryptography.hazmat.primitives.asymmetric import ec
from cryptography.x509.oid import NameOID
from grpc_health.v1 import health_pb2, health_pb2_grpc
from grpc_reflection.v1alpha import reflection_pb2, reflection_pb2_grpc

import cqos_core as cqos
from cqos.v1 import check_pb2, check_pb2_grpc, report_pb2
from cqos_core import CqosError
from cqos_core.cli import main
from cqos_core.cli.serve import serve, settings_from
from cqos_core.remote.client import AsyncClient, Client, ServiceError, SessionLostError
from cqos_core.service.settings import Limits, Settings
from tests.service.service_process import Service, serving
from tests.service.test_sessions import endpoint, two

ROOT = Path(__file__).resolve().parents[2]
EXAMPLE = ROOT / "examples" / "smart_agriculture_incompatible.bpmn"
TOKEN = "correct-horse-battery-staple"  # noqa: S105 - of tests
OTHER = "another-token-that-is-known"


# --- who is let in ---


@pytest.mark.parametrize("option", ["--listen", "--web"])
@pytest.mark.parametrize("address", ["0.0.0.0:0", "[::]:0", "192.0.2.1:50051", "example.org:50051"])
def test_an_address_that_others_reach_needs_credentials(option, address, capsys):
    assert main(["serve", "--no-config", option, address]) == 2
    assert "the service would ask for no credentials" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("arguments", "expected"),
    [
        (["--listen", "nonsense"], "write host:port"),
        (["--listen", "127.0.0.1:99999"], "write host:port"),
        (["--tls-cert", "a.pem"], "belong together"),
        (["--tls-client-ca", "a.pem"], "write --tls-cert FILE"),
        (["--tls-cert", "a.pem", "--tls-key", "b.pem"], "cannot read a.pem"),
        (["--origin", "https://example.org"], "--origin is for the server for browsers, which has no address"),
        (["--web", "127.0.0.1:0", "--origin", "https://example.org/"], "--origin `https://example.org/` is none"),
        (["--web", "127.0.0.1:0", "--origin", "example.org"], "`example.org` is none help: write scheme and host"),
        (["--token-file", "missing"], "cannot be read"),
        (["--listen", "192.0.2.1:0", "--allow-anonymous"], "cannot listen on 192.0.2.1:0"),
        (["--workers", "0"], "range"),
    ],
)
def test_unusable_arguments_are_refused_before_anything_is_opened(arguments, expected, capfd, monkeypatch, tmp_path):
    monkeypatch.chdir(tmp_path)
    assert main(["serve", "--no-config", *arguments]) == 2
    assert expected in " ".join(capfd.readouterr().err.split())


def test_an_address_in_use_is_refused(service, capfd):
    assert main(["serve", "--no-config", "--listen", service.grpc]) == 2
    assert f"cannot listen on {service.grpc}: it is in use" in capfd.readouterr().err


@pytest.mark.parametrize(
    ("content", "expected"),
    [
        ("", "holds no token"),
        ("# none\n\n", "holds no token"),
        ("short\n", "shorter than"),
        ("x" * 20 + " y", "behind the token stands something else"),
    ],
)
def test_an_unsafe_token_file_is_refused_without_repeating_it(content, expected, tmp_path, capsys):
    (tmp_path / "tokens").write_text(content, encoding="utf-8")
    assert main(["serve", "--no-config", "--token-file", str(tmp_path / "tokens")]) == 2
    said = capsys.readouterr().err
    assert expected in said
    assert "short\n" not in said
    assert "xxxx" not in said


@pytest.fixture(scope="module")
def guarded(tmp_path_factory):
    file = tmp_path_factory.mktemp("tokens") / "tokens"
    file.write_text(f"# who may come in\n{TOKEN}\n", encoding="utf-8")
    variables = {"CQOS_SERVE_TOKEN": OTHER, "CQOS_SERVE_WEB": "127.0.0.1:0"}
    with serving("--token-file", str(file), environment=variables) as running:
        yield running
    assert TOKEN not in running.log
    assert OTHER not in running.log


@pytest.mark.parametrize("token", [TOKEN, OTHER])
def test_a_known_token_is_let_in(guarded, token):
    with guarded.client(token=token) as client:
        assert client.check_pair("ros2") == cqos.check_pair("ros2")
        with client.session() as session:
            assert session.report().endpoints == 0


@pytest.mark.parametrize("token", [None, "", "wrong-token-wrong-token", TOKEN[:-1], TOKEN + "x", TOKEN.upper()])
def test_no_other_token_is(guarded, token, monkeypatch):
    monkeypatch.delenv("CQOS_TOKEN", raising=False)
    with guarded.client(token=token) as client:
        for call in (
            lambda: client.check_pair("ros2"),
            lambda: list(client.check_pairs([])),
            lambda: client.session().report(),
            client.packs,
        ):
            with pytest.raises(ServiceError) as raised:
                call()
            assert raised.value.code == "UNAUTHENTICATED"
            assert not token or token not in str(raised.value)


def test_tokens_guard_reflection_and_the_server_for_browsers_but_not_health(guarded):
    with grpc.insecure_channel(guarded.grpc) as channel:
        asked = reflection_pb2.ServerReflectionRequest(list_services="")
        stub: Any = reflection_pb2_grpc.ServerReflectionStub(channel)
        with pytest.raises(grpc.RpcError) as raised:
            list(stub.ServerReflectionInfo(iter([asked])))
        assert raised.value.code() == grpc.StatusCode.UNAUTHENTICATED
        given = (("authorization", f"Bearer {TOKEN}"),)
        assert list(stub.ServerReflectionInfo(iter([asked]), metadata=given))
        asking: Any = health_pb2_grpc.HealthStub(channel)
        health = asking.Check(health_pb2.HealthCheckRequest())
        assert health.status == health_pb2.HealthCheckResponse.SERVING
    with pytest.raises(urllib.error.HTTPError) as refused:
        post(guarded, {})
    with refused.value as answer:
        assert answer.code == 401
        assert json.loads(answer.read())["code"] == "unauthenticated"
    assert post(guarded, {"authorization": f"bearer {TOKEN}"})["report"]["verdict"] == "VERDICT_COMPATIBLE"


def post(service, headers):
    call = urllib.request.Request(  # noqa: S310 - of our own service
        f"{service.web}/cqos.v1.CheckService/CheckPair",
        json.dumps({"protocol": "ros2"}).encode(),
        {"content-type": "application/json", **headers},
    )
    with urllib.request.urlopen(call, timeout=30) as answer:  # noqa: S310
        return json.loads(answer.read())


def test_the_command_takes_its_token_from_a_variable(guarded, monkeypatch, capsysbinary):
    arguments = ["check", str(EXAMPLE), "--no-config", "--server", guarded.grpc]
    monkeypatch.delenv("CQOS_TOKEN", raising=False)
    assert main(arguments) == 2
    assert b"UNAUTHENTICATED" in capsysbinary.readouterr().err
    monkeypatch.setenv("CQOS_TOKEN", TOKEN)
    assert main(arguments) == 1


# --- TLS ---


def certificate(folder, name, *, authority=None):
    """Write a key and a certificate for this machine, signed by an authority or by itself."""
    key = ec.generate_private_key(ec.SECP256R1())
    subject = x509.Name([x509.NameAttribute(NameOID.COMMON_NAME, name)])
    signer = (subject, key) if authority is None else authority
    now = dt.datetime.now(dt.timezone.utc)
    made = (
        x509.CertificateBuilder()
        .subject_name(subject)
        .issuer_name(signer[0])
        .public_key(key.public_key())
        .serial_number(x509.random_serial_number())
        .not_valid_before(now - dt.timedelta(hours=1))
        .not_valid_after(now + dt.timedelta(hours=1))
        .add_extension(x509.BasicConstraints(ca=authority is None, path_length=None), critical=True)
        .add_extension(
            x509.SubjectAlternativeName([x509.DNSName("localhost"), x509.IPAddress(ipaddress.ip_address("127.0.0.1"))]),
            critical=False,
        )
        .sign(signer[1], hashes.SHA256())
    )
    (folder / f"{name}.pem").write_bytes(made.public_bytes(serialization.Encoding.PEM))
    (folder / f"{name}.key").write_bytes(
        key.private_bytes(serialization.Encoding.PEM, serialization.PrivateFormat.PKCS8, serialization.NoEncryption())
    )
    return subject, key


@pytest.fixture(scope="module")
def keys(tmp_path_factory):
    folder = tmp_path_factory.mktemp("keys")
    authority = certificate(folder, "authority")
    certificate(folder, "server", authority=authority)
    certificate(folder, "caller", authority=authority)
    certificate(folder, "stranger")
    return folder


@pytest.fixture
def unusable(keys):
    """Files that TLS cannot be spoken with, beside those that it can."""
    key = serialization.load_pem_private_key((keys / "server.key").read_bytes(), None)
    secret = serialization.BestAvailableEncryption(b"secret")
    locked = key.private_bytes(serialization.Encoding.PEM, serialization.PrivateFormat.PKCS8, secret)
    (keys / "locked.key").write_bytes(locked)
    (keys / "text.pem").write_text("no certificate\n", encoding="utf-8")
    return keys


UNUSABLE = [
    (("server.pem", "caller.key", None), "do not belong together: the key is that of another certificate"),
    (("server.pem", "locked.key", None), "and the private key of the first, without a password, both PEM"),
    (("text.pem", "server.key", None), "cannot be used: expected a chain of certificates"),
    (("server.pem", "server.key", "text.pem"), "text.pem cannot be used: expected certificates, PEM"),
    (("server.pem", None, None), "belong together: a certificate and its private key"),
    ((None, "server.key", None), "belong together: a certificate and its private key"),
    (("nowhere.pem", "server.key", None), "nowhere.pem: No such file or directory"),
]


@pytest.mark.parametrize("first", [0, 2, 4])
def test_options_mean_the_same_in_any_order(first):
    given = ["--heavy-workers", "3", "--workers", "4", "--session-workers", "5"]
    for arguments in (given[first:] + given[:first], given[first : first + 2]):
        settings = settings_from(serve.make_context("serve", list(arguments)).params, None)
        asked = dict(zip(arguments[::2], arguments[1::2], strict=True))
        assert settings.processes == int(asked.get("--workers", 1))
        assert settings.limits.workers == int(asked.get("--heavy-workers", 2))
        assert settings.limits.session_workers == int(asked.get("--session-workers", 2))


@pytest.mark.parametrize(("files", "expected"), UNUSABLE)
@pytest.mark.parametrize("more", [(), ("--workers", "2")], ids=["one process", "two"])
def test_unusable_certificates_are_refused_with_the_reason(more, files, expected, unusable, capfd):
    named = zip(("--tls-cert", "--tls-key", "--tls-client-ca"), files, strict=True)
    arguments = [each for flag, name in named if name is not None for each in (flag, str(unusable / name))]
    assert main(["serve", "--no-config", "--listen", "127.0.0.1:0", *more, *arguments]) == 2
    said = capfd.readouterr().err
    assert expected in " ".join(said.split())
    assert "PRIVATE" not in said


@pytest.mark.parametrize(("files", "expected"), UNUSABLE)
@pytest.mark.parametrize("kind", [Client, AsyncClient])
def test_a_client_raises_the_reason_for_unusable_certificates(kind, files, expected, unusable):
    named = zip(("certificate", "key", "authority"), files, strict=True)
    options = {name: str(unusable / file) for name, file in named if file is not None}
    with pytest.raises(CqosError, match=expected):
        kind("127.0.0.1:1", **options)


@pytest.mark.parametrize(
    ("address", "options", "expected"),
    [
        ("", {}, "`` is no address; write host:port"),
        ("https://", {}, "`https://` is no address; write host:port"),
        ("127.0.0.1:1", {"token": "two\nlines"}, "the token has characters other than printable ASCII"),
        ("127.0.0.1:1", {"token": "schlüssel"}, "the token has characters other than printable ASCII"),
    ],
)
def test_a_client_refuses_what_it_cannot_send_before_it_calls(address, options, expected):
    with pytest.raises(CqosError, match=expected) as raised:
        Client(address, **options)
    assert options.get("token", "nothing") not in str(raised.value)


def test_a_token_from_a_file_may_end_with_a_line_end(guarded, monkeypatch):
    monkeypatch.setenv("CQOS_TOKEN", f"{TOKEN}\n")
    with guarded.client() as client:
        assert client.check_pair("ros2").verdict == "compatible"


@pytest.mark.skipif(not hasattr(socket, "SO_REUSEPORT"), reason="no shared ports here")
def test_processes_that_cannot_follow_the_settings_are_not_started_again_and_again(capfd):
    """For instance if an optional package is missing, which only these processes import."""
    script = "import sys; sys.modules['uvicorn'] = None\n"
    with tempfile.TemporaryDirectory() as folder:
        (Path(folder) / "sitecustomize.py").write_text(script, encoding="utf-8")
        arguments = ("serve", "--no-config", "--listen", "127.0.0.1:0", "--web", "127.0.0.1:0", "--workers", "2")
        done = subprocess.run(
            [sys.executable, "-c", "import sys; from cqos_core.cli import main; sys.exit(main())", *arguments],
            env={**os.environ, "PYTHONPATH": folder},
            capture_output=True,
            text=True,
            check=False,
            timeout=60,
        )
    assert done.returncode == 2
    assert "[web]" in done.stderr  # the line that adds the extra
    assert "error: a process cannot follow the settings; it has said why" in done.stderr
    assert "Traceback" not in done.stderr


def test_tls_is_spoken_with_those_who_trust_it_and_plain_text_fails_cleanly(keys, start, monkeypatch):
    monkeypatch.delenv("CQOS_SERVER_CA", raising=False)
    pair = ("--tls-cert", str(keys / "server.pem"), "--tls-key", str(keys / "server.key"))
    trusted = str(keys / "authority.pem")
    with start(*pair) as service:
        with service.client(authority=trusted) as client:
            assert client.check_pair("ros2").verdict == "compatible"
        monkeypatch.setenv("CQOS_SERVER_CA", trusted)
        with Client(f"https://{service.grpc}") as client:
            assert client.check_pair("ros2").verdict == "compatible"
        monkeypatch.delenv("CQOS_SERVER_CA")
        for options in ({}, {"authority": str(keys / "stranger.pem")}):
            with service.client(timeout=3, **options) as client, pytest.raises(ServiceError) as raised:
                client.check_pair("ros2")
            assert raised.value.code in {"UNAVAILABLE", "DEADLINE_EXCEEDED"}
        with service.client(authority=trusted) as client:
            assert client.check_pair("ros2").verdict == "compatible"
    assert "PRIVATE KEY" not in service.log


def test_mutual_tls_lets_in_who_has_a_certificate(keys, start, monkeypatch, capfd):
    trusted = str(keys / "authority.pem")
    with start(
        *("--tls-cert", str(keys / "server.pem"), "--tls-key", str(keys / "server.key")),
        *("--tls-client-ca", trusted),
    ) as service:
        mine = {"certificate": str(keys / "caller.pem"), "key": str(keys / "caller.key")}
        with service.client(authority=trusted, **mine) as client:
            assert client.check_pair("ros2").verdict == "compatible"
        theirs = {"certificate": str(keys / "stranger.pem"), "key": str(keys / "stranger.key")}
        for options in ({}, theirs):
            with service.client(authority=trusted, timeout=3, **options) as client, pytest.raises(ServiceError):
                client.check_pair("ros2")
        asked = ["check", str(ROOT / "examples" / "smart_agriculture.bpmn"), "--server", f"https://{service.grpc}"]
        monkeypatch.setenv("CQOS_SERVER_CA", trusted)
        monkeypatch.setenv("CQOS_CLIENT_CERT", mine["certificate"])
        assert main(asked) == 2
        assert "CQOS_CLIENT_CERT and CQOS_CLIENT_KEY belong together" in capfd.readouterr().err
        monkeypatch.setenv("CQOS_CLIENT_KEY", mine["key"])
        assert main(asked) == 0


def test_a_client_without_tls_ignores_the_certificate_of_the_environment(service, monkeypatch):
    monkeypatch.setenv("CQOS_CLIENT_CERT", "missing.pem")
    with service.client() as client:
        assert client.check_pair("ros2").verdict == "compatible"


# --- how it ends ---


def alive(number):
    try:
        os.kill(number, 0)
    except ProcessLookupError:
        return False
    return True


def test_sigterm_under_load_answers_what_is_under_way_and_leaves_nothing(start):
    """A worker that is stopped keeps calls under way for as long as the test wants."""
    asked = check_pb2.CheckDocumentRequest(documents=[check_pb2.Document(content=EXAMPLE.read_bytes())])
    patient = ("--grace", "120", "--max-seconds", "120")  # as other work of the machine needs
    with (
        start(*patient, "--heavy-workers", "1", installed=True) as service,
        grpc.insecure_channel(service.grpc) as channel,
    ):
        checks = check_pb2_grpc.CheckServiceStub(channel)
        with service.client() as client:
            (worker,) = service.children()
            session = client.session(two())
            session.report()
            os.kill(worker, signal.SIGSTOP)
            under_way = [checks.CheckDocument.future(asked, timeout=150) for _ in range(3)]
            checks.CheckPair(check_pb2.CheckPairRequest(protocol="ros2"), timeout=60)  # behind them on one connection
            children = service.children()
            service.process.send_signal(signal.SIGTERM)
            service.wait_for(lambda line: line["event"] == "draining", 30)

            def edit():
                while True:
                    session.put(endpoint("x"))
                    session.report()
                    time.sleep(0.05)

            with pytest.raises(SessionLostError, match="the service ends"):  # when it takes no more calls
                edit()
            assert not any(each.done() for each in under_way)
            os.kill(worker, signal.SIGCONT)
            assert {each.result().report.verdict for each in under_way} == {report_pb2.VERDICT_INCOMPATIBLE}
        assert service.process.wait(150) == 0
        with pytest.raises(grpc.RpcError) as raised:
            checks.CheckPair(check_pb2.CheckPairRequest(protocol="ros2"), timeout=2)
        assert raised.value.code() in {grpc.StatusCode.UNAVAILABLE, grpc.StatusCode.DEADLINE_EXCEEDED}
    assert [line["event"] for line in service.lines][-1] == "stopped"
    assert len(children) >= 2
    assert not any(map(alive, children))


def test_what_takes_longer_than_the_grace_is_cut_off(start):
    asked = check_pb2.CheckDocumentRequest(documents=[check_pb2.Document(content=EXAMPLE.read_bytes())])
    with start("--grace", "0.2", "--heavy-workers", "1") as service, grpc.insecure_channel(service.grpc) as channel:
        checks = check_pb2_grpc.CheckServiceStub(channel)
        (worker,) = service.children()
        os.kill(worker, signal.SIGSTOP)  # what is asked of it takes for ever
        under_way = checks.CheckDocument.future(asked, timeout=60)
        checks.CheckPair(check_pb2.CheckPairRequest(protocol="ros2"), timeout=20)  # behind it on one connection
        began = time.monotonic()
        assert service.stop() == 0
        assert time.monotonic() - began < 25  # without an end of the grace it would take 30 and more
        assert under_way.code() in {grpc.StatusCode.UNAVAILABLE, grpc.StatusCode.CANCELLED}


def test_workers_end_with_a_service_that_is_killed():
    service = Service("--no-config", "--listen", "127.0.0.1:0", installed=True)
    children = service.children()
    assert children
    service.process.kill()
    service.stop()
    until = time.monotonic() + 60
    while any(map(alive, children)):
        assert time.monotonic() < until
        time.sleep(0.05)


# --- several processes ---


@pytest.mark.skipif(not hasattr(socket, "SO_REUSEPORT"), reason="no shared ports here")
def test_several_processes_share_a_port_and_one_that_dies_is_replaced(start):
    with start("--workers", "2", "--heavy-workers", "1", "--metrics", "127.0.0.1:0") as service:
        serving = lambda: [line for line in service.lines if line["event"] == "serving"]  # noqa: E731
        deadline = time.monotonic() + 60
        while len(serving()) < 2 and time.monotonic() < deadline:
            time.sleep(0.05)
        first, second = (line["pid"] for line in serving())
        assert {line["grpc"] for line in serving()} == {service.grpc}
        for _ in range(10):
            with service.client() as client:
                assert client.check_pair("ros2").verdict == "compatible"
        os.kill(int(str(first)), signal.SIGKILL)
        service.wait_for(lambda line: line["event"] == "process died")
        deadline = time.monotonic() + 60
        while len(serving()) < 3 and time.monotonic() < deadline:
            time.sleep(0.05)
        assert len({line["pid"] for line in serving()}) == 3
        for _ in range(10):
            with service.client() as client:
                assert client.check_pair("ros2").verdict == "compatible"
        address = service.wait_for(lambda line: line["event"] == "starting")["metrics"]
        with urllib.request.urlopen(f"http://{address}/metrics", timeout=10) as answer:
            counted = [line for line in answer.read().decode().splitlines() if line.startswith("cqos_calls_total")]
        assert sum(float(line.rpartition(" ")[2]) for line in counted) == 20
        with service.client() as client, client.session() as session:
            session.report()
            with urllib.request.urlopen(f"http://{address}/metrics", timeout=10) as answer:
                assert "cqos_sessions_open 1.0" in answer.read().decode().splitlines()
    assert not alive(int(str(second)))


@pytest.mark.skipif(not hasattr(socket, "SO_REUSEPORT"), reason="no shared ports here")
def test_processes_end_with_the_one_that_started_them():
    """Else they would keep the port, and let in whom they let in then."""
    service = Service("--no-config", "--listen", "127.0.0.1:0", "--workers", "2")
    try:
        service.wait_for(lambda line: line["event"] == "serving")
        children = service.children()
        assert len(children) == 2
    finally:
        service.process.kill()
        service.stop()
    until = time.monotonic() + 60
    while any(map(alive, children)):
        assert time.monotonic() < until
        time.sleep(0.05)


# --- what it tells, and where it is configured ---


def test_calls_are_logged_with_the_callers_id_and_nothing_that_is_in_them(service):
    with grpc.insecure_channel(service.grpc) as channel:
        checks = check_pb2_grpc.CheckServiceStub(channel)
        request = check_pb2.CheckPairRequest(protocol="ros2", topic={"name": "a_topic_to_be_logged_nowhere"})
        checks.CheckPair(request, metadata=(("x-request-id", "my-own-id.7"), ("authorization", "Bearer hidden")))
        with pytest.raises(grpc.RpcError) as raised:
            checks.CheckPair(check_pb2.CheckPairRequest(), metadata=(("x-request-id", 'bad"id\x7f'[:6]),))
        line = service.wait_for(lambda line: line.get("request_id") == "my-own-id.7", 5)
        assert (line["method"], line["code"]) == ("/cqos.v1.CheckService/CheckPair", "OK")
        assert isinstance(line["ms"], float)
        error: Any = raised.value
        made = dict(error.trailing_metadata())["x-request-id"]
        assert service.wait_for(lambda line: line.get("request_id") == made, 5)["code"] == "INVALID_ARGUMENT"
    assert "a_topic_to_be_logged_nowhere" not in service.log
    assert "hidden" not in service.log


def test_flags_win_over_variables_and_these_over_the_file(tmp_path):
    (tmp_path / "cqos.toml").write_text(
        '[serve]\nlisten = "127.0.0.1:0"\nlog_level = "error"\nmax_endpoints = 1\nmax_sessions = 0\ngrace = 1\n'
        'web = "127.0.0.1:0"\norigin = ["https://one.example", "https://other.example:8080"]\n',
        encoding="utf-8",
    )
    service = Service(
        *("--log-level", "info"),
        folder=tmp_path,
        environment={"CQOS_SERVE_MAX_ENDPOINTS": "2", "CQOS_SERVE_GRACE": "3"},
        installed=True,
    )
    try:
        with service.client() as client:
            for number in (2, 3):
                model = cqos.System(protocol="ros2", participants={"a": cqos.Participant("a")})
                model.endpoints += [
                    cqos.Endpoint(id=f"e{each}", role="publisher", topic="t", participant="a") for each in range(number)
                ]
                if number == 2:
                    assert client.check_system(model).endpoints == 2
                else:
                    with pytest.raises(ServiceError, match="this service takes 2"):
                        client.check_system(model)
            with pytest.raises(ServiceError, match="0 sessions are open already"):
                client.session().report()
        for page in ("https://one.example", "https://other.example:8080"):
            asked = urllib.request.Request(f"{service.web}/healthz", headers={"origin": page})  # noqa: S310 - our own
            with urllib.request.urlopen(asked, timeout=10) as answer:  # noqa: S310
                assert answer.headers["access-control-allow-origin"] == page
    finally:
        assert service.stop() == 0
    assert [line["grace"] for line in service.lines if line["event"] == "draining"] == [3.0]


def test_an_unknown_key_of_the_file_is_named(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    Path("cqos.toml").write_text('[serve]\nlissen = "127.0.0.1:0"\n', encoding="utf-8")
    assert main(["serve"]) == 2
    said = " ".join(capsys.readouterr().err.split())
    assert "cqos.toml:2:10: `cqos serve` has no option `lissen`" in said
    assert "`listen`" in said


@pytest.mark.parametrize(
    ("line", "expected"),
    [
        ('max_calls = "many"', "`max_calls`: 'many' is not a valid integer range"),
        ("max_share = 7", "`max_share`: 7.0 is not in the range 0<=x<=1"),
        ('allow_anonymous = "perhaps"', "`allow_anonymous`: 'perhaps' is not a valid boolean"),
        ('log_format = "xml"', "`log_format`: 'xml' is not one of 'json', 'text'"),
    ],
)
def test_a_value_of_the_file_that_cannot_be_is_named_with_its_place(line, expected, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    Path("cqos.toml").write_text(f'[serve]\nlisten = "127.0.0.1:0"\n{line}\n', encoding="utf-8")
    assert main(["serve"]) == 2
    assert f"cqos.toml:3:{line.index('=') + 3}: {expected}" in " ".join(capsys.readouterr().err.split())


def test_settings_reach_another_process_as_they_are():
    settings = Settings(web="127.0.0.1:1", origins=("a", "b"), tokens=("x",), limits=Limits(endpoints=7))
    assert Settings.from_json(settings.to_json()) == settings


@pytest.mark.parametrize("address", ["127.0.0.1:0", "127.8.8.8:1", "[::1]:5", "localhost:5"])
def test_this_machine_needs_no_credentials(address):
    Settings(listen=address).check()
    with pytest.raises(CqosError):
        Settings(listen=address.replace(address.rpartition(":")[0], "10.0.0.1")).check()


# --- what stands in deploy/ ---


def test_the_systemd_unit_is_one(tmp_path):
    tool = "/usr/bin/systemd-analyze"
    if not Path(tool).is_file():
        if os.environ.get("CI") == "true":
            pytest.fail("systemd-analyze is missing")
        pytest.skip("systemd-analyze is missing")
    unit = tmp_path / "cqos.service"
    text = (ROOT / "deploy" / "cqos.service").read_text(encoding="utf-8")
    # What it starts has to be there to be found good.
    unit.write_text(text.replace("/opt/cqos/bin/cqos", sys.executable), encoding="utf-8")
    done = subprocess.run([tool, "verify", str(unit)], capture_output=True, text=True, check=False)
    assert [line for line in done.stderr.splitlines() if "cqos.service" in line] == []


def test_deployments_use_options_that_there_are():
    import re

    variables = {f"CQOS_SERVE_{str(option.name).upper()}" for option in serve.params}
    flags = {flag for option in serve.params for flag in option.opts}
    for file in filter(Path.is_file, (ROOT / "deploy").iterdir()):
        text = file.read_text(encoding="utf-8")
        assert set(re.findall(r"CQOS_SERVE_[A-Z_]+", text)) <= variables, file
        if file.suffix in {".yaml", ".service"}:
            assert set(re.findall(r"(?<![\w-])--[a-z][a-z-]+", text)) - {"--from-literal"} <= flags, file


def test_an_image_is_built_from_all_that_is_needed_and_from_nothing_else():
    """Neither tokens that lie about nor an environment of another machine come into it."""
    lines = (ROOT / ".dockerignore").read_text(encoding="utf-8").splitlines()
    first, *rest = [line for line in lines if line and not line.startswith("#")]
    assert first == "*"
    let_through = {line.removeprefix("!") for line in rest if line.startswith("!")}
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
    packed = project["tool"]["hatch"]["build"]["targets"]["sdist"]["only-include"]
    assert let_through == {*packed, "pyproject.toml", "constraints.txt", "plugins"}
    assert all((ROOT / name).exists() for name in let_through)


def test_the_kubernetes_manifest_agrees_with_itself():
    import yaml

    deployment, service = yaml.safe_load_all((ROOT / "deploy" / "kubernetes.yaml").read_text(encoding="utf-8"))
    pod = deployment["spec"]["template"]
    (container,) = pod["spec"]["containers"]
    variables = {each["name"]: each["value"] for each in container["env"]}
    ports = {each["name"]: each["containerPort"] for each in container["ports"]}
    assert deployment["spec"]["selector"]["matchLabels"].items() <= pod["metadata"]["labels"].items()
    assert service["spec"]["selector"].items() <= pod["metadata"]["labels"].items()
    assert {each["name"] for each in container["volumeMounts"]} == {each["name"] for each in pod["spec"]["volumes"]}
    assert variables["CQOS_SERVE_LISTEN"] == f"0.0.0.0:{ports['grpc']}"
    assert variables["CQOS_SERVE_METRICS"] == f"0.0.0.0:{ports['metrics']}"
    assert service["spec"]["ports"][0]["targetPort"] in ports
    for probe in ("startupProbe", "readinessProbe", "livenessProbe"):
        assert container[probe]["grpc"]["port"] == ports["grpc"]
    assert pod["spec"]["terminationGracePeriodSeconds"] > Settings().grace


def test_memory_limits_fit_the_workers():
    import re

    import yaml

    gib = 1024**3
    unit = (ROOT / "deploy" / "cqos.service").read_text(encoding="utf-8")
    stated = dict(re.findall(r"Environment=CQOS_SERVE_([A-Z_]+)=(\d+)", unit))
    deployment, _ = yaml.safe_load_all((ROOT / "deploy" / "kubernetes.yaml").read_text(encoding="utf-8"))
    (container,) = deployment["spec"]["template"]["spec"]["containers"]
    pod = {each["name"].removeprefix("CQOS_SERVE_"): each["value"] for each in container["env"]}
    limits = [
        (stated, int(re.findall(r"MemoryMax=(\d+)G", unit)[0]) * gib),
        (pod, int(container["resources"]["limits"]["memory"].removesuffix("Mi")) * 1024**2),
    ]
    for given, limit in limits:
        workers = int(given["HEAVY_WORKERS"]) + int(given["SESSION_WORKERS"])
        each = workers * int(given["MAX_WORKER_MEMORY"]) + gib // 2
        assert int(given.get("WORKERS", 1)) * each <= limit
    assert "OOMPolicy=continue" in unit


def test_dashboard_and_alerts_ask_for_metrics_that_there_are(service):
    import re

    import yaml

    with urllib.request.urlopen(f"http://{service.addresses['metrics']}/metrics", timeout=10) as answer:
        there = set(re.findall(r"^# TYPE (\w+) ", answer.read().decode(), re.MULTILINE))
    there |= {f"{name}_bucket" for name in there}
    files = [ROOT / "deploy" / name for name in ("prometheus-rules.yaml", "grafana-dashboard.json")]
    for file in files:
        text = file.read_text(encoding="utf-8")
        assert set(re.findall(r"cqos_[a-z_]+", text)) <= there, file
        assert yaml.safe_load(text)
