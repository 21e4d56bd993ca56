"""`Protocol`: law, numbers and steps of an experiment."""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Mapping
from functools import cached_property
from pathlib import Path
from typing import Annotated, Any, Literal

import numpy as np
from pydantic import PositiveInt, PrivateAttr, ValidationError, WrapValidator, model_validator

from asperity import materials
from asperity.errors import InputError, MistakesError
from asperity.laws import get_law, registered
from asperity.laws.uneven_track import on_uneven_track
from asperity.loads import Programme, ProgrammeStep
from asperity.loads.programme.steps import LoadAndVelocity
from asperity.operating_point import (
    SourcedNumber,
    known_parameters,
    numbers_for,
    refuse_foreign,
    sourced_numbers,
)
from asperity.parameters import MACHINE, known_name, law_parameters
from asperity.parameters.arguments import FilePath, typed
from asperity.protocol.recording import RecordingSetup, setup_of
from asperity.protocol.steps import PlannedStep, check_levels, plan
from asperity.questions.record import Given, Question, Record, quantity, shown, without_unit
from asperity.slider import Slider
from asperity.slider.named import slider_from
from asperity.transients import Trajectory, transient
from asperity.transients.inputs import MOST_STEPS, require_contact
from asperity.transients.trajectory import planned_rows, row_bytes

#: Segments whose values are part of the comparison of two protocols.
_COMPARED = 100


def numbers_of(
    law_name: str,
    stated: Mapping[str, float | str],
    material: str,
    folder: Path,
    inertia: bool,
) -> dict[str, SourcedNumber]:
    """Every number that the motion depends on, in SI.

    Parameters
    ----------
    law_name : str
    stated : mapping of str to float or str
    material : str
        Name, or file relative to `folder`; may be empty.
    folder : Path
    inertia : bool
        Whether a mass is needed.

    Raises
    ------
    InputError
        If law or material are unknown, a name belongs to neither law nor machine, or a
        number is missing or breaks its rule.
    """
    law = get_law(law_name)
    known = {**law_parameters(law), **MACHINE}
    refuse_foreign(law_name, stated)
    for name in stated:
        known_name(name, known, f"parameters.{name}")
    source = materials.load_from(folder, material) if material else None
    numbers = sourced_numbers(stated, source, "protocol", law_name, "parameters")
    return numbers_for(law_name, numbers, known, ("M",) if inertia else (), "parameters")


def slider_of(law_name: str, values: Mapping[str, float]) -> Slider:
    """The slider with these SI values, by name."""
    return slider_from(get_law(law_name), values)


class ProtocolError(MistakesError):
    """A protocol that cannot be run: all mistakes in one message."""

    subject = "protocol"


def _each_step_once(steps: Any, fill: Callable[[Any], Any]) -> Any:
    """The steps; a wrong step is one mistake, which pydantic would report for each kind of step."""
    try:
        return fill(steps)
    except ValidationError as error:
        wrong = {m["loc"][0]: m for m in reversed(error.errors()) if m["loc"]}
        if not wrong:
            raise
        raise ProtocolError(
            [_wrong_step(number, wrong[number]) for number in sorted(wrong)]
        ) from None


def _wrong_step(number: Any, reported: Any) -> InputError:
    raised = reported.get("ctx", {}).get("error")
    if isinstance(raised, InputError):
        return raised
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
        How often.
    steps : tuple of str, ProgrammeStep or Repeat
    """

    repeat: PositiveInt
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
    states: tuple[float, ...] | None = None


class Track(Record):
    """A friction level that varies along the track; see `asperity.laws.uneven_track`.

    Attributes
    ----------
    amplitude : float
        Standard deviation of mu0.
    length : float or str
        Over which mu0 forgets itself (m).
    exponent : float
        Of the power law of its spectrum beyond one over that length.
    origin : float or str
        Where on the track the slider begins (m).
    """

    amplitude: float
    length: quantity("length")  # type: ignore[valid-type]
    exponent: float = 2.0
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
    most_steps : float
        Largest number of steps of the integration.
    """

    inertia: bool = False
    sampling: quantity("frequency", "positive") | None = None  # type: ignore[valid-type]
    rtol: float = 1e-9
    method: Literal["auto", "explicit", "implicit"] = "auto"
    most_steps: float = MOST_STEPS


class Protocol(Question):
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
        Where files that steps name lie.

    Raises
    ------
    ProtocolError
        An `InputError` with all mistakes: steps by their place, counted from 1.
    """

    subject = "protocol"
    mistakes_error = ProtocolError

    law: str
    steps: Annotated[tuple[str | Repeat | ProgrammeStep, ...], WrapValidator(_each_step_once)]
    start: ProtocolStart
    material: str = ""
    parameters: Mapping[str, Given] = {}
    solver: SolverSettings = SolverSettings()
    track: Track | None = None
    tribometer: Mapping[str, Any] | None = None
    title: str = ""
    folder: Path = Path()

    _planned: list[PlannedStep] = PrivateAttr(default_factory=list)
    _numbers: dict[str, SourcedNumber] = PrivateAttr(default_factory=dict)

    @model_validator(mode="after")
    def _free_of_mistakes(self) -> Protocol:
        planned, wrong = plan(self.steps, self.folder)
        self._planned.extend(planned)
        known = known_parameters(self.law if self.law in registered() else None)
        stated = self.parameters.items()
        mistakes = without_unit(
            (f"parameters.{n}", known[n].kind, v) for n, v in stated if n in known
        )
        mistakes += wrong
        try:
            self._numbers.update(self._sourced_numbers())
            level = self._level()
            _ = self.slider
        except InputError as error:
            mistakes.append(error)
        else:
            mistakes += check_levels(planned, level)
        try:
            _ = self.setup
        except InputError as error:
            mistakes.append(error)
        if mistakes:
            raise ProtocolError(mistakes)
        # Mistakes of the programme as a whole, such as steps without duration.
        require_contact(self.programme, self._numbers["W0"].value)
        return self

    def _sourced_numbers(self) -> dict[str, SourcedNumber]:
        return numbers_of(
            self.law, self.parameters, self.material, self.folder, self.solver.inertia
        )

    def _level(self) -> LoadAndVelocity:
        load = self._numbers["W0"].value if self.start.load is None else self.start.load
        return LoadAndVelocity(load, self.start.velocity)

    @property
    def numbers(self) -> dict[str, SourcedNumber]:
        """Parameters in SI by name, with their origins."""
        return dict(self._numbers)

    @cached_property
    def programme(self) -> Programme:
        """Load and drive over time."""
        level = self._level()
        steps = (one.step for one in self._planned)
        return Programme(*steps, load=level.load, velocity=level.velocity, name="start")

    @property
    def lines(self) -> tuple[str, ...]:
        """The lines of the steps, with repetitions expanded."""
        return tuple(one.text for one in self._planned)

    @cached_property
    def slider(self) -> Slider:
        """The law with its parameters, spring, mass and mean load."""
        even = slider_of(self.law, {name: n.value for name, n in self._numbers.items()})
        if self.track is None:
            return even
        law = on_uneven_track(even.law, **self.track.model_dump())
        return Slider(law, spring=even.K, load=even.W0, mass=even.M)

    @cached_property
    def setup(self) -> RecordingSetup | None:
        """Sensors and recorder of the run, None without a tribometer."""
        if self.tribometer is None:
            return None
        K = self._numbers.get("K")  # missing if another mistake prevents the numbers
        return setup_of(self.tribometer, self.solver.sampling, np.nan if K is None else K.value)

    @property
    def integration(self) -> dict[str, Any]:
        """Keyword arguments of `asperity.transients.transient` except slider and programme."""
        eta = self._numbers.get("eta")
        states = self.start.states
        return {
            "initial": "steady" if states is None else np.asarray(states),
            "sampling": self.solver.sampling,
            "inertia": self.solver.inertia,
            "radiation_damping": eta.value if eta is not None and eta.value > 0 else None,
            "rtol": self.solver.rtol,
            "method": self.solver.method,
            "most_steps": self.solver.most_steps,
        }

    @property
    def rows(self) -> float | None:
        """Number of rows of a run; None for the steps of the integrator."""
        return planned_rows(self.solver.sampling, self.programme.duration)

    @property
    def row_bytes(self) -> int:
        """Bytes of a row in the file of a run, at most."""
        return row_bytes(len(self.slider.law.state_names))

    def trajectory(self) -> Trajectory:
        """The whole motion in memory; `run_protocol` writes it to a file block by block."""
        return transient(self.slider, self.programme, **self.integration)

    @cached_property
    def inputs(self) -> dict[str, Any]:
        """Everything that determines the motion except the version, as JSON values by name."""
        import jax

        digest = hashlib.sha256()
        segments: dict[str, Any] = {}
        for number, segment in enumerate(self.programme.segments, start=1):
            digest.update(type(segment).__name__.encode())
            for path, leaf in jax.tree_util.tree_leaves_with_path(segment):
                values = np.asarray(leaf, float)
                digest.update(values.tobytes())
                # A digest represents recordings, which may have millions of samples.
                if values.ndim == 0 and number <= _COMPARED:
                    segments[f"segment {number}{jax.tree_util.keystr(path)}"] = float(values)
        return {
            "law": self.law,
            "parameters": {name: number.value for name, number in self._numbers.items()},
            "start": {**self._level()._asdict(), "states": self.start.states},
            "solver": self.solver.model_dump(),
            "track": None if self.track is None else self.track.model_dump(),
            **segments,
            "programme": digest.hexdigest(),
        }


@typed
def load_protocol(path: FilePath) -> Protocol:
    """Read a protocol from a TOML file.

    Parameters
    ----------
    path : str or path

    Raises
    ------
    InputError
        If the file cannot be read or is not TOML.
    ProtocolError
        An `InputError` that lists all mistakes, with file, step and a valid example.
    """
    return Protocol.from_file(path, folder=Path(path).parent)
