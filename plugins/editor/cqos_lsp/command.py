"""``cqos lsp``: the language server on standard input and output."""

from __future__ import annotations

import logging
import os
import sys

import click

from cqos_core.cli.errors import WrongUsageError
from cqos_core.cli.parameters import debug_option


@click.command(epilog="Exit codes: 0 ended by the editor; 2 wrong usage.")
@click.option(
    "--stdio", is_flag=True, help="Accepted for clients that pass it; the server always uses standard input and output."
)
@click.option("--trace", metavar="FILE", help="Write what the server and its client send each other to FILE.")
@debug_option
def lsp(*, stdio: bool, trace: str | None) -> None:
    """Serve editors by the Language Server Protocol, on standard input and output.

    The editor starts this command. `docs/editors.md` has the settings of VS Code, Neovim and Helix.
    """
    del stdio
    if trace is not None:
        logging.basicConfig(filename=trace, level=logging.DEBUG, format="%(asctime)s %(name)s %(message)s")
    else:
        logging.disable(logging.CRITICAL)  # pygls would print tracebacks on standard error
    if sys.stdin is None or sys.stdin.isatty():
        raise WrongUsageError(
            "`cqos lsp` is started by an editor, which talks to it on standard input",
            "set up the editor as docs/editors.md says",
        )
    from cqos_lsp.server import make_server  # pygls, which the help does not need

    server = make_server()
    # A print of any library would end up between the messages.
    messages = os.fdopen(os.dup(1), "wb")
    os.dup2(2, 1)
    server.start_io(sys.stdin.buffer, messages)
