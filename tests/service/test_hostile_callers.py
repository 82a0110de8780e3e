"""What strangers do to the service, and what callers lose by it: nothing."""

import contextlib
import http.client
import json
import os
import shutil
import signal
import subprocess
import threading
import time

import grpc
import pytest
from google.rpc import error_details_pb2, status_pb2

from cqos.v1 import check_pb2, check_pb2_grpc
from cqos_core.remote.client import Client, ServiceError
from cqos_core.remote.refusal import Refused
from cqos_core.service.caller_quotas import Callers, TimeBudget
from cqos_core.service.settings import Limits, read_tokens
from cqos_core.service.telemetry import Meter
from tests.benchmarks.attacks import ATTACKS, OF_SESSIONS, attacking, polite, reached, renaming
from tests.service.caller_process import small
from tests.service.test_sessions import endpoint, two

ANSWERED = 20
"""Calls of a polite client that have to be answered during each attack."""
PATIENCE = 50
"""Seconds for each of them. Workers leave the processor to others, so that is long on a busy machine; an attack lasts longer."""


@pytest.fixture(scope="module")
def besieged(start):
    with start("--web", "127.0.0.1:0", "--log-level", "error") as own:
        yield own


@pytest.mark.parametrize("name", ATTACKS)
def test_no_polite_call_is_lost_or_refused_under_attack(name, besieged):
    """The short form of `tests/benchmarks/attacks.py`: whether, and not how fast."""
    with attacking(name, besieged.grpc, besieged.addresses["web"], 0.3):
        seen = polite(besieged.grpc, 0.3, least=ANSWERED, edits=name in OF_SESSIONS, patience=PATIENCE)
        assert seen.calls >= ANSWERED
        assert seen.lost == 0
        page = http.client.HTTPConnection(besieged.addresses["web"], timeout=PATIENCE)
        with contextlib.closing(page):
            page.request("GET", "/healthz")
            assert page.getresponse().read() == b"serving\n"


def test_a_model_that_grows_without_end_is_answered_by_a_worker_in_time(besieged):
    with reached(besieged.grpc) as channel:
        answer = channel.unary_unary("/cqos.v1.CheckService/CheckSystem")(renaming(8), timeout=20)
        report = check_pb2.CheckSystemResponse.FromString(answer).report
        assert {each.code for each in report.findings} >= {"CQ508"}


def details(error):
    """Reason and seconds of a refusal."""
    status = status_pb2.Status.FromString(dict(error.trailing_metadata())["grpc-status-details-bin"])
    reason, later = error_details_pb2.ErrorInfo(), error_details_pb2.RetryInfo()
    for each in status.details:
        each.Unpack(reason)
        each.Unpack(later)
    return reason.reason, later.retry_delay.seconds


def test_a_refusal_says_whether_it_is_for_ever(start):
    with start("--max-endpoints", "3", "--max-calls", "2") as own, own.client() as client:
        model = two()
        for number in range(3):
            model.endpoints.append(endpoint(f"more{number}"))
        with pytest.raises(ServiceError) as raised:
            client.check_system(model)
        assert (raised.value.reason, raised.value.retry_after) == ("TOO_LARGE", None)
        with client.session(two()) as session, client.session(two()) as other:
            session.report()
            with pytest.raises(ServiceError) as raised:
                other.report()
            assert (raised.value.reason, raised.value.retry_after) == ("CALLER_QUOTA", 1.0)


# --- who is served where ---


def test_the_time_budget_of_the_serving_process_refills():
    budget = TimeBudget(0.5, 0.2)
    budget.spend(0.5)
    assert budget.left < 0
    budget._seen -= 0.7
    assert 0 < budget.left <= 0.06
    budget._seen -= 100
    assert budget.left == pytest.approx(0.2)


def test_who_has_many_calls_under_way_is_answered_by_workers():
    callers = Callers(Limits(), Meter())
    with contextlib.ExitStack() as stack:
        for number in range(1, 7):
            caller = stack.enter_context(callers.count_call("a"))
            assert callers.may_answer_here(caller) is (number <= 4)
        other = stack.enter_context(callers.count_call("b"))
        assert callers.may_answer_here(other)
        callers.answered_here(other, 1.0)
        assert not callers.may_answer_here(other)


def test_watching_health_takes_no_place_of_calls():
    callers = Callers(Limits(calls=2, share=1), Meter())
    with contextlib.ExitStack() as stack:
        for _ in range(16):
            stack.enter_context(callers.count_watch("a"))
        with pytest.raises(Refused, match="one caller may watch 16 times at once"), callers.count_watch("a"):
            pass
        for _ in range(2):
            stack.enter_context(callers.count_call("a"))
        with pytest.raises(Refused), callers.count_call("a"):
            pass


def test_quotas_of_callers_stand_beside_their_tokens(tmp_path, start):
    file = tmp_path / "tokens"
    file.write_text("a-token-of-the-modeler name=modeler share=1\nanother-token-of-ci share=0.25\n", encoding="utf-8")
    (_, *modeler), (_, *other) = read_tokens(str(file), 0.5)
    assert (modeler, other) == (["modeler", 1.0], ["", 0.25])
    with start("--token-file", str(file), "--max-sessions", "4") as own:
        for token, most in (("a-token-of-the-modeler", 4), ("another-token-of-ci", 1)):
            with own.client(token=token) as client, contextlib.ExitStack() as stack:
                for _ in range(most):
                    stack.enter_context(client.session(two())).report()
                with (
                    client.session() as more,
                    pytest.raises(ServiceError, match=f"one caller may have {most} of the 4"),
                ):
                    more.report()
        callers = {line["caller"] for line in own.lines if line["event"] == "call"}
        assert "modeler" in callers
        assert not any("another" in caller for caller in callers)


@pytest.mark.parametrize("line", ["share=2", "share=0", "name=a/b", "more", "share=0.5 of-all"])
def test_what_else_stands_beside_a_token_is_refused_without_repeating_it(line, tmp_path):
    (tmp_path / "tokens").write_text(f"a-token-of-the-modeler {line}\n", encoding="utf-8")
    with pytest.raises(Exception, match="write `name=`") as raised:
        read_tokens(str(tmp_path / "tokens"), 0.5)
    assert line not in str(raised.value)


# --- workers that end ---


def test_a_call_whose_worker_is_killed_is_answered_by_another_one(start):
    with start("--heavy-workers", "1") as own, grpc.insecure_channel(own.grpc) as channel:
        checks = check_pb2_grpc.CheckServiceStub(channel)
        (worker,) = own.children()
        os.kill(worker, signal.SIGSTOP)  # so that the call is under way when it is killed
        under_way = checks.CheckDocument.future(small(1), timeout=60)
        time.sleep(0.5)
        os.kill(worker, signal.SIGKILL)
        assert under_way.result().report.endpoints == 1
        why = "the worker process ended while it answered (signal SIGKILL)"
        assert own.wait_for(lambda line: line["event"] == "worker ended")["why"] == why


@pytest.mark.skipif(not hasattr(os, "getpriority"), reason="no priorities here")
def test_workers_leave_the_processor_to_the_process_that_serves(besieged):
    """From their start: what they import takes a second, in which others are answered."""
    own = os.getpriority(os.PRIO_PROCESS, besieged.process.pid)
    children = besieged.children()
    assert children
    assert {os.getpriority(os.PRIO_PROCESS, each) for each in children} == {min(own + 5, 19)}


def test_a_slow_edit_of_one_caller_ends_no_session_of_another(start):
    with (
        start("--session-workers", "1", "--max-seconds", "2") as own,
        own.client() as one,
        own.client() as other,
        one.session(two()) as slow,
        other.session(two()) as session,
    ):
        slow.report()
        assert session.report().endpoints == 2
        (home,) = [each for each in own.children() if _holds_sessions(own, each)]
        os.kill(home, signal.SIGSTOP)  # what is asked of it takes for ever
        slow.put(endpoint("w", reliability="reliable"))
        with pytest.raises(ServiceError, match="it took more than 2 seconds"):
            slow.report()
        session.remove("w")
        assert session.report().endpoints == 1


def _holds_sessions(own, number):
    """Whether a child is the one that was started last, for the first session."""
    return number == max(own.children())


def test_an_edit_does_not_wait_for_that_of_another_caller(start):
    with (
        start("--session-workers", "2", "--max-seconds", "20") as own,
        own.client() as one,
        own.client() as other,
        own.client() as third,
        contextlib.ExitStack() as stack,
    ):
        slow = stack.enter_context(one.session(two()))
        slow.report()
        (home,) = [each for each in own.children() if _holds_sessions(own, each)]
        sessions = [stack.enter_context(client.session(two())) for client in (other, third)]
        for session in sessions:
            session.report()
        os.kill(home, signal.SIGSTOP)
        try:
            slow.remove("w")
            waiting = threading.Thread(target=slow.report)
            waiting.start()
            time.sleep(0.5)
            for session in sessions:
                session.remove("w")
                began = time.monotonic()
                assert session.report().endpoints == 1
                assert time.monotonic() - began < 15
        finally:
            os.kill(home, signal.SIGCONT)
        waiting.join()


# --- its end, and what it trusts ---


def test_calls_that_come_just_after_the_signal_are_answered(start):
    with start("--leaving", "1") as own, grpc.insecure_channel(own.grpc) as channel:
        checks = check_pb2_grpc.CheckServiceStub(channel)
        checks.CheckPair(check_pb2.CheckPairRequest(protocol="ros2"), timeout=20)
        own.process.send_signal(signal.SIGTERM)
        own.wait_for(lambda line: line["event"] == "draining")
        until = time.monotonic() + 0.5  # of the second in which calls are taken, however busy the machine is
        for number in range(20):
            asked = check_pb2.CheckPairRequest(protocol="ros2", topic={"name": f"t{number}"})
            checks.CheckPair(asked, timeout=20)
            if time.monotonic() > until:
                break


def test_new_certificates_are_taken_without_a_restart(start, tmp_path):
    openssl = shutil.which("openssl")
    if openssl is None:
        pytest.skip("openssl is missing")
    key, certificate = tmp_path / "key.pem", tmp_path / "cert.pem"

    def renew():
        made = ["req", "-x509", "-newkey", "rsa:2048", "-nodes", "-days", "2", "-subj", "/CN=localhost"]
        more = ["-addext", "subjectAltName=DNS:localhost", "-keyout", str(key), "-out", str(certificate)]
        subprocess.run([openssl, *made, *more], check=True, capture_output=True)
        return shutil.copy(certificate, tmp_path / f"{time.monotonic_ns()}.pem")

    def asked(own, authority):
        with Client(f"https://localhost:{own.grpc.rpartition(':')[2]}", authority=str(authority), timeout=30) as client:
            return client.check_pair("ros2").verdict

    before = renew()
    with start("--tls-cert", str(certificate), "--tls-key", str(key)) as own:
        assert asked(own, before) == "compatible"
        after = renew()
        time.sleep(1.2)
        until = time.monotonic() + 60
        while True:
            with contextlib.suppress(ServiceError):
                assert asked(own, after) == "compatible"
                break
            assert time.monotonic() < until
        with pytest.raises(ServiceError):
            asked(own, before)
        assert json.dumps(own.lines).count("certificates reloaded") == 1
        certificate.write_text("nothing", encoding="utf-8")
        time.sleep(1.2)
        assert asked(own, after) == "compatible"
        own.wait_for(lambda line: line["event"] == "certificates not reloaded")
