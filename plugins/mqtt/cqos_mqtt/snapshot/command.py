"""``cqos snapshot mqtt``: a system of what a broker knows."""

from __future__ import annotations

import base64
import os
import signal
import time
from contextlib import suppress
from functools import partial
from typing import TYPE_CHECKING

import click

from cqos_core.cli.parameters import color_option, debug_option
from cqos_core.cli.sinks import check_targets
from cqos_core.cli.streams import emit, say, write_file
from cqos_core.files.exporting import ExportContext
from cqos_core.files.opening import open_file, read_path
from cqos_core.files.yaml_writer import write
from cqos_core.formatters.changes import watched
from cqos_core.importers.source import ReadContext
from cqos_core.matching.pipeline import context
from cqos_core.model.remarks import plural
from cqos_core.model.system import Broker, ProfileRef, Setting, System
from cqos_core.plugins import load_plugins
from cqos_mqtt.importers import mosquitto_log
from cqos_mqtt.snapshot.brokers import BROKERS, Interface, clients_of
from cqos_mqtt.snapshot.seen import fill

if TYPE_CHECKING:
    from collections.abc import Callable

_EMPTY = 2


@click.command(
    epilog="Exit codes: 0 written; 2 wrong usage, a source that cannot be read, or no endpoint in it; 3 internal error."
)
@click.argument("source", metavar="LOG|URL")
@click.option(
    "--broker",
    type=click.Choice(sorted(BROKERS)),
    help="Whose management interface URL is. A user is taken from CQOS_BROKER_USER and CQOS_BROKER_PASSWORD.",
)
@click.option("--watch", is_flag=True, help="Look again and again, and print what changed, until Ctrl-C.")
@click.option(
    "--seconds",
    type=click.FloatRange(0, 3600, min_open=True),
    default=2.0,
    show_default=True,
    metavar="S",
    help="Time between two looks, with --watch.",
)
@click.option("--output", metavar="FILE", help="Write there rather than to standard output, whole or not at all.")
@color_option
@debug_option
@click.pass_context
def mqtt(
    ctx: click.Context,
    *,
    source: str,
    broker: str | None,
    watch: bool,
    seconds: float,
    output: str | None,
    color: str,
) -> None:
    """Write what a broker knows: its clients, what they subscribe, and what they published.

    LOG is the log of Mosquitto; with `log_type all` it has publications too. URL is the management interface of EMQX 5,
    HiveMQ 4 or RabbitMQ, as http://HOST:PORT; no broker reports there who publishes. What is not reported stays unknown.

    \b
    Examples:
      cqos snapshot mqtt /var/log/mosquitto/mosquitto.log --output running.yaml
      cqos snapshot mqtt http://localhost:18083 --broker emqx --watch
      cqos diff design.yaml running.yaml
    """  # noqa: D301 - \b is click's mark for lines that are not to be wrapped
    check_targets("--output", [] if output is None else [output], [source])
    if watch and output is not None:
        raise click.UsageError("--watch prints changes, so there is nothing to write with --output.", ctx)
    look = _asked(source, broker, ctx)
    plugins = load_plugins()
    if watch:
        # In the background of a shell, a program ignores interrupts unless it asks for them.
        signal.signal(signal.SIGINT, signal.default_int_handler)
        with suppress(KeyboardInterrupt):
            for text in watched(look, context(), partial(time.sleep, seconds)):
                emit(text)
        return
    system = look()
    for note in system.notes:
        say(note.message, severity=note.severity, choice=color)
    found = f"{plural(len(system.participants), 'client')}, {plural(len(system.endpoints), 'endpoint')}"
    if not system.endpoints:
        say(f"{source}: {found} found, so there is nothing to write", severity="error", choice=color)
        ctx.exit(_EMPTY)
    say(f"{source}: {found} found", severity="note", choice=color)
    system.sources = {}
    exported = write(system, ExportContext(plugins.pack, settings={"profiles": "shared"}))
    text = f"# What a broker of MQTT knew, by {source}.\n{exported.text}"
    if output is None:
        emit(text)
    else:
        write_file(output, text)


def _asked(source: str, broker: str | None, ctx: click.Context) -> Callable[[], System]:
    """Return what looks at the source."""
    if "://" not in source:
        if broker is not None:
            raise click.UsageError(f"--broker {broker} is for the address of an interface, not for a log.", ctx)
        return partial(_logged, source)
    if broker is None:
        raise click.UsageError(f"say whose interface it is, with --broker {'|'.join(sorted(BROKERS))}.", ctx)
    user, password = os.environ.get("CQOS_BROKER_USER"), os.environ.get("CQOS_BROKER_PASSWORD", "")
    secret = f"Basic {base64.b64encode(f'{user}:{password}'.encode()).decode()}" if user else ""
    return partial(_reported, broker, Interface(source, secret))


def _logged(path: str) -> System:
    system = mosquitto_log.read(read_path(path), ReadContext(open=open_file))
    system.partial = True
    return system


def _reported(broker: str, interface: Interface) -> System:
    """Return what the management interface of a broker reports."""
    managed = BROKERS[broker]
    settings = {name: Setting(text) for name, text in managed.settings}
    known = Broker(interface.host, "mqtt", settings, tuple(ProfileRef(name) for name in managed.presets))
    return fill(
        System(protocol="mqtt", partial=True), known, clients_of(broker, interface), f"{broker} does not report it"
    )
