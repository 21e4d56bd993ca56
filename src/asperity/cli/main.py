"""The command ``asperity``.

Only click is loaded here; each command is imported when it is called, and loads what it needs when
it runs, so that ``asperity --version`` costs nothing.
"""

from __future__ import annotations

import os
import signal

import click

from asperity._version import __version__
from asperity.cli.shell import Shell

# Set before NumPy is imported. Matrices are small here: the threads of a BLAS mostly wait for each
# other, and on a busy machine reading a recording takes several times as long with them.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
# Set before JAX looks for accelerators, which takes seconds and most of their memory.
os.environ.setdefault("JAX_PLATFORMS", "cpu")

_EPILOG = """\b
Examples:
  asperity samples velocity_steps --out steps.csv
  asperity measure steps.csv
  asperity fit steps.csv --plot fit.png
  asperity reproduce --out report
  asperity response --law elasto-plastic --material bureau2000 \\
      -V "1 um/s" -e 0.24 -f "120 Hz" --json
  asperity response --table points.csv --out responses.csv --material bureau2000
  asperity run protocol.toml --out run.nc --plot run.png
  asperity map --law elasto-plastic --material bureau2000 -V "1 um/s" -f "120 Hz" \\
      --x "epsilon=0.01:0.5:200" --y "K=0.05:0.5:200 N/um" --out map.nc --plot map.png
  asperity sweep plan.toml --out results.zarr
  asperity air --material bureau2000 -f "120 Hz" -f "200 Hz"
  asperity materials bureau2000
  asperity serve --open
"""


@click.group(
    cls=Shell,
    commands={
        "air": "asperity.cli.air",
        "compare": "asperity.cli.fit",
        "design": "asperity.cli.design",
        "fit": "asperity.cli.fit",
        "map": "asperity.cli.map",
        "materials": "asperity.cli.materials",
        "measure": "asperity.cli.measure",
        "recipe": "asperity.cli.papers",
        "reproduce": "asperity.cli.papers",
        "response": "asperity.cli.response",
        "run": "asperity.cli.run",
        "samples": "asperity.cli.samples",
        "serve": "asperity.cli.serve",
        "sweep": "asperity.cli.sweep",
    },
    invoke_without_command=True,
    context_settings={"help_option_names": ["-h", "--help"], "max_content_width": 100},
    epilog=_EPILOG,
)
@click.version_option(__version__, prog_name="asperity")
@click.pass_context
def main(context: click.Context) -> None:
    """Friction of sliding contacts: predict it, measure it in recordings, fit laws to it.

    Responses to modulated loads and to velocity steps, stick-slip, maps, a virtual tribometer, and
    the paper it starts from (Bureau, Baumberger and Caroli, Phys. Rev. E 62, 6810, 2000).

    A quantity is written with its unit ("1 um/s", "120 Hz", "0.2 N/um"); tables hold SI
    numbers, or have units in their headings.
    """
    if context.invoked_subcommand is None:
        click.echo(context.get_help())


def run() -> None:
    """Run the command as a process, which Ctrl-C ends without a word once the command is done."""
    try:
        main(prog_name="asperity")
    finally:
        # Threads and worker processes may take a while to end.
        if signal.getsignal(signal.SIGINT) is signal.default_int_handler:
            signal.signal(signal.SIGINT, signal.SIG_DFL)


if __name__ == "__main__":
    run()
