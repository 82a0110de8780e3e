"""Runs pairs on Cyclone DDS."""

from __future__ import annotations

from importlib.metadata import PackageNotFoundError, version
from typing import TYPE_CHECKING, Final

from cqos_live.dds.prove.dds import Implementation
from cqos_live.dds.prove.forking import Forks

if TYPE_CHECKING:
    from collections.abc import Callable

    from cqos_core.packs.prover import Event, Outcome, Plan
    from cqos_live.dds.prove.stage import Running

_LOOPBACK: Final = (
    # With unicast peers alone, two participants do not find each other again once a lease has run out.
    '<CycloneDDS><Domain><General><Interfaces><NetworkInterface address="127.0.0.1" multicast="true"/></Interfaces>'
    "<AllowMulticast>spdp</AllowMulticast></General>"
    '<Discovery><ParticipantIndex>auto</ParticipantIndex><Peers><Peer address="127.0.0.1"/></Peers>{lease}</Discovery>'
    "</Domain></CycloneDDS>"
)


class _Cyclone(Implementation):
    title = "Cyclone DDS"

    def missing(self) -> str | None:
        """Say how to install Cyclone DDS, where it is not there."""
        if self._version() is not None:
            return None
        from cqos_core.model.optional_features import advice

        return f"Cyclone DDS is not installed: {advice('cyclonedds')}"

    def prove(self, plan: Plan, report: Callable[[Event], None] = lambda _event: None) -> Outcome:
        """Run the pair, as all implementations do.

        Raises:
            MissingError: Cyclone DDS is not installed, with the line that installs it.
        """
        if self._version() is None:
            from cqos_core.model.optional_features import missing

            raise missing("cyclonedds", "Cyclone DDS is not installed")
        return super().prove(plan, report)

    def version(self) -> str:
        """Return the version of the Python package, which brings the library."""
        return self._version() or "?"

    def implementation(self) -> str:
        """Return its name in the pack."""
        return "cyclonedds"

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


_FORKS: Final = Forks("cqos_live.dds.prove.cyclone_end")
PROVER: Final = _Cyclone()
