"""The edits of a system that is kept open: those of a session in this process, and of one that a service keeps."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from cqos_core.language.domains import SettingValue, as_text

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping

    from cqos_core.model.chains import Chain, StatedLink
    from cqos_core.model.flow import ControlFlow
    from cqos_core.model.system import (
        Acceptance,
        Bridge,
        Broker,
        Endpoint,
        ImportNote,
        Overlay,
        Participant,
        Profile,
        TeamRule,
        Topic,
    )


class SystemEditor:
    """The edits of a system.

    An edit is data: its kind, which is the name of a field of `cqos.v1.Change`, and its value. A session of this process
    raises `InputError` for an endpoint that cannot be checked, and `KeyError` for a name that the system does not have. A
    session of the service raises `ServiceError` instead, when it makes its report, and then does none of the edits.
    """

    def edit(self, kind: str, value: Any) -> None:
        """Do one edit."""
        raise NotImplementedError

    def put(self, endpoint: Endpoint) -> None:
        """Add an endpoint, or replace the one with its id."""
        self.edit("put_endpoint", endpoint)

    def remove(self, endpoint_id: str) -> None:
        """Remove an endpoint."""
        self.edit("remove_endpoint", endpoint_id)

    def put_participant(self, participant: Participant) -> None:
        """Add a participant, or replace the one with its id."""
        self.edit("put_participant", participant)

    def remove_participant(self, participant_id: str) -> None:
        """Remove a participant and its endpoints."""
        self.edit("remove_participant", participant_id)

    def put_profile(self, profile: Profile) -> None:
        """Add a profile, or replace the one of its name."""
        self.edit("put_profile", profile)

    def remove_profile(self, name: str) -> None:
        """Remove a profile."""
        self.edit("remove_profile", name)

    def put_topic(self, topic: Topic) -> None:
        """Set the facts of a topic, in place of its earlier facts."""
        self.edit("put_topic", topic)

    def remove_topic(self, name: str) -> None:
        """Remove the facts of a topic."""
        self.edit("remove_topic", name)

    def put_broker(self, broker: Broker) -> None:
        """Add a broker, or replace the one with its id."""
        self.edit("put_broker", broker)

    def remove_broker(self, broker_id: str) -> None:
        """Remove a broker."""
        self.edit("remove_broker", broker_id)

    def put_bridge(self, bridge: Bridge) -> None:
        """Add a bridge, or replace the one with its id; a side in a participant that is not there becomes a finding."""
        self.edit("put_bridge", bridge)

    def remove_bridge(self, bridge_id: str) -> None:
        """Remove a bridge."""
        self.edit("remove_bridge", bridge_id)

    def put_chain(self, chain: Chain) -> None:
        """Add a chain, or replace the one of its name."""
        self.edit("put_chain", chain)

    def remove_chain(self, name: str) -> None:
        """Remove a chain."""
        self.edit("remove_chain", name)

    def put_link(self, link: StatedLink) -> None:
        """Add a link, or replace the one of its name."""
        self.edit("put_link", link)

    def remove_link(self, name: str) -> None:
        """Remove a link."""
        self.edit("remove_link", name)

    def set_overlays(self, overlays: Iterable[Overlay]) -> None:
        """Replace the settings that are laid over those of endpoints."""
        self.edit("set_overlays", [*overlays])

    def set_protocol(self, protocol: str | None) -> None:
        """Set the protocol of participants that state none; None leaves it open."""
        self.edit("set_protocol", protocol)

    def set_option(self, pack: str, name: str, value: SettingValue | None) -> None:
        """Set an option of the whole system; None removes it."""
        self.edit("set_option", (pack, name, None if value is None else as_text(value)))

    def set_name(self, name: str) -> None:
        """Set the name of the system in the report."""
        self.edit("set_name", name)

    def set_flows(self, flows: Iterable[ControlFlow]) -> None:
        """Replace the control flow of the files."""
        self.edit("set_flows", (*flows,))

    def set_notes(self, notes: Iterable[ImportNote]) -> None:
        """Replace the remarks of importers, which become findings."""
        self.edit("set_notes", [*notes])

    def set_partial(self, partial: bool) -> None:  # noqa: FBT001 - the only argument
        """Set whether the system is a part, so that an endpoint without partner is no reason for a warning."""
        self.edit("set_partial", partial)

    def set_hypothetical(self, hypothetical: bool) -> None:  # noqa: FBT001 - the only argument
        """Set whether the endpoints only try profiles that no endpoint uses, so that their pairs set no verdict."""
        self.edit("set_hypothetical", hypothetical)

    def set_rules(
        self,
        *,
        checks: Iterable[TeamRule] | None = None,
        accept: Iterable[Acceptance] | None = None,
        severities: Mapping[str, str] | None = None,
    ) -> None:
        """Replace the team's rules, the accepted exceptions or the severities; None leaves them."""
        if checks is not None:
            self.edit("set_checks", [*checks])
        if accept is not None:
            self.edit("set_accept", [*accept])
        if severities is not None:
            self.edit("set_severities", dict(severities))
