"""Runs pairs on Cyclone DDS."""

from __future__ import annotations

from importlib.metadata import PackageNotFoundError, version
from typing import TYPE_CHECKING, Final

from cqos_dds.prove.dds import Implementation
from cqos_dds.prove.forking import Forks

if TYPE_CHECKING:
    from collections.abc import Callable

    from cqos_dds.prove.stage import Running

_LOOPBACK: Final = (
    # With unicast peers alone, two participants do not find each other again once a lease has run out.
    '<CycloneDDS><Domain><General><Interfaces><NetworkInterface address="127.0.0.1" multicast="true"/></Interfaces>'
    "<AllowMulticast>spdp</AllowMulticast></General>"
    '<Discovery><ParticipantIndex>auto</ParticipantIndex><Peers><Peer address="127.0.0.1"/></Peers>{lease}</Discovery>'
    "</Domain></CycloneDDS>"
)


class _Cyclone(Implementation):
    title = "Cyclone DDS"
    name = "cyclonedds"

    def missing(self) -> str | None:
        """Say how to install Cyclone DDS, where it is not there."""
        lacking = "Cyclone DDS is not installed: pip install 'cqos-dds[prove]' (Python 3.10 to 3.13)"
        return lacking if self._version() is None else None

    def version(self) -> str:
        """Return the version of the Python package, which brings the library."""
        return self._version() or "?"

    @staticmethod
    def _version() -> str | None:
        try:
            return version("cyclonedds")
        except PackageNotFoundError:
            return None

    def starter(self) -> Callable[[], Running]:
        """Fork the end from a process that has imported Cyclone DDS."""
        return _FORKS.start

    def further(self, lease: float | None) -> dict[str, str]:
        """Keep Cyclone DDS on loopback, whatever the user has configured."""
        stated = "" if lease is None else f"<LeaseDuration>{lease:g} s</LeaseDuration>"
        return {"configuration": _LOOPBACK.format(lease=stated)}


_FORKS: Final = Forks("cqos_dds.prove.cyclone_end")
PROVER: Final = _Cyclone()
