"""Mosquitto as a process on a free port of loopback, and links to it that can be cut."""

from __future__ import annotations

import asyncio
import os
import shutil
import socket
import subprocess
import tempfile
import time
from collections.abc import Sequence
from contextlib import suppress
from pathlib import Path
from typing import Final

from cqos_core.packs.prover import NotRunnableError

_PATIENCE: Final = 3.0
"""Seconds within which Mosquitto starts or ends."""


def program() -> str | None:
    """Return where Mosquitto is; Debian has it where only root looks."""
    return shutil.which("mosquitto") or shutil.which("mosquitto", path="/usr/sbin:/usr/local/sbin:/opt/homebrew/sbin")


def version() -> str:
    """Return the version of Mosquitto; empty where it is not installed."""
    found = program()
    if found is None:
        return ""
    return subprocess.run([found, "-h"], capture_output=True, text=True, check=False).stdout.split()[2]  # noqa: S603


class Mosquitto:
    """A broker that is started, stopped, killed and started again, on one port and with one folder for what it saves."""

    def __init__(self, directives: Sequence[str], access: Sequence[str] = ()) -> None:
        """Prepare it with these lines of configuration, and those of an acl_file."""
        self.folder = tempfile.TemporaryDirectory(prefix="cqos-prove-")
        with socket.create_server(("127.0.0.1", 0)) as free:
            self.port: int = free.getsockname()[1]
        folder = Path(self.folder.name)
        lines = [f"listener {self.port} 127.0.0.1", "allow_anonymous true", f"persistence_location {folder}/"]
        if os.geteuid() == 0:
            lines.append("user root")  # else it gives up the right to write into the folder
        if access:
            (folder / "acl").write_text("\n".join(access) + "\n", encoding="utf-8")
            lines.append(f"acl_file {folder / 'acl'}")
        self.configuration = folder / "mosquitto.conf"
        self.configuration.write_text("\n".join((*lines, *directives)) + "\n", encoding="utf-8")
        self.log = folder / "log"
        self.process: subprocess.Popen[bytes] | None = None

    async def start(self) -> None:
        """Start it, and wait until it answers.

        Raises:
            NotRunnableError: it does not start.
        """
        with self.log.open("wb") as log:
            self.process = subprocess.Popen(  # noqa: ASYNC220, S603
                [program() or "mosquitto", "-c", str(self.configuration)], stdout=subprocess.DEVNULL, stderr=log
            )
        until = time.monotonic() + _PATIENCE
        while self.process.poll() is None:
            try:
                socket.create_connection(("127.0.0.1", self.port), 1).close()
            except OSError:
                if time.monotonic() > until:
                    break
                await asyncio.sleep(0.01)
            else:
                return
        await self.end()
        said = self.log.read_text(encoding="utf-8", errors="replace")
        raise NotRunnableError(f"Mosquitto does not start: {said.strip()[-300:] or 'it gives no reason'}")

    async def end(self, *, crash: bool = False) -> None:
        """Stop it in good order, or kill it; wait until it is gone."""
        process = self.process
        if process is None or process.poll() is not None:
            return
        process.kill() if crash else process.terminate()
        until = time.monotonic() + _PATIENCE
        while process.poll() is None:
            if time.monotonic() > until:
                process.kill()
            await asyncio.sleep(0.005)

    async def close(self) -> None:
        """Stop it for good and remove what it saved."""
        await self.end()
        self.folder.cleanup()


class Link:
    """A relay on a port of its own between one client and the broker."""

    def __init__(self, broker: int) -> None:
        """``broker`` is the port of the broker."""
        self.broker = broker
        self.port = 0
        self.silent = False
        """Whether what comes, from either side, is dropped."""
        self.cut = False
        """Whether no connection comes about."""
        self._server: asyncio.Server | None = None
        self._open: set[asyncio.Task[None]] = set()
        self._writers: dict[asyncio.StreamWriter, bool] = {}

    async def start(self) -> None:
        """Begin to relay."""
        self._server = await asyncio.start_server(self._relay, "127.0.0.1", 0)
        self.port = self._server.sockets[0].getsockname()[1]

    def break_off(self, *, towards_broker: bool, towards_client: bool) -> None:
        """Break connections as a fault does: with nothing that says so to the other side of the link."""
        for writer, of_broker in list(self._writers.items()):
            if towards_broker if of_broker else towards_client:
                writer.transport.abort()

    async def close(self) -> None:
        """End all."""
        if self._server is not None:
            self._server.close()
        for task in self._open:
            task.cancel()
        await asyncio.gather(*self._open, return_exceptions=True)

    async def _relay(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        task = asyncio.current_task()
        assert task is not None  # noqa: S101 - this is a coroutine of a task
        self._open.add(task)
        self._writers[writer] = False
        both = [writer]
        with suppress(OSError, asyncio.CancelledError):
            if not self.cut:
                back, onward = await asyncio.open_connection("127.0.0.1", self.broker)
                both.append(onward)
                self._writers[onward] = True
                await asyncio.gather(self._pump(reader, onward), self._pump(back, writer))
        self._open.discard(task)
        for each in both:
            self._writers.pop(each, None)
            each.transport.abort()

    async def _pump(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        """Pass bytes on; where one side ends, end the other, unless the link is cut silently."""
        with suppress(ConnectionError):
            while data := await reader.read(65_536):
                if not self.silent:
                    writer.write(data)
                    await writer.drain()
        if not self.silent:
            writer.close()
