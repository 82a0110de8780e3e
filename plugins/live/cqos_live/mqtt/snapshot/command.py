"""``cqos snapshot mqtt``: a system of what a broker knows."""

from __future__ import annotations

import base64
import json
import os
import signal
import time
from collections.abc import Callable
from contextlib import suppress
from functools import partial

import click

from cqos_core.cli.console import emit, say
from cqos_core.cli.errors import WrongUsageError, say_error
from cqos_core.cli.exit_codes import UNUSABLE
from cqos_core.cli.help import usual
from cqos_core.cli.parameters import color_option, debug_option
from cqos_core.files.source_files import open_file, read_path
from cqos_core.formatters.snapshot_changes import watch_changes
from cqos_core.matching.pipeline import context
from cqos_core.model.finding import plural
from cqos_core.model.settings import Place, Setting
from cqos_core.model.source import ReadContext
from cqos_core.model.system import Broker, ImportNote, ProfileRef, System
from cqos_live.mqtt.snapshot.brokers import BROKERS, Interface, clients_of
from cqos_live.snapshots import check_snapshot, snapshot_options, write_snapshot
from cqos_mqtt.importers import mosquitto_log
from cqos_mqtt.importers.dynamic_security import UnclearAccessError, access_of, users_of
from cqos_mqtt.importers.seen_clients import fill


@click.command(
    epilog="Exit codes: 0 written; 2 wrong usage, a source that cannot be read, or no endpoint in it; 3 internal error."
)
@usual("--broker", "--security", "--watch", "--every", "--output")
@click.argument("source", metavar="LOG|URL")
@click.option(
    "--broker",
    type=click.Choice(sorted(BROKERS)),
    help="Whose management interface URL is. A user is taken from CQOS_BROKER_USER and CQOS_BROKER_PASSWORD.",
)
@click.option(
    "--security",
    metavar="FILE",
    help="File of Mosquitto's dynamic security plugin, beside LOG: who may publish and subscribe what.",
)
@snapshot_options(2.0)
@color_option
@debug_option
@click.pass_context
def mqtt(
    ctx: click.Context,
    *,
    source: str,
    broker: str | None,
    security: str | None,
    watch: bool,
    every: float,
    output: str | None,
    color: str,
) -> None:
    """Write what a broker knows: its clients, what they subscribe, and what they published.

    LOG is the log of Mosquitto; with `log_type all` it has publications too. URL is the management interface of EMQX 5,
    HiveMQ 4 or RabbitMQ, as http://HOST:PORT; no broker reports there who publishes. What is not reported stays unknown.

    \b
    Examples:
      cqos snapshot mqtt /var/log/mosquitto/mosquitto.log --output running.yaml
      cqos snapshot mqtt mosquitto.log --security /var/lib/mosquitto/dynamic-security.json
      cqos snapshot mqtt http://localhost:18083 --broker emqx --watch
      cqos diff running.yaml --against design.yaml
    """  # noqa: D301 - \b is click's mark for lines that are not to be wrapped
    check_snapshot(output, [source], watch=watch)
    if security is not None and "://" in source:
        raise WrongUsageError(
            "--security is for the log of Mosquitto, not for an interface", "leave --security out", ctx
        )
    look = _asked(source, broker, security, ctx)
    if watch:
        # In the background of a shell, a program ignores interrupts unless it asks for them.
        signal.signal(signal.SIGINT, signal.default_int_handler)
        with suppress(KeyboardInterrupt):
            for text in watch_changes(look, context(), partial(time.sleep, every)):
                emit(text)
        return
    system = look()
    for note in system.notes:
        say(note.message, severity=note.severity, choice=color)
    found = f"{plural(len(system.participants), 'client')}, {plural(len(system.endpoints), 'endpoint')}"
    if not system.endpoints:
        say_error(f"{source}: {found} found, so there is nothing to write", choice=color)
        ctx.exit(UNUSABLE)
    say(f"{source}: {found} found", severity="note", choice=color)
    system.sources = {}
    write_snapshot(system, f"# What a broker of MQTT knew, by {source}.\n", output)


def _asked(source: str, broker: str | None, security: str | None, ctx: click.Context) -> Callable[[], System]:
    """Return what looks at the source."""
    if "://" not in source:
        if broker is not None:
            raise WrongUsageError(
                f"--broker {broker} is for the address of an interface, not for a log", "leave --broker out", ctx
            )
        return partial(_logged, source, security)
    if broker is None:
        raise WrongUsageError(
            f"{source} is an interface, and no broker is named", f"write --broker {'|'.join(sorted(BROKERS))}", ctx
        )
    user, password = os.environ.get("CQOS_BROKER_USER"), os.environ.get("CQOS_BROKER_PASSWORD", "")
    secret = f"Basic {base64.b64encode(f'{user}:{password}'.encode()).decode()}" if user else ""
    return partial(_reported, broker, Interface(source, secret))


def _logged(path: str, security: str | None) -> System:
    system = mosquitto_log.read(read_path(path), ReadContext(open=open_file))
    system.partial = True
    if security is not None:
        _secure(system, security)
    return system


def _secure(system: System, security: str) -> None:
    """Add who may do what, and say which users that may log in did not."""
    file, place = read_path(security), Place(security)
    try:
        seen = {each.settings["username"].text for each in system.participants.values() if "username" in each.settings}
        absent = [f"`{name}`" for name in users_of(file) if name not in seen]
        for broker in system.brokers.values():
            broker.settings["acl"] = Setting(json.dumps(access_of(file), ensure_ascii=False), place)
    except UnclearAccessError as error:
        message = f"{security} is not read as access control: {error}"
        system.notes.append(ImportNote("MQTT941", "warning", message, place))
        return
    if absent:
        message = f"{plural(len(absent), 'user')} of {security} did not connect: {', '.join(absent)}"
        system.notes.append(ImportNote("MQTT947", "note", message, place))


def _reported(broker: str, interface: Interface) -> System:
    """Return what the management interface of a broker reports."""
    managed = BROKERS[broker]
    settings = {name: Setting(text) for name, text in managed.settings}
    known = Broker(interface.host, "mqtt", settings, tuple(ProfileRef(name) for name in managed.presets))
    return fill(
        System(protocol="mqtt", partial=True), known, clients_of(broker, interface), f"{broker} does not report it"
    )
