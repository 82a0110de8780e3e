"""The clients of a broker as plain values, and the system that they make."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field
from typing import Final

from cqos_core.model.settings import Place, Setting, Settings
from cqos_core.model.system import (
    PUBLISHER,
    SUBSCRIBER,
    Broker,
    Endpoint,
    Participant,
    Role,
    System,
    endpoint_id,
    numbered,
)

_OF_5_0: Final = ("session_expiry_interval", "receive_maximum", "maximum_packet_size", "topic_alias_maximum")
"""What a client of 5.0 states when it connects, beside what all versions have."""
_OF_ENDPOINTS: Final[dict[Role, dict[str, str]]] = {
    PUBLISHER: {"message_expiry_interval": "infinite"},
    SUBSCRIBER: {
        "no_local": "false",
        "retain_as_published": "false",
        "retain_handling": "send",
        "subscription_identifier": "none",
    },
}
"""What an endpoint of 3.1.1 cannot state, with the value that holds there."""


@dataclass(frozen=True, slots=True)
class SeenEndpoint:
    """One publication or subscription: its topic or filter, what was seen of it, and where."""

    role: Role
    topic: str
    settings: tuple[tuple[str, str], ...]
    place: Place | None = None


@dataclass(slots=True)
class SeenClient:
    """One client.

    Attributes:
        id: its client id.
        settings: what it stated when it connected, by the names of the pack.
        five: it uses MQTT 5.0; None: the version is not known.
        endpoints: what it publishes and subscribes; the places count for nothing when two are compared.
    """

    id: str
    settings: dict[str, str] = field(default_factory=dict)
    five: bool | None = None
    place: Place | None = None
    endpoints: dict[tuple[str, str, object], SeenEndpoint] = field(default_factory=dict)

    def subscribe(self, topic: str, settings: dict[str, str], place: Place | None = None) -> None:
        """Add a subscription; a second one to the same filter takes the place of the first (MQTT 3.1.1, 3.8.4)."""
        self.endpoints[SUBSCRIBER, topic, None] = SeenEndpoint(SUBSCRIBER, topic, tuple(settings.items()), place)

    def unsubscribe(self, topic: str) -> None:
        """Remove a subscription."""
        self.endpoints.pop((SUBSCRIBER, topic, None), None)

    def forget_subscriptions(self) -> None:
        """Remove all subscriptions: the client begins a new session."""
        self.endpoints = {key: each for key, each in self.endpoints.items() if each.role == PUBLISHER}

    def publish(self, topic: str, settings: dict[str, str], place: Place | None = None) -> None:
        """Add a publication; those of one topic with other values stand beside it."""
        stated = tuple(settings.items())
        self.endpoints.setdefault((PUBLISHER, topic, stated), SeenEndpoint(PUBLISHER, topic, stated, place))


def fill(system: System, broker: Broker, clients: Iterable[SeenClient], unreported: str) -> System:
    """Add a broker and its clients to a system; ``unreported`` says why a value is unknown that was not reported."""
    system.brokers[broker.id] = broker
    numbers: dict[str, int] = {}
    for client in sorted(clients, key=lambda each: each.id):
        name = client.id or "client without id"
        system.participants[name] = Participant(
            name, "mqtt", _connection(client, broker, unreported), label=_described(client), place=client.place
        )
        for each in client.endpoints.values():
            system.endpoints.append(
                Endpoint(
                    id=numbered(endpoint_id(name, each.role, each.topic), numbers),
                    role=each.role,
                    topic=each.topic,
                    participant=name,
                    settings=_endpoint(each, client, unreported),
                    observed=True,
                    place=each.place,
                )
            )
    return system


def _connection(client: SeenClient, broker: Broker, unreported: str) -> Settings:
    stated = {"broker": broker.id, "client_id": client.id, **client.settings}
    if client.five is not None:
        stated.setdefault("protocol_version", "5.0" if client.five else "3.1.1")
    settings = {name: Setting(text, client.place) for name, text in stated.items() if text}
    if client.five is not False:
        missing = (name for name in _OF_5_0 if name not in settings)
        settings |= {name: Setting("", client.place, unknown=unreported) for name in missing}
    return settings


def _endpoint(seen: SeenEndpoint, client: SeenClient, unreported: str) -> Settings:
    settings = {name: Setting(text, seen.place) for name, text in seen.settings}
    for name, text in _OF_ENDPOINTS[seen.role].items():
        unknown = Setting("", seen.place, unknown=unreported)
        settings.setdefault(name, Setting(text, seen.place) if client.five is False else unknown)
    return settings


def _described(client: SeenClient) -> str | None:
    """Return who logged in, beside the id."""
    user = client.settings.get("username")
    return f"{client.id} (user {user})" if user and user != client.id else None
