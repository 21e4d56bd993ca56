"""``asperity samples``: recordings with known truth, made by the virtual tribometer."""

from __future__ import annotations

from pathlib import Path

import click

from asperity.cli.options import Count, option, output_options
from asperity.cli.report import Output
from asperity.errors import require, symbol

_EPILOG = """\b
Examples:
  asperity samples
  asperity samples velocity_steps --out steps.csv
  asperity fit steps.csv --law rice-ruina
"""


@click.command(epilog=_EPILOG)
@click.argument("name", required=False)
@option(
    "--out",
    None,
    "File to write: .csv, .txt, .h5 or .tdms; NAME.csv by default.",
    click.Path(path_type=Path),
)
@option("--seed", None, "Seed of the noise; 0 by default.", Count())
@output_options()
def samples(name: str | None, out: Path | None, seed: int | None, output: Output) -> None:
    """List the sample recordings, or make one of them.

    NAME is a name of the list. The law and the numbers of the simulated slider are printed, with V
    at the start. A fit of the recording should find these numbers, apart from the effects of gauges
    and recorder.
    """
    from asperity import samples as known
    from asperity.operating_point import known_parameters
    from asperity.outputs import output_file
    from asperity.outputs.sections import Section
    from asperity.parameters import DRIVE
    from asperity.recording.writers import check_path, write
    from asperity.units import format_si

    if name is None:
        for given, value in (("--out", out), ("--seed", seed)):
            advice = "name a sample of the list"
            require(value is None, "NAME", f"be given with {given}", "nothing", advice)
        titles = {sample: known.protocol(sample).title for sample in known.names()}
        output.answer(lambda: titles, lambda: [Section("", rows=tuple(titles.items()))], indent="")
        return
    known.path(name)
    target = Path(f"{name}.csv") if out is None else out
    check_path(target, "--out")
    output_file(target, "--out")
    truth = known.protocol(name)
    trace = known.record(name, seed or 0)
    write(trace, target)
    numbers = {key: number.value for key, number in truth.numbers.items()}
    numbers["V"] = truth.programme.level.velocity
    kinds = {**known_parameters(truth.law), **DRIVE}
    rows = tuple((symbol(key), format_si(value, kinds[key].kind)) for key, value in numbers.items())
    made = f"{target}: {len(trace)} samples of {', '.join(trace.channels)}"
    output.answer(
        lambda: {"file": str(target), "law": truth.law, "numbers": numbers},
        lambda: [Section(made, (f"{truth.law}, with the numbers",), rows=rows)],
        truth.law,
    )
