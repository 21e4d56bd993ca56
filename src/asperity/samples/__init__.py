"""Recordings with known truth, made on the spot by the virtual tribometer: nothing is downloaded.

Each is a protocol in this folder, a TOML file as `asperity run` takes it: law, numbers, steps of
the experiment and the instrument. The numbers in it are the truth that a fit of the recording
should give back, within its intervals.

>>> import asperity as asp
>>> trace = asp.samples.velocity_steps(seed=3)
>>> asp.samples.truth("velocity_steps")["A"].value
0.009
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, Annotated

from asperity.errors import require_known
from asperity.parameters.arguments import at_least, typed

if TYPE_CHECKING:
    from asperity.operating_point import SourcedNumber
    from asperity.protocol import Protocol
    from asperity.recording.trace import Trace

_FOLDER = Path(__file__).parent


def names() -> tuple[str, ...]:
    """Kinds of samples, in alphabetical order."""
    return tuple(sorted(path.stem for path in _FOLDER.glob("*.toml")))


@typed
def path(name: str) -> Path:
    """File of a sample's protocol, to be read, copied and changed.

    Raises
    ------
    InputError
        If there is no sample of this name.
    """
    require_known(name, names(), "name", "be a sample")
    return _FOLDER / f"{name}.toml"


@typed
def protocol(name: str) -> Protocol:
    """Law, numbers, steps and instrument of a sample."""
    from asperity.protocol import load_protocol

    return load_protocol(path(name))


@typed
def truth(name: str) -> Mapping[str, SourcedNumber]:
    """Numbers of the simulated slider by name, SI, each with its unit and origin."""
    return protocol(name).numbers


@typed
def record(name: str, seed: Annotated[int, at_least(0)] = 0) -> Trace:
    """Recording of a sample.

    Parameters
    ----------
    name : str
        One of `names`.
    seed : int
        Seed of the noise of the instrument; the same seed makes the same recording.

    Returns
    -------
    Trace
        With law, numbers and steps in its ``provenance``.

    Raises
    ------
    InputError
        If there is no sample of this name, or the seed is no whole number from 0.
    """
    from asperity.protocol import record_run, run_protocol

    wanted = protocol(name)
    assert wanted.setup is not None, f"{name}.toml has no instrument"
    with TemporaryDirectory(prefix="asperity-") as folder:
        motion = Path(folder) / "motion.nc"
        run_protocol(wanted, motion)
        return record_run(replace(wanted.setup, seed=seed), motion)


def velocity_steps(seed: int = 0) -> Trace:
    """1, 10, 1, 10, 1 um/s on a velocity-weakening interface of rock; see `record`."""
    return record("velocity_steps", seed)


def slide_hold_slide(seed: int = 0) -> Trace:
    """Holds of 3 s to 1000 s on the same interface; see `record`."""
    return record("slide_hold_slide", seed)


def load_steps(seed: int = 0) -> Trace:
    """Steps of the normal load by 10 %, then of the velocity; see `record`."""
    return record("load_steps", seed)


def modulated(seed: int = 0) -> Trace:
    """A load modulated by 24 % at 120 Hz, on the slider of Bureau et al. (2000); see `record`."""
    return record("modulated", seed)


def stick_slip(seed: int = 0) -> Trace:
    """Stick-slip of a soft spring on a gauge that rings and has impulses; see `record`."""
    return record("stick_slip", seed)
