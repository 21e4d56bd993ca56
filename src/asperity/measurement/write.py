"""Write recordings, and measurements as tables, in files that are read back."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

from asperity.errors import require
from asperity.measurement.campaign import table_file, write_rows
from asperity.measurement.measure import Measurement
from asperity.measurement.report import measured_rows
from asperity.measurement.sliding.measure import SlidingMeasurement
from asperity.measurement.stick_slip.measure import StickSlipMeasurement
from asperity.parameters.arguments import FilePath, typed
from asperity.recording import Trace
from asperity.recording.writers import write as write_recording

Measured = Measurement | SlidingMeasurement | StickSlipMeasurement


@typed
def write(
    data: Trace | Measured | Sequence[Measured],
    path: FilePath,
    *,
    units: Mapping[str, str] | None = None,
) -> Path:
    """Write a recording, or measurements as a table: what `asperity.read` or `asperity.fit` takes.

    Parameters
    ----------
    data : Trace, Measurement, SlidingMeasurement or StickSlipMeasurement, or a list of measurements
        A recording, or what `asperity.measure` returns of one or of several. A table has a row for
        each modulated stretch, velocity step, hold and recording of stick-slip, in SI, as
        ``asperity measure --out`` has.
    path : str or path
        Path of a recording (``.csv``, ``.txt``, ``.h5`` or ``.tdms``) or table (``.csv`` or
        ``.nc``).
    units : mapping of str to str, optional
        Unit in which a channel of a recording is written, such as ``{"load": "kN"}``; SI by
        default.

    Returns
    -------
    Path

    Raises
    ------
    InputError
        If the format is unknown, a unit does not fit, or the file cannot be written.

    Examples
    --------
    >>> import asperity as asp
    >>> recording = asp.samples.modulated()
    >>> asp.write(recording, "recording.csv", units={"normal force": "kN"})
    >>> asp.write(asp.measure("recording.csv"), "readings.csv")
    """
    if isinstance(data, Trace):
        return write_recording(data, path, units=units)
    require(not units, "write.units", "go with a recording", "measurements", "leave them out")
    measured = [data] if isinstance(data, Measured) else data
    require(measured, "data", "hold a measurement", "none", "give one")
    # A measurement does not know its file.
    numbered = enumerate(measured, 1)
    rows = [row for number, one in numbered for row in measured_rows(Path(str(number)), one)]
    write_rows(table_file(path, "write.path"), rows, "write.path")
    return Path(path)
