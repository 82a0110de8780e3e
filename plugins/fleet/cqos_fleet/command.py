"""``cqos audit``: the check of a table of endpoints."""

from __future__ import annotations

import atexit
import importlib.util
import os
import sys
from itertools import count
from pathlib import Path
from typing import Final

import click

from cqos_core.cli.errors import say_error
from cqos_core.cli.help import usual
from cqos_core.cli.parameters import (
    Assignment,
    assumptions_option,
    debug_option,
    fail_on_option,
    form_option,
    protocol_option,
    show_option,
)
from cqos_core.model.problems import CqosError
from cqos_core.model.settings import Setting

_ORDER: Final = ("note", "warning", "error")


def _refuse_lacking(feature: str, what: str, *packages: str) -> None:
    """Refuse what needs packages that are not installed.

    Raises:
        MissingError: with the line that installs them.
    """
    lacking = [name for name in dict.fromkeys(packages) if importlib.util.find_spec(name) is None]
    if lacking:
        from cqos_core.model.optional_features import missing

        raise missing(feature, f"{what} needs what is not installed: {', '.join(lacking)}")


@click.command(
    epilog="Exit codes are those of `cqos check`: 0 clean; 1 findings at or above the fail level, or no pair was compared; "
    "2 wrong usage, a source that cannot be read, or no endpoint in it; 3 internal error."
)
@usual("--protocol", "--option", "--show", "--fail-on", "--format", "--findings", "--work", "--spark")
@click.argument("source")
@click.option("--table", default="endpoints", show_default=True, metavar="NAME", help="The table of a database.")
@protocol_option
@assumptions_option
@click.option("--exclude-column", "skip", metavar="COLUMN", multiple=True, help="Leave out a column. Can be repeated.")
@show_option("errors", "warnings", "notes", default=["warnings"])
@fail_on_option("error", "warning", "note", default="error")
@form_option
@click.option(
    "--findings",
    "output",
    metavar="FILE",
    type=click.Path(path_type=Path),
    help="Write all findings to this file, as its ending says: .parquet, .csv, .ndjson or .jsonl.",
)
@click.option(
    "--work",
    metavar="DIR",
    type=click.Path(path_type=Path),
    help="Keep stages in this folder; the next run goes on from there.",
)
@click.option(
    "--memory",
    default="3GB",
    show_default=True,
    metavar="SIZE",
    help="The most memory that DuckDB uses; then it uses files.",
)
@click.option(
    "--engine",
    type=click.Choice(["duckdb", "polars"]),
    default="duckdb",
    show_default=True,
    help="The program that computes with tables.",
)
@click.option("--spark", default="", metavar="URL", help="Run on this Spark cluster, such as spark://host:7077.")
@debug_option
@click.pass_context
def audit(
    ctx: click.Context,
    /,
    *,
    source: str,
    assumptions: tuple[Assignment, ...],
    show: tuple[str, ...],
    form: str,
    fail_on: str,
    **given: object,
) -> None:
    """Check the endpoints of a whole fleet, from a table.

    SOURCE is a file (.parquet, .csv, .ndjson), a DuckDB database (.duckdb), or with --spark also a table of the cluster. It has a row
    for each endpoint, with the columns role and topic; others are protocol, participant, type, profile, system, version, and one for
    each setting. SOURCE may also be a system file, or a folder in which each file is a system.

    \b
    Examples:
      cqos audit endpoints.parquet --protocol ros2
      cqos audit fleet.duckdb --findings findings.parquet
      cqos audit robots/
    """  # noqa: D301 - \b is click's mark for lines that are not to be wrapped
    _refuse_lacking("fleet", "`cqos audit`", "narwhals", "duckdb", "pyarrow", str(given["engine"]))
    if given["spark"]:
        _refuse_lacking("spark", "--spark", "pyspark")
    from cqos_core.cli.exit_codes import FINDINGS, NO_ENDPOINT, NO_PAIR, UNUSABLE
    from cqos_core.cli.progress import Progress
    from cqos_core.matching.pipeline import context
    from cqos_fleet.fleet import WantedAudit, run_audit
    from cqos_fleet.fleet_report import as_json, as_text

    atexit.register(_end_quietly)
    where = context()
    options: dict[str, dict[str, Setting]] = {}
    for each in assumptions:
        options.setdefault(each.owner, {})[each.name] = Setting(each.value)
    severity = min((each.removesuffix("s") for each in show), key=_ORDER.index)
    wanted = WantedAudit(path=source, options=options, severity=severity, **given)  # type: ignore[arg-type] # as the options are declared
    stages = count(1)
    with Progress("reading") as progress:

        def step(what: str, of: int) -> None:
            progress.start(what)
            progress.step(next(stages), of)

        try:
            result = run_audit(wanted, where, step)
        except OSError as error:
            raise CqosError(str(error)) from None
    click.echo(as_json(result) if form == "json" else as_text(result, where), nl=False)
    pairs = sum(result.totals.get(each, 0) for each in ("compatible", "incompatible", "unknown"))
    if not result.totals["endpoints"]:
        say_error(f"{source}: {NO_ENDPOINT}")
        ctx.exit(UNUSABLE)
    if not pairs:
        say_error(NO_PAIR)
    bad = any(_ORDER.index(each.severity) >= _ORDER.index(fail_on) for each in result.causes)
    if bad or not pairs:
        ctx.exit(FINDINGS)


def _end_quietly() -> None:
    """Keep away what DuckDB 2.0 writes to standard error when Python ends: objects that its binding did not free."""
    sys.stderr.flush()
    nowhere = os.open(os.devnull, os.O_WRONLY)
    os.dup2(nowhere, 2)
    os.close(nowhere)
