"""An experiment as text: slider, initial state, and steps."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Annotated, Any, Literal

from pydantic import Field, StrictBool, StrictFloat, StrictInt, ValidationError, WrapValidator

from asperity.errors import InputError, MistakesError
from asperity.loads import ProgrammeStep
from asperity.questions.point import Point
from asperity.questions.record import WHOLE, Record, quantity, shown


class ProtocolError(MistakesError):
    """A protocol that cannot be run: all mistakes in one message."""

    subject = "protocol"


def _each_step_once(steps: Any, fill: Callable[[Any], Any]) -> Any:
    """The steps. A wrong step is one mistake; pydantic would report it for each type of step."""
    try:
        return fill(steps)
    except ValidationError as error:
        # For a table the mistake in the table comes first, before "must be a text".
        ranked = sorted(error.errors(), key=lambda m: "Repeat" not in m["loc"])
        wrong = {m["loc"][0]: m for m in reversed(ranked) if m["loc"]}
        if not wrong:
            raise
        raise ProtocolError(
            [_wrong_step(number, wrong[number]) for number in sorted(wrong)]
        ) from None


def _wrong_step(number: Any, reported: Any) -> InputError:
    raised = reported.get("ctx", {}).get("error")
    if isinstance(raised, InputError):
        return raised
    if isinstance(reported["input"], int) and "repeat" in reported["loc"]:
        rule, got = "be a whole number above zero", shown(reported["input"])
        return InputError(f"step {number + 1}.repeat", rule, got, "correct it")
    return InputError(
        f"step {number + 1}",
        "be a text, or a table of repeat and steps",
        shown(reported["input"]),
        "write it like 'hold 10 s' or { repeat = 3, steps = ['hold 10 s', 'slide for 60 s'] }",
    )


class Repeat(Record):
    """Repeated steps.

    Attributes
    ----------
    repeat : int
        Number of repetitions.
    steps : tuple of str, ProgrammeStep or Repeat
    """

    repeat: Annotated[StrictInt, Field(gt=0), WHOLE]
    steps: tuple[str | Repeat | ProgrammeStep, ...]


class ProtocolStart(Record):
    """Load, velocity and states before the first step.

    Attributes
    ----------
    velocity : float or str
        Pulling velocity (m/s); without `states` the slider is in steady sliding at this velocity.
    load : float or str, optional
        Normal load (N), W0 by default.
    states : tuple of float, optional
        States of the equation of motion, for a start that is not steady sliding; see
        `asperity.transients.transient`.
    """

    velocity: quantity("velocity")  # type: ignore[valid-type]
    load: quantity("force") | None = None  # type: ignore[valid-type]
    states: tuple[StrictFloat, ...] | None = None


class Track(Record):
    """A friction level that varies along the track; see `asperity.laws.uneven_track`.

    Attributes
    ----------
    amplitude : float
        Standard deviation of mu0.
    length : float or str
        Correlation length of mu0 (m).
    exponent : float
        Exponent of the power law of its spectrum at wavenumbers above 1/length.
    origin : float or str
        Position of the slider on the track at the beginning (m).
    """

    amplitude: StrictFloat
    length: quantity("length")  # type: ignore[valid-type]
    exponent: StrictFloat = 2.0
    origin: quantity("length") = 0.0  # type: ignore[valid-type]


class SolverSettings(Record):
    """Settings of the integration and of the output.

    Attributes
    ----------
    inertia : bool
        Whether the mass of the slider counts.
    sampling : float or str, optional
        Samples per second (Hz); the integrator's steps by default.
    rtol : float
        Tolerated relative error of a step.
    method : str
        "auto", "explicit" or "implicit".
    most_steps : float, optional
        Largest number of steps of the integration; that of `asperity.transient` by default.
    """

    inertia: StrictBool = False
    sampling: quantity("frequency", "positive") | None = None  # type: ignore[valid-type]
    rtol: StrictFloat = 1e-9
    method: Literal["auto", "explicit", "implicit"] = "auto"
    most_steps: StrictFloat | None = None


class Experiment(Point):
    """An experiment: slider, initial state, and steps.

    Attributes
    ----------
    law : str
        A registered law.
    steps : tuple of str, ProgrammeStep or Repeat
        Lines such as ``"hold 10 s"``, steps of `asperity.loads`, or blocks of them.
    start : ProtocolStart
    material : str
        Material whose numbers apply where `parameters` has none.
    parameters : mapping of str to float or str
        Numbers of the law, and K, W0, M and eta (radiation damping), by the names of tables.
    solver : SolverSettings
    track : Track, optional
        By default mu0 is the same everywhere.
    tribometer : mapping, optional
        Recording of the run: fields of `Recorder`, ``seed``, and ``sensors``.
    title : str
    folder : Path
        Folder of the files that steps name.
    """

    subject = "protocol"
    mistakes_error = ProtocolError

    law: str
    steps: Annotated[tuple[str | Repeat | ProgrammeStep, ...], WrapValidator(_each_step_once)]
    start: ProtocolStart
    solver: SolverSettings = SolverSettings()
    track: Track | None = None
    tribometer: Mapping[str, Any] | None = None
    title: str = ""
