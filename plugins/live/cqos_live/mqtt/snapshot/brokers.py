"""Asks the management interfaces of brokers for their clients and subscriptions, by HTTP.

No broker reports who publishes. RabbitMQ 3.10.8 was asked (`/api/connections`, `/api/queues`, `/api/bindings`, with the MQTT plugin), and tests
have its answers. It keeps a queue for each client and QoS, whose name has both; QoS 2 is granted as 1 there. EMQX 5 and HiveMQ 4 did not run. What
is read of them is what their documents say: EMQX `/api/v5/clients` and `/api/v5/subscriptions` (pages of the API of EMQX Cloud, v5), HiveMQ
`/api/v1/mqtt/clients` (OpenAPI document 4.23.0, cursors in `_links.next`).
"""

from __future__ import annotations

import json
import re
from collections.abc import Callable, Iterator
from typing import Any, Final, NamedTuple
from urllib.error import HTTPError, URLError
from urllib.parse import quote, urljoin, urlsplit
from urllib.request import Request, urlopen

from cqos_core.model.problems import CqosError, describe
from cqos_mqtt.importers.seen_clients import SeenClient

_SECONDS: Final = 30
_MOST_BYTES: Final = 64 * 1024 * 1024
_MOST_PAGES: Final = 10_000
_PAGE: Final = 1000
_HANDLING: Final[dict[object, str]] = {0: "send", 1: "send_if_new", 2: "do_not_send"}
_WORDS: Final = {"SEND": "send", "SEND_IF_NEW_SUBSCRIPTION": "send_if_new", "DO_NOT_SEND": "do_not_send"}
_QUALITIES: Final = {"AT_MOST_ONCE": "0", "AT_LEAST_ONCE": "1", "EXACTLY_ONCE": "2"}
_QUEUE: Final = re.compile(r"mqtt-subscription-(?P<client>.*)qos(?P<qos>[01])", re.DOTALL)
_REFUSED: Final = (401, 403)


class Interface:
    """The management interface of a broker.

    Args:
        url: where it is, ``http://host:port``; a path before ``/api`` is kept.
        authorization: value of the header `Authorization`; empty: none is sent.
    """

    def __init__(self, url: str, authorization: str = "") -> None:
        parts = urlsplit(url)
        if parts.scheme not in {"http", "https"} or not parts.hostname:
            raise CqosError(f"`{url}` is no address of a management interface", "write http://HOST:PORT or https://…")
        if parts.username or parts.password:
            raise CqosError(
                "a password in an address is seen by others", "set CQOS_BROKER_USER and CQOS_BROKER_PASSWORD"
            )
        self.url = url.rstrip("/") + "/"
        self.host = parts.netloc
        self.headers = {"Accept": "application/json", **({"Authorization": authorization} if authorization else {})}

    def get(self, path: str) -> Any:
        """Return the answer to a path below the address.

        Raises:
            CqosError: there is no answer, or it is no JSON.
        """
        url = urljoin(self.url, path.lstrip("/"))
        try:
            with urlopen(Request(url, headers=self.headers), timeout=_SECONDS) as answer:  # noqa: S310 - checked above
                data = answer.read(_MOST_BYTES + 1)
        except HTTPError as error:
            hint = "set CQOS_BROKER_USER and CQOS_BROKER_PASSWORD" if error.code in _REFUSED else ""
            raise CqosError(f"{url} answers {error.code} {error.reason}", hint) from None
        except (URLError, OSError, ValueError) as error:
            raise CqosError(f"{url} cannot be read: {describe(error)}") from None
        if len(data) > _MOST_BYTES:
            raise CqosError(f"{url} answers with more than {_MOST_BYTES} bytes, which is refused")
        try:
            return json.loads(data)
        except ValueError as error:
            raise CqosError(f"{url} does not answer with JSON: {describe(error)}") from None


def emqx(interface: Interface) -> list[SeenClient]:
    """Return the clients of EMQX 5."""
    clients = {}
    for each in _numbered_pages(interface, "api/v5/clients"):
        client = clients[each["clientid"]] = SeenClient(each["clientid"], five=_is_five(each.get("proto_ver")))
        client.settings = _stated(
            clean_start=_flag(each.get("clean_start")),
            keep_alive=_seconds(each.get("keepalive")),
            username=each.get("username"),
            session_expiry_interval=_seconds(each.get("expiry_interval")) if client.five else None,
        )
    for each in _numbered_pages(interface, "api/v5/subscriptions"):
        options = _stated(
            qos=_text(each.get("qos")),
            no_local=_flag(each.get("nl")),
            retain_as_published=_flag(each.get("rap")),
            retain_handling=_HANDLING.get(each.get("rh")),
        )
        clients.setdefault(each["clientid"], SeenClient(each["clientid"])).subscribe(each["topic"], options)
    return list(clients.values())


def hivemq(interface: Interface) -> list[SeenClient]:
    """Return the clients of HiveMQ 4."""
    clients = []
    for each in _linked_pages(interface, "api/v1/mqtt/clients"):
        path = f"api/v1/mqtt/clients/{quote(each['id'], safe='')}"
        details = interface.get(path).get("client") or {}
        connection = details.get("connection") or {}
        client = SeenClient(each["id"], five=_is_five(connection.get("mqttVersion")))
        client.settings = _stated(
            clean_start=_flag(connection.get("cleanStart")),
            keep_alive=_seconds(connection.get("keepAlive")),
            username=connection.get("username"),
            session_expiry_interval=_seconds(details.get("sessionExpiryInterval")) if client.five else None,
        )
        for subscription in _linked_pages(interface, f"{path}/subscriptions"):
            identifier = subscription.get("subscriptionIdentifier")
            options = _stated(
                qos=_QUALITIES.get(str(subscription.get("qos"))),
                no_local=_flag(subscription.get("noLocal")),
                retain_as_published=_flag(subscription.get("retainAsPublished")),
                retain_handling=_WORDS.get(str(subscription.get("retainHandling"))),
                subscription_identifier=_text(identifier) if identifier else None,
            )
            client.subscribe(subscription["topicFilter"], options)
        clients.append(client)
    return clients


def rabbitmq(interface: Interface) -> list[SeenClient]:
    """Return the MQTT clients of RabbitMQ."""
    clients = {}
    for each in interface.get("api/connections"):
        name = (each.get("variable_map") or {}).get("client_id")
        if "MQTT" in str(each.get("protocol")) and name is not None:
            client = clients[name] = SeenClient(name, five=_is_five(re.sub(r"\D", "", str(each["protocol"]))))
            client.settings = _stated(keep_alive=_seconds(each.get("timeout")), username=each.get("user"))
    for each in interface.get("api/bindings"):
        queue = _QUEUE.fullmatch(str(each.get("destination")))
        if queue is not None and each.get("source"):
            client = clients.setdefault(queue["client"], SeenClient(queue["client"]))
            client.subscribe(_filter(str(each.get("routing_key"))), {"qos": queue["qos"]})
    for each in interface.get("api/queues"):
        queue = _QUEUE.fullmatch(str(each.get("name")))
        if queue is not None and queue["qos"] == "1" and queue["client"] in clients:
            # The queue of QoS 1 is deleted with the connection, unless the session is kept.
            clients[queue["client"]].settings["clean_start"] = "true" if each["auto_delete"] else "false"
    return list(clients.values())


def _filter(key: str) -> str:
    """Return the filter that a routing key stands for; RabbitMQ takes a dot in a topic for a slash."""
    return "/".join("+" if level == "*" else level for level in key.split("."))


class Managed(NamedTuple):
    """A broker with a management interface: what asks it, its preset, and what else is known of it."""

    ask: Callable[[Interface], list[SeenClient]]
    presets: tuple[str, ...] = ()
    settings: tuple[tuple[str, str], ...] = ()


BROKERS: Final = {
    "emqx": Managed(emqx, ("emqx",)),
    "hivemq": Managed(hivemq, ("hivemq_ce",)),
    "rabbitmq": Managed(rabbitmq, settings=(("granted_qos", "1"), ("shared_subscription_available", "false"))),
}


def clients_of(broker: str, interface: Interface) -> list[SeenClient]:
    """Return the clients that a broker reports.

    Raises:
        CqosError: it cannot be asked, or its answer has another form than expected.
    """
    try:
        return BROKERS[broker].ask(interface)
    except (KeyError, TypeError, AttributeError, ValueError) as error:
        raise CqosError(
            f"{interface.url} does not answer in the form of {broker} ({describe(error)})", "is it another broker?"
        ) from error


def _numbered_pages(interface: Interface, path: str) -> Iterator[dict[str, Any]]:
    """Yield what all pages of EMQX hold."""
    for page in range(1, _MOST_PAGES + 1):
        answer = interface.get(f"{path}?page={page}&limit={_PAGE}")
        yield from answer["data"]
        meta = answer.get("meta") or {}
        more = meta.get("hasnext", page * _PAGE < meta.get("count", 0))
        if not more or not answer["data"]:
            return


def _linked_pages(interface: Interface, path: str) -> Iterator[dict[str, Any]]:
    """Yield what all pages of HiveMQ hold; each names the next one."""
    following: str | None = path
    for _ in range(_MOST_PAGES):
        if following is None:
            return
        answer = interface.get(following)
        yield from answer.get("items") or ()
        following = (answer.get("_links") or {}).get("next")


def _stated(**values: str | None) -> dict[str, str]:
    return {name: text for name, text in values.items() if text}


def _text(value: object) -> str | None:
    return None if value is None else str(value)


def _flag(value: object) -> str | None:
    return None if value is None else "true" if value else "false"


def _seconds(value: object) -> str | None:
    return None if value is None else f"{value}s"


def _is_five(version: object) -> bool | None:
    """Return whether a version is 5.0: ``5`` and ``MQTTv5``; 3 and 4 stand for 3.1 and 3.1.1."""
    digits = re.sub(r"\D", "", "" if version is None else str(version))
    return digits.startswith("5") if digits else None
