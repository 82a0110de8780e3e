"""Settings of the service: addresses, credentials, limits. They are checked before anything is opened."""

from __future__ import annotations

import hashlib
import ipaddress
import json
import logging
import re
import secrets
import time
from dataclasses import asdict, field
from pathlib import Path
from typing import Any, Final

from cqos_core.model.dataclass import dataclass
from cqos_core.model.problems import CqosError
from cqos_core.remote.tls import try_tls
from cqos_core.service.log_lines import ALWAYS, log_event

MIB: Final = 1024 * 1024
PAGE: Final = Path(__file__).parent / "page"
"""Where the build puts the page of the modeler."""
_ORIGIN: Final = re.compile(r"\*|[a-z][a-z0-9+.-]*://[^/\s?#@A-Z]+")
_MESSAGES: Final = 16
_TLS_NAMES: Final = ("--tls-cert", "--tls-key", "--tls-client-ca")
_LOOK_SECONDS: Final = 1.0


@dataclass(frozen=True, slots=True)
class Limits:
    """Limits of one call, and of all calls together.

    Attributes:
        message_bytes: of one request message.
        total_bytes: of all requests that are under way at the same time; None: sixteen times that.
        endpoints: of one system.
        seconds: for one answer.
        inline_bytes: requests up to this size are answered in the process that serves; larger ones, and documents, by
            workers, so that they block no other call.
        workers: processes for those.
        waiting: calls that may wait for a worker.
        worker_memory: bytes that a worker may use (Linux); 0: any.
        calls: at the same time.
        sessions: open at the same time.
        share: part of the calls, of their bytes and of the sessions that one caller may have.
        session_workers: processes that they live in.
        idle_seconds: after which a session that hears nothing is closed.
    """

    message_bytes: int = 16 * MIB
    total_bytes: int | None = None
    endpoints: int = 20_000
    seconds: float = 30.0
    inline_bytes: int = 2 * 1024
    workers: int = 2
    waiting: int = 256
    worker_memory: int = 2048 * MIB
    calls: int = 1_000
    sessions: int = 64
    share: float = 0.5
    session_workers: int = 2
    idle_seconds: float = 900.0

    @property
    def bytes_together(self) -> int:
        """The most bytes of all requests under way."""
        return _MESSAGES * self.message_bytes if self.total_bytes is None else self.total_bytes

    @property
    def bytes_kept(self) -> int:
        """The most bytes of all open sessions: models, documents, and messages of streams."""
        return self.bytes_together // 4


@dataclass(frozen=True, slots=True)
class Settings:
    """Settings of the service.

    Attributes:
        listen: address of gRPC, ``host:port``; port 0 takes a free one.
        web: address of the server for browsers, or None.
        modeler: serve the page of the modeler there.
        named: paths of the files that this page reads and saves, on this machine only.
        named_secret, named_nonce: the key that its requests for them need is made of these; no secret: no files.
        named_ticket: that gives the key once.
        origins: of foreign pages that may call the server for browsers.
        metrics: address of Prometheus metrics, or None.
        tokens: SHA-256 hashes of accepted bearer tokens; none: no token is required.
        quotas: of some of them, the sum, the name for the log, and the share in place of that of the limits.
        certificate, key: paths of the server's certificate chain and private key, PEM.
        client_authority: path of the certificates that callers' certificates must be signed by.
        anonymous: serve others than this machine without credentials.
        grace: seconds that calls under way get when the service ends.
        leaving: seconds before that in which calls are still taken, while health says that it ends.
        processes: that share the port.
        tracing: send spans by OpenTelemetry.
        log_level, log_format: ``info``; ``json`` or ``text``.
    """

    listen: str = "127.0.0.1:50051"
    web: str | None = None
    modeler: bool = False
    named: tuple[str, ...] = ()
    named_secret: str = ""
    named_nonce: str = ""
    named_ticket: str = ""
    origins: tuple[str, ...] = ()
    metrics: str | None = None
    tokens: tuple[str, ...] = ()
    quotas: tuple[tuple[str, str, float], ...] = ()
    certificate: str | None = None
    key: str | None = None
    client_authority: str | None = None
    anonymous: bool = False
    grace: float = 10.0
    leaving: float = 1.0
    processes: int = 1
    tracing: bool = False
    log_level: str = "info"
    log_format: str = "json"
    limits: Limits = field(default_factory=Limits)

    @property
    def encrypted(self) -> bool:
        """Whether callers must speak TLS."""
        return self.certificate is not None

    def to_json(self) -> str:
        """Return the settings as text, for another process."""
        return json.dumps(asdict(self))

    @classmethod
    def from_json(cls, text: str) -> Settings:
        """Return the settings that `to_json` wrote."""
        content: dict[str, Any] = json.loads(text)
        content["limits"] = Limits(**content["limits"])
        content["quotas"] = [tuple(each) for each in content["quotas"]]
        given: dict[str, Any] = {n: tuple(value) if isinstance(value, list) else value for n, value in content.items()}
        return cls(**given)

    def check(self) -> None:
        """Refuse settings that are unsafe or cannot work.

        Raises:
            CqosError: with what to change.
        """
        for name, address in (("--listen", self.listen), ("--web", self.web), ("--metrics", self.metrics)):
            if address is not None:
                split_address(name, address)
        if self.limits.bytes_together < self.limits.message_bytes:
            raise CqosError(
                f"--max-total-bytes {self.limits.bytes_together} leaves no room for one message, "
                f"which may have {self.limits.message_bytes} (--max-message-bytes)",
                f"write --max-total-bytes {self.limits.message_bytes} or more",
            )
        if self.client_authority is not None and self.certificate is None:
            raise CqosError(
                "--tls-client-ca asks callers for certificates", "write --tls-cert FILE and --tls-key FILE too"
            )
        try_tls(self.certificate, self.key, self.client_authority, names=_TLS_NAMES)
        self._check_origins()
        self._check_page()
        if self.tokens or self.client_authority or self.anonymous:
            return
        for name, address in (("--listen", self.listen), ("--web", self.web)):
            if address is not None and not is_loopback(split_address(name, address)[0]):
                raise CqosError(
                    f"{name} {address} can be reached from other machines, and the service would ask for no credentials",
                    "write --token-file FILE or --tls-client-ca FILE, or --allow-anonymous",
                )

    def _check_page(self) -> None:
        if self.modeler and self.web is None:
            raise CqosError(
                "--modeler serves the page to browsers, and no address for them is given", "write --web HOST:PORT too"
            )
        if self.modeler and not (PAGE / "index.html").is_file():
            raise CqosError(
                "the page of the modeler is not in this installation, so `cqos modeler` cannot run; all other commands work",
                "in a clone of C-QoS, write: python3 dev.py setup (it gets Node.js from PyPI and builds the page)",
            )

    def _check_origins(self) -> None:
        if self.origins and self.web is None:
            raise CqosError(
                "--origin is for the server for browsers, which has no address", "write --web HOST:PORT too"
            )
        for each in self.origins:
            if not _ORIGIN.fullmatch(each):
                raise CqosError(
                    f"--origin `{each}` is none",
                    "write scheme and host, and a port where it is not the usual one, as browsers send it: "
                    "https://example.org; or * for pages from anywhere",
                )


class CertificateFiles:
    """Watches the files of certificates and keys, which may be replaced while the service runs."""

    def __init__(self, settings: Settings) -> None:
        """Record their present state."""
        self._settings = settings
        self._seen = self._state()
        self._looked = time.monotonic()

    def changed(self) -> bool:
        """Whether they changed since the last call, and can be used; broken ones are logged and ignored."""
        now, settings = time.monotonic(), self._settings
        if now - self._looked < _LOOK_SECONDS:
            return False
        before, self._seen, self._looked = self._seen, self._state(), now
        if before == self._seen:
            return False
        try:
            try_tls(settings.certificate, settings.key, settings.client_authority, names=_TLS_NAMES)
        except CqosError as error:
            log_event(logging.WARNING, "certificates not reloaded", why=str(error))
            return False
        log_event(ALWAYS, "certificates reloaded")
        return True

    def _state(self) -> list[tuple[int, int]]:
        settings = self._settings
        return [_stamp(path or "") for path in (settings.certificate, settings.key, settings.client_authority)]


def _stamp(path: str) -> tuple[int, int]:
    """Return time and number of a file, which change when it is replaced."""
    try:
        found = Path(path).stat()
    except OSError:
        return 0, 0
    return found.st_mtime_ns, found.st_ino


def split_address(name: str, address: str) -> tuple[str, int]:
    """Return host and port of ``host:port``; an IPv6 address stands in brackets.

    Raises:
        CqosError: it is no address.
    """
    host, colon, port = address.rpartition(":")
    host = host.removeprefix("[").removesuffix("]")
    if not colon or not host or not port.isascii() or not port.isdigit() or int(port) > 65_535:  # noqa: PLR2004 - the last port
        raise CqosError(f"{name} `{address}` is no address", "write host:port, for instance 127.0.0.1:50051")
    return host, int(port)


def is_loopback(host: str) -> bool:
    """Whether only this machine reaches the host."""
    if host == "localhost":
        return True
    try:
        return ipaddress.ip_address(host).is_loopback
    except ValueError:
        return False


def address_text(host: str, port: int) -> str:
    """Return ``host:port``."""
    return f"[{host}]:{port}" if ":" in host else f"{host}:{port}"


def token_sum(token: str) -> str:
    """Return the SHA-256 hash of a token."""
    return hashlib.sha256(token.encode()).hexdigest()


def new_key() -> str:
    """Return a key that cannot be guessed."""
    return secrets.token_urlsafe(32)


_SHORTEST_TOKEN: Final = 16
_NAME: Final = re.compile(r"[A-Za-z0-9_.-]{1,64}")


def read_tokens(path: str, share: float) -> tuple[tuple[str, str, float], ...]:
    """Return the hashes of the tokens in a file, with the name and share of each.

    Each line has a token, optionally with ``name=NAME`` and ``share=PART`` behind it, separated by blanks. Empty lines and
    lines that begin with ``#`` are ignored.

    Raises:
        CqosError: it cannot be read, or holds no token, or one that could be guessed.
    """
    try:
        lines = [line.strip() for line in Path(path).read_text(encoding="utf-8").splitlines()]
    except (OSError, ValueError) as error:
        reason = getattr(error, "strerror", None) or "it is not UTF-8"
        raise CqosError(f"the token file {path} cannot be read: {reason}") from None
    entries = [(number, line.split()) for number, line in enumerate(lines, 1) if line and not line.startswith("#")]
    if not entries:
        raise CqosError(f"the token file {path} holds no token")
    refuse_short([token for _, (token, *_) in entries])
    return tuple((token_sum(token), *_quota(path, number, more, share)) for number, (token, *more) in entries)


def _quota(path: str, number: int, more: list[str], share: float) -> tuple[str, float]:
    name = ""
    for each in more:
        key, _, value = each.partition("=")
        if key == "name" and _NAME.fullmatch(value):
            name = value
        elif key == "share" and re.fullmatch(r"0?\.\d{1,9}|1|1\.0*", value) and float(value) > 0:
            share = float(value)
        else:
            # The text may be part of a token, so it is not repeated.
            expected = "write `name=` with letters, digits and _ . - behind it, or `share=` with a part from 0 to 1"
            raise CqosError(f"{path}:{number}: behind the token stands something else", expected)
    return name, share


def refuse_short(tokens: list[str]) -> None:
    """Refuse tokens that are easy to guess, or that no header can carry.

    Raises:
        CqosError: without repeating any token.
    """
    if any(len(token) < _SHORTEST_TOKEN for token in tokens):
        raise CqosError(
            f"a token is shorter than {_SHORTEST_TOKEN} characters", "`openssl rand -hex 32` makes a good one"
        )
    if not all(token.isascii() and token.isprintable() and " " not in token for token in tokens):
        raise CqosError(
            "a token has characters other than printable ASCII without blanks",
            "`openssl rand -hex 32` makes a good one",
        )
