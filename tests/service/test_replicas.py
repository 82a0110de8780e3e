"""Two replicas behind a proxy that takes them in turn: a person edits, one replica is killed and the other replaced, and every edit is answered."""

from __future__ import annotations

import contextlib
import http.client
import itertools
import json
import select
import socket
import threading
import time

import pytest

from cqos.v1 import check_pb2, session_pb2
from tests.laws.test_open_documents import content_of, followed
from tests.service.service_process import Service
from tests.service.test_open_sessions import FIXED, MODEL, documents

AWAY = (OSError, http.client.HTTPException)


class Proxy:
    """Hands each connection to the next replica that answers.

    Attributes:
        replicas: addresses of their browsers' doors; a test changes them.
    """

    def __init__(self, replicas):
        self.replicas = replicas
        self._turn = itertools.count()
        self._listening = socket.create_server(("127.0.0.1", 0))
        self.port = self._listening.getsockname()[1]
        self._open = True
        threading.Thread(target=self._serve, daemon=True).start()

    def _serve(self):
        while self._open:
            with contextlib.suppress(OSError):
                near, _ = self._listening.accept()
                threading.Thread(target=self._carry, args=(near,), daemon=True).start()

    def _carry(self, near):
        with near:
            for _ in range(len(self.replicas)):
                host, _, port = self.replicas[next(self._turn) % len(self.replicas)].rpartition(":")
                with contextlib.suppress(OSError), socket.create_connection((host, int(port)), 5) as far:
                    while True:
                        for ready in select.select([near, far], [], [], 30)[0]:
                            data = ready.recv(65_536)
                            if not data:
                                return
                            (far if ready is near else near).sendall(data)

    def close(self):
        self._open = False
        self._listening.close()


class Page:
    """Edits one document, as a page in a browser does.

    Attributes:
        reasons: why it opened a session, each time.
    """

    def __init__(self, port):
        self._port, self._connection, self._session = port, None, ""
        self._revision = 0
        self._report = None
        self.reasons = []

    def show(self, text):
        """Send the document, and return the report that the person sees."""
        until = time.monotonic() + 30
        while time.monotonic() < until:
            try:
                return self._edited(text) if self._session else self._opened(text)
            except AWAY as error:
                self.leave()
                self._session = ""
                self.reasons.append(type(error).__name__)
                time.sleep(0.05)
            except LookupError as error:
                self._session = ""
                self.reasons.append(error.args[0])
        raise AssertionError(f"no answer: {self.reasons}")

    def leave(self):
        """Begin the next call with a new connection."""
        if self._connection is not None:
            self._connection.close()
            self._connection = None

    def _opened(self, text):
        self._revision += 1
        request = session_pb2.OpenSessionRequest(
            revision=self._revision, documents=check_pb2.Documents(documents=documents(model=text))
        )
        answer = session_pb2.OpenSessionResponse.FromString(self._call("OpenSession", request))
        self._session, self._report = answer.session, answer.report
        return self._report

    def _edited(self, text):
        request = session_pb2.EditSessionRequest(
            revision=self._revision + 1,
            session=self._session,
            base_revision=self._revision,
            documents=session_pb2.DocumentChanges(put=documents(model=text)),
        )
        answer = session_pb2.EditSessionResponse.FromString(self._call("EditSession", request))
        self._revision += 1
        self._report = answer.report if answer.HasField("report") else followed(self._report, answer.delta)
        return self._report

    def _call(self, name, request):
        if self._connection is None:
            self._connection = http.client.HTTPConnection("127.0.0.1", self._port, timeout=20)
        headers = {"content-type": "application/proto"}
        self._connection.request("POST", f"/cqos.v1.SessionService/{name}", request.SerializeToString(), headers)
        answer = self._connection.getresponse()
        body = answer.read()
        if answer.status == 200:
            return body
        said = json.loads(body)
        details = [each["debug"]["reason"] for each in said.get("details", ()) if "debug" in each]
        raise LookupError(*(details or [said["code"]]))


def replica():
    return Service("--no-config", "--listen", "127.0.0.1:0", "--web", "127.0.0.1:0", "--leaving", "0")


@pytest.fixture
def running():
    """Replicas by name; those that are still there are ended."""
    found = {"first": replica(), "second": replica()}
    yield found
    for each in found.values():
        each.stop()


def test_a_person_edits_on_while_one_replica_is_killed_and_the_other_replaced(running):
    proxy = Proxy([running["first"].addresses["web"], running["second"].addresses["web"]])
    page = Page(proxy.port)
    expected = {}
    for text in (MODEL, FIXED):
        expected[text] = content_of(page.show(text))
        page.leave()
    try:
        for number in range(24):
            if number % 5 == 4:
                page.leave()  # a browser closes idle connections, and the next one goes to the other replica
            if number == 8:
                running["first"].process.kill()
            if number == 15:
                running["third"] = replica()
                proxy.replicas = [running["third"].addresses["web"], running["second"].addresses["web"]]
            if number == 18:
                proxy.replicas = [running["third"].addresses["web"]]
                running["second"].process.terminate()
            text = (MODEL, FIXED)[number % 2]
            assert content_of(page.show(text)) == expected[text], page.reasons
    finally:
        page.leave()
        proxy.close()
    # It was elsewhere, or away, and the person saw nothing of that.
    assert "failed_precondition" in page.reasons or "SESSION_ELSEWHERE" in page.reasons
    assert len(page.reasons) >= 2
