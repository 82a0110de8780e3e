"""Validates certificates and keys at start-up; TLS handshake errors give no reason."""

from __future__ import annotations

import ssl

from cqos_core.model.problems import CqosError


def try_tls(certificate: str | None, key: str | None, authority: str | None, *, names: tuple[str, str, str]) -> None:
    """Refuse files that TLS cannot be spoken with; ``names`` are what the caller calls the three paths.

    Raises:
        CqosError: one of the first two is missing, or a file is not what it should be.
    """
    for_certificate, for_key, for_authority = names
    if (certificate is None) != (key is None):
        raise CqosError(
            f"{for_certificate} and {for_key} belong together: a certificate and its private key", "write both"
        )
    context = ssl.SSLContext(ssl.PROTOCOL_TLS_SERVER)
    for name, path in zip(names, (certificate, key, authority), strict=True):
        if path is not None:
            _readable(name, path)
    if certificate is not None and key is not None:
        both = f"{for_certificate} {certificate} and {for_key} {key}"
        try:
            # No prompt for a password: it is an empty text.
            context.load_cert_chain(certificate, key, password=str)
        except ssl.SSLError as error:
            if error.reason == "KEY_VALUES_MISMATCH":
                raise CqosError(f"{both} do not belong together: the key is that of another certificate") from None
            expected = "expected a chain of certificates and the private key of the first, without a password, both PEM"
            raise CqosError(f"{both} cannot be used: {expected}") from None
    if authority is not None:
        try:
            context.load_verify_locations(authority)
        except ssl.SSLError:
            raise CqosError(f"{for_authority} {authority} cannot be used: expected certificates, PEM") from None


def _readable(name: str, path: str) -> None:
    try:
        with open(path, "rb"):  # noqa: PTH123 - nothing of it is needed
            pass
    except OSError as error:
        raise CqosError(f"{name}: cannot read {path}: {error.strerror}") from None
