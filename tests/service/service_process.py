"""A service that really runs: `cqos serve` in a process of its own, on free ports, ended by its process id."""

import contextlib
import functools
import http.client
import json
import os
import signal
import subprocess
import threading
import time

from cqos_core.remote.client import Client
from tests.command_process import start, start_installed

STARTING_SECONDS = 60
READY = ("serving", "starting")
KEPT_SECONDS = 60


class Service:
    """A running `cqos serve`.

    Its process is forked from one that has imported it, unless the one of the installed command is wanted.

    Attributes:
        lines: what it has written to standard error so far, one dict per line.
    """

    def __init__(self, *arguments, environment=None, folder=None, installed=False):
        kept = {name: value for name, value in os.environ.items() if not name.startswith("CQOS_")}
        begin = start_installed if installed else start
        self.process = begin(("serve", *arguments), folder, {**kept, **(environment or {})})
        self.lines: list[dict[str, object]] = []
        self._asked = 0.0
        self._reader = threading.Thread(target=self._read)
        self._reader.start()
        try:
            self.addresses = self.wait_for(lambda line: line["event"] in READY)
        except BaseException:
            self.process.kill()
            self.process.wait()
            raise

    def _read(self):
        for line in self.process.stderr:
            try:
                self.lines.append(json.loads(line))
            except ValueError:
                self.lines.append({"event": "other", "text": line})

    def wait_for(self, wanted, seconds=STARTING_SECONDS):
        """The first line that is wanted; waits until there is one."""
        until = time.monotonic() + seconds
        while time.monotonic() < until:
            for line in list(self.lines):
                if wanted(line):
                    return line
            assert self.process.poll() is None, f"it ended: {self.lines}"
            time.sleep(0.01)
        raise AssertionError(f"no such line within {seconds} s: {self.lines}")

    @property
    def grpc(self):
        return self.addresses["grpc"]

    @property
    def web(self):
        return f"http://{self.addresses['web']}"

    @property
    def page(self):
        """A connection to the server for browsers that is kept. Without a call for a minute it opens again: the server closes it soon."""
        now = time.monotonic()
        if now - self._asked > KEPT_SECONDS:
            self._page.close()
        self._asked = now
        return self._page

    @functools.cached_property
    def _page(self):
        return http.client.HTTPConnection(self.addresses["web"], timeout=30)

    @property
    def log(self):
        return json.dumps(self.lines)

    def client(self, **options):
        return Client(self.grpc, **options)

    def children(self):
        """Process ids of its workers (Linux)."""
        listed = subprocess.run(
            ["ps", "-o", "pid=", "--ppid", str(self.process.pid)], capture_output=True, text=True, check=False
        )
        return [int(number) for number in listed.stdout.split()]

    def stop(self, seconds=30):
        """End it as an operator does; its exit code."""
        if "_page" in vars(self):
            self._page.close()
        if self.process.poll() is None:
            self.process.send_signal(signal.SIGTERM)
        try:
            return self.process.wait(seconds)
        finally:
            self.process.kill()
            self.process.wait()
            self._reader.join()
            self.process.stdout.close()
            self.process.stderr.close()


@contextlib.contextmanager
def serving(*arguments, **options):
    """A service of one's own; it must end well, and at once unless a test says how long it takes calls when it ends."""
    service = Service("--no-config", "--listen", "127.0.0.1:0", "--leaving", "0", *arguments, **options)
    try:
        yield service
    except BaseException:
        service.stop()
        raise
    assert service.stop() == 0, service.lines
