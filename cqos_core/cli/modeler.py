"""``cqos modeler``: serve the page for drawing systems, on this machine only."""

from __future__ import annotations

import threading
import webbrowser
from pathlib import Path
from typing import Final

import click

from cqos_core.cli.console import say
from cqos_core.cli.parameters import debug_option, packs_option
from cqos_core.model.problems import CqosError

_HERE: Final = "127.0.0.1"


@click.command(
    epilog="Exit codes: 0 ended by Ctrl-C or a signal; 2 wrong usage, a file that cannot be read, or the page is not in "
    "this installation; 3 internal error."
)
@click.argument("files", metavar="[FILE]...", nargs=-1)
@click.option("--port", type=click.IntRange(0, 65_535), default=0, help="Port of the page.  [default: a free one]")
@click.option("--no-browser", is_flag=True, help="Print the address only.")
@packs_option
@debug_option
def modeler(files: tuple[str, ...], port: int, pack_files: tuple[str, ...], *, no_browser: bool) -> None:
    """Draw a system in the browser, and see while you draw whether its endpoints are compatible.

    The page and its service run on this machine, and serve no other. The page reads and saves the FILEs, and no other files
    by itself. The first diagram opens; the others stand beside it, and are checked with it. A FILE that does not exist yet
    is made by the first save. Ctrl-C ends it.

    \b
    Examples:
      cqos modeler
      cqos modeler examples/smart_agriculture.bpmn
      cqos modeler drone.bpmn station.bpmn
    """  # noqa: D301 - \b is click's mark for lines that are not to be wrapped
    from cqos_core.cli.pack_files import install_packs
    from cqos_core.service.modeler_state import port_secret, run_key, user_secret
    from cqos_core.service.server_process import serve
    from cqos_core.service.settings import Limits, Settings, new_key

    for each in map(Path, files):
        if each.is_dir() or not (each.is_file() or each.absolute().parent.is_dir()):
            wrong = "is a folder" if each.is_dir() else "is in a folder that does not exist"
            raise CqosError(f"{each} {wrong}", "name a diagram, or a new one in a folder that exists")
    install_packs(pack_files)
    named = tuple(str(Path(each).absolute()) for each in files)
    nonce, ticket = new_key(), new_key()
    try:
        secret = user_secret()
    except OSError as error:
        say(f"No draft is kept for the next run: cannot write {error.filename}: {error.strerror}", severity="warning")
        secret = new_key()

    def started(addresses: dict[str, str]) -> None:
        page = f"http://{addresses['web']}/"
        key = run_key(port_secret(secret, int(addresses["web"].rpartition(":")[2])), nonce)
        # The address that is printed holds as long as the modeler runs. Others on this machine can see the one that a
        # browser is started with, so that holds once.
        click.echo(f"The modeler runs at {page}#key={key}\nPress Ctrl-C to stop it.")
        if not no_browser:
            threading.Thread(target=_open, args=(f"{page}#ticket={ticket}",), daemon=True).start()

    settings = Settings(
        listen=f"{_HERE}:0",
        web=f"{_HERE}:{port}",
        modeler=True,
        named=named,
        named_secret=secret,
        named_nonce=nonce,
        named_ticket="" if no_browser else ticket,
        grace=1.0,
        leaving=0.0,
        log_level="error",
        log_format="text",
        limits=Limits(workers=1, session_workers=1, share=1.0),  # one person
    )
    serve(settings, started)


def _open(address: str) -> None:
    if not webbrowser.open(address):
        say("No browser could be started. Open the address above in one.", severity="warning")
