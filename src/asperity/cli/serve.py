"""``asperity serve``: the page in a browser."""

from __future__ import annotations

import os
import sys

import click

from asperity.cli.options import Count, option, switch

_EPILOG = """\b
Examples:
  asperity serve --open
  asperity serve --port 9000
  asperity serve --law friction.py:MyLaw

\b
The page listens on this machine only and fetches nothing from elsewhere. Ctrl-C
ends it. It needs the extra: make app in a clone, pip install 'asperity[app]' in
an environment.
"""


@click.command(epilog=_EPILOG, short_help="Serve the page in the browser.")
@option(
    "--port",
    "NUMBER",
    "Port to listen on; 0 for any free port.",
    Count(),
    default=8765,
    show_default=True,
)
@option(
    "--law laws",
    "PLACE",
    "A law of your own on the page, as module:Name or file.py:Name; repeatable.",
    multiple=True,
)
@switch("--open opened", "Open the page in the browser.")
def serve(port: int, laws: tuple[str, ...], opened: bool) -> None:
    """Serve the page: explore, map, and look at recordings in a browser."""
    from contextlib import ExitStack

    from asperity.cli.progress import waiting

    starting = ExitStack()
    starting.enter_context(waiting("starting the page"))
    from asperity.app.server import serve as run

    def started(address: str) -> None:
        starting.close()
        click.echo(f"asperity: {address}  (Ctrl-C ends it)", err=True)
        if opened:
            import webbrowser

            webbrowser.open(address)

    with starting:
        run(port, laws=laws, started=started)
    # Without waiting for a program that is just being compiled.
    sys.stderr.flush()
    os._exit(0)
