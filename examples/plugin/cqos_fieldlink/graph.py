"""``cqos graph``: a command that uses the library of C-QoS."""

from __future__ import annotations

import json

import click

import cqos_core as cqos

_COLORS = {"compatible": "darkgreen", "unknown": "orange", "incompatible": "red"}


@click.command()
@click.argument("paths", nargs=-1, required=True, metavar="PATH...")
def graph(paths: tuple[str, ...]) -> None:
    """Draw who talks to whom, for Graphviz.

    All files are one system. A line is green for a compatible pair, red for an incompatible one.

    Example: cqos graph plant.csv | dot -Tsvg > plant.svg
    """
    # An unreadable file ends the command with exit code 2 and the reason, as in `cqos check`.
    system = cqos.read(*paths)
    report = cqos.check(system)
    owners = {endpoint.id: endpoint.participant for endpoint in system.endpoints}

    def owner(endpoint: str) -> str:
        return _quoted(owners.get(endpoint, endpoint))

    lines = {
        f"  {owner(pair.publisher)} -> {owner(pair.subscriber)}"
        f" [label={_quoted(pair.topic)}, color={_COLORS[pair.verdict]}];"
        for pair in report.pairs
    }
    click.echo("\n".join(["digraph {", *sorted(lines), "}"]))


def _quoted(text: str) -> str:
    return json.dumps(text, ensure_ascii=False)
