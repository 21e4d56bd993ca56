"""``asperity samples``: recordings with known truth, made by the virtual tribometer."""

from __future__ import annotations

from pathlib import Path

import click

from asperity.cli.options import Count, json_option

_EPILOG = """\b
Examples:
  asperity samples
  asperity samples velocity_steps --out steps.csv
  asperity fit steps.csv --law rice-ruina
"""


@click.command(epilog=_EPILOG)
@click.argument("name", required=False)
@click.option(
    "--out",
    type=click.Path(path_type=Path),
    help="File to write: .csv, .txt, .h5 or .tdms; NAME.csv by default.",
)
@click.option("--seed", type=Count(), default=0, show_default=True, help="Of the noise.")
@json_option()
def samples(name: str | None, out: Path | None, seed: int, as_json: bool) -> int:
    """List the sample recordings, or make one of them.

    NAME is one of the list. Law and numbers of the simulated slider are printed: what a fit of the
    recording should give back.
    """
    from asperity import samples as known
    from asperity.cli.report import to_json
    from asperity.operating_point import known_parameters
    from asperity.outputs import output_file
    from asperity.outputs.tables import aligned
    from asperity.recording.writers import check_path, write
    from asperity.units import format_si

    if name is None:
        titles = {sample: known.protocol(sample).title for sample in known.names()}
        click.echo(to_json(titles) if as_json else aligned(titles.items()))
        return 0
    known.path(name)
    target = Path(f"{name}.csv") if out is None else out
    check_path(target)
    output_file(target, "--out")
    truth = known.protocol(name)
    trace = known.record(name, seed)
    write(trace, target)
    numbers = {key: number.value for key, number in truth.numbers.items()}
    if as_json:
        click.echo(to_json({"file": str(target), "law": truth.law, "numbers": numbers}))
        return 0
    click.echo(f"{target}: {len(trace)} samples of {', '.join(trace.channels)}")
    click.echo(f"{truth.law}, with the numbers")
    kinds = known_parameters(truth.law)
    rows = [(key, format_si(value, kinds[key].kind)) for key, value in numbers.items()]
    click.echo(aligned(rows, indent="  "))
    return 0
