"""``cqos snapshot dds``: a system of what runs in a domain."""

from __future__ import annotations

import signal
import threading
import time
from contextlib import contextmanager
from functools import partial
from typing import TYPE_CHECKING, Final

import click

from cqos_core.cli.console import emit, say
from cqos_core.cli.errors import say_error
from cqos_core.cli.exit_codes import UNUSABLE
from cqos_core.cli.help import usual
from cqos_core.cli.parameters import color_option, debug_option
from cqos_core.formatters.snapshot_changes import watch_changes
from cqos_core.matching.pipeline import context
from cqos_core.model.finding import plural
from cqos_core.model.problems import describe
from cqos_core.plugins import load_plugins
from cqos_live.dds.snapshot import ros
from cqos_live.dds.snapshot.observed import system_of
from cqos_live.snapshots import SECONDS, check_snapshot, snapshot_options, write_snapshot

if TYPE_CHECKING:
    from collections.abc import Iterator
    from types import FrameType

    from cqos_core.model.system import System
    from cqos_live.dds.snapshot.discovery import Discovery
    from cqos_live.dds.snapshot.seen_endpoints import Seen

_HIGHEST_DOMAIN: Final = 232


@click.command(
    epilog="Exit codes: 0 written; 2 wrong usage, no participant in the domain, or Cyclone DDS is missing or cannot join; 3 internal "
    "error."
)
@usual("--domain", "--seconds", "--watch", "--output")
@click.option(
    "--domain",
    type=click.IntRange(0, _HIGHEST_DOMAIN),
    default=0,
    show_default=True,
    metavar="N",
    help="The DDS domain.",
)
@click.option(
    "--seconds",
    type=SECONDS,
    default=5.0,
    show_default=True,
    metavar="SECONDS",
    help="How long to look. Participants announce themselves every few seconds; Ctrl-C ends it early.",
)
@snapshot_options(5.0)
@color_option
@debug_option
@click.pass_context
def dds(
    ctx: click.Context, *, domain: int, seconds: float, every: float, watch: bool, output: str | None, color: str
) -> None:
    """Write who is in a DDS domain: participants, topics, types and QoS, as discovery tells them.

    Joins the domain with Cyclone DDS, which reads its configuration from CYCLONEDDS_URI. It writes no topic, and reads only
    the one on which ROS 2 tells of its nodes. Endpoints of ROS 2 get their own names. What discovery does not tell stays
    unknown.

    \b
    Examples:
      cqos snapshot dds --domain 7 --output running.yaml
      cqos diff running.yaml --against design.yaml
    """  # noqa: D301 - \b is click's mark for lines that are not to be wrapped
    check_snapshot(output, (), watch=watch)
    if watch:
        _watch(domain, every)
        return
    seen, looked = _look(domain, seconds, color)
    found = f"{plural(len(seen.participants), 'participant')}, {plural(len(seen.endpoints), 'endpoint')}"
    if not seen.endpoints:
        say_error(f"domain {domain}: {found} seen in {looked:.1f} s, so there is nothing to write", choice=color)
        ctx.exit(UNUSABLE)
    say(f"domain {domain}: {found} seen in {looked:.1f} s", severity="note", choice=color)
    system = system_of(seen, with_ros=ros.PROTOCOL in load_plugins().packs)
    write_snapshot(system, f"# What ran in DDS domain {domain}, as discovery tells it.\n", output)


def _watch(domain: int, every: float) -> None:
    """Print what is in a domain, then what changes, until interrupted."""
    discovery, with_ros = _joined(domain), ros.PROTOCOL in load_plugins().packs

    def look() -> System:
        system = system_of(discovery.seen(), with_ros=with_ros)
        system.partial = True
        return system

    with _interruptible() as interrupted:
        for text in watch_changes(look, context(), partial(interrupted.wait, every)):
            emit(text)


def _joined(domain: int) -> Discovery:
    """Join a domain.

    Raises:
        MissingError: Cyclone DDS is not installed.
    """
    try:
        from cqos_live.dds.snapshot.discovery import Discovery
    except ImportError as error:
        from cqos_core.model.optional_features import missing

        what = f"`cqos snapshot dds` needs Cyclone DDS, which is not installed ({describe(error)})"
        raise missing("cyclonedds", what) from None
    return Discovery(domain)


def _look(domain: int, seconds: float, color: str) -> tuple[Seen, float]:
    """Look for some time, or until interrupted; return the participants at the end, and how long it took."""
    began = time.monotonic()
    with _interruptible() as interrupted:
        discovery = _joined(domain)
        say(f"looking into domain {domain} for {seconds:g} s; Ctrl-C ends it early", severity="note", choice=color)
        interrupted.wait(seconds)
        return discovery.seen(), time.monotonic() - began


@contextmanager
def _interruptible() -> Iterator[threading.Event]:
    """Hand out an event that an interrupt sets, in place of ending the command."""
    interrupted = threading.Event()

    def interrupt(_signal: int, _frame: FrameType | None) -> None:
        interrupted.set()

    before = signal.signal(signal.SIGINT, interrupt)
    try:
        yield interrupted
    finally:
        signal.signal(signal.SIGINT, before)
