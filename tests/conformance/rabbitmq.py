"""A RabbitMQ with its MQTT plugin that is started, stopped, killed and started again, on free ports and with a folder of its own."""

from __future__ import annotations

import os
import re
import signal
import socket
import subprocess
import tempfile
import time
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING, Final

if TYPE_CHECKING:
    from typing_extensions import Self

PATIENCE: Final = 120
_LIBRARIES: Final = Path("/usr/lib/rabbitmq/lib")


def program() -> Path | None:
    """Return the script that runs in the foreground, of the package of Debian; None if it is not installed."""
    return next(iter(sorted(_LIBRARIES.glob("rabbitmq_server-*/sbin/rabbitmq-server"))), None)


def version() -> str:
    """Return its version."""
    found = program()
    return "" if found is None else re.sub(r".*rabbitmq_server-", "", str(found.parent.parent))


class Rabbit:
    """One broker; ``port`` is that of MQTT."""

    def __init__(self) -> None:
        """Prepare it."""
        self.folder = tempfile.TemporaryDirectory(prefix="cqos-rabbitmq-")
        self.port, self._amqp, self._distribution, self._epmd = _free_ports(4)
        self.process: subprocess.Popen[bytes] | None = None
        folder = Path(self.folder.name)
        (folder / "plugins").write_text("[rabbitmq_mqtt].\n", encoding="utf-8")
        lines = (
            f"listeners.tcp.1 = 127.0.0.1:{self._amqp}",
            f"mqtt.listeners.tcp.1 = 127.0.0.1:{self.port}",
            "mqtt.allow_anonymous = true",
            "log.console = false",
        )
        (folder / "rabbitmq.conf").write_text("\n".join(lines) + "\n", encoding="utf-8")

    def __enter__(self) -> Self:
        try:
            self.start()
        except BaseException:
            self.__exit__()
            raise
        return self

    def __exit__(self, *_: object) -> None:
        self.end(crash=True)
        subprocess.run(
            ["epmd", "-port", str(self._epmd), "-kill"],
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
            check=False,
        )
        self.folder.cleanup()

    def start(self) -> None:
        """Start it, and wait until it takes connections."""
        folder, script = self.folder.name, program()
        assert script is not None
        environment = {
            **os.environ,
            "HOME": folder,
            "ERL_EPMD_ADDRESS": "127.0.0.1",
            "ERL_EPMD_PORT": str(self._epmd),
            "RABBITMQ_BASE": folder,
            "RABBITMQ_CONFIG_FILE": f"{folder}/rabbitmq.conf",
            "RABBITMQ_DIST_PORT": str(self._distribution),
            "RABBITMQ_ENABLED_PLUGINS_FILE": f"{folder}/plugins",
            "RABBITMQ_LOG_BASE": f"{folder}/log",
            "RABBITMQ_MNESIA_BASE": f"{folder}/db",
            "RABBITMQ_NODENAME": f"cqos{self.port}@localhost",
            "RABBITMQ_SERVER_ADDITIONAL_ERL_ARGS": "+S 1:1",
        }
        with Path(folder, "out").open("wb") as out:
            self.process = subprocess.Popen(
                [str(script)], env=environment, stdout=out, stderr=out, stdin=subprocess.DEVNULL, start_new_session=True
            )
        until = time.monotonic() + PATIENCE
        while True:
            try:
                socket.create_connection(("127.0.0.1", self.port), 1).close()
            except OSError:
                said = Path(folder, "out").read_text(encoding="utf-8", errors="replace")
                assert self.process.poll() is None, f"RabbitMQ ends: {said[-500:]}"
                assert time.monotonic() < until, f"RabbitMQ does not answer: {said[-500:]}"
                time.sleep(0.1)
            else:
                return

    def end(self, *, crash: bool = False) -> None:
        """Stop it in good order, or kill it with its children; wait until it is gone."""
        process = self.process
        if process is None:
            return
        if not crash:
            process.send_signal(signal.SIGTERM)
            process.wait(PATIENCE)
        with suppress(ProcessLookupError):
            os.killpg(process.pid, signal.SIGKILL)  # the script and the machine of Erlang below it
        process.wait(PATIENCE)
        until = time.monotonic() + PATIENCE
        while time.monotonic() < until:
            try:
                socket.create_connection(("127.0.0.1", self.port), 1).close()
            except OSError:
                return
            time.sleep(0.1)


def _free_ports(number: int) -> list[int]:
    with_ports = [socket.create_server(("127.0.0.1", 0)) for _ in range(number)]
    ports = [each.getsockname()[1] for each in with_ports]
    for each in with_ports:
        each.close()
    return ports
