"""`Protocol`: an experiment as text, with its checked numbers, programme and slider."""

from __future__ import annotations

import hashlib
from functools import cached_property
from typing import Any

import numpy as np
from pydantic import PrivateAttr, model_validator

from asperity.errors import Argument, InputError, keys_of_file, require
from asperity.laws import get_law, registered
from asperity.laws.uneven_track import on_uneven_track
from asperity.loads import Programme
from asperity.loads.programme.steps import LoadAndVelocity
from asperity.operating_point import (
    SourcedNumber,
    known_parameters,
    point_numbers,
    refuse_foreign,
)
from asperity.parameters import MACHINE, known_name, law_parameters
from asperity.protocol.recording import RecordingSetup, setup_of
from asperity.protocol.steps import PlannedStep, check_levels, plan
from asperity.questions.experiment import Experiment, ProtocolError
from asperity.questions.record import without_unit
from asperity.slider import Slider
from asperity.slider.parameters import slider_from
from asperity.transients import Trajectory, transient
from asperity.transients.inputs import (
    checked_integration,
    first_checkpoint,
    require_contact,
    require_sliding,
)
from asperity.transients.trajectory import planned_rows, row_bytes

#: Segments whose values are part of the comparison of two protocols.
_COMPARED = 100


#: Fields of a protocol by the arguments of a transient and of an operating point.
FIELDS = {
    "initial": "start.states",
    "numbers": "parameters",
    "programme.load": "start.load",
    "programme.velocity": "start.velocity",
    **{name: f"solver.{name}" for name in ("rtol", "most_steps")},
}


class Protocol(Experiment):
    """An experiment that can be run: its fields, and the numbers and the programme from them.

    Raises
    ------
    ProtocolError
        An `InputError` with all mistakes: steps by their place, counted from 1.
    """

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
        # The programme as a whole may be invalid, such as one without duration.
        with keys_of_file(FIELDS):
            require_contact(self.programme, self._numbers["W0"].value)
            solver = self.integration
            initial, _ = solver.pop("initial"), solver.pop("sampling")
            motion = checked_integration(self.slider, self.programme, **solver).motion
            # The states of steady sliding are not computed here: they need a compilation.
            if isinstance(initial, str):
                require_sliding(self.programme)
            else:
                first_checkpoint(motion, self.programme, initial)
        return self

    def _sourced_numbers(self) -> dict[str, SourcedNumber]:
        """Every number that the motion depends on, in SI."""
        among = {**law_parameters(get_law(self.law)), **MACHINE}
        needed = ("M",) if self.solver.inertia else ()
        advice = "add solver.inertia = true, or leave M out"
        counted, rule = self.solver.inertia or "M" not in self.parameters, "go with inertia"
        require(counted, "parameters.M", rule, "solver.inertia = false", advice)
        with keys_of_file(FIELDS):
            refuse_foreign(self.law, self.parameters)
            for name in self.parameters:
                known_name(name, among, Argument("numbers", key=name))
            return point_numbers(self, "protocol", among, needed)

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
        try:
            return Programme(*steps, load=level.load, velocity=level.velocity, name="start")
        except InputError as error:
            raise error.about(error.field.name.replace("start.steps", "steps")) from None

    @property
    def lines(self) -> tuple[str, ...]:
        """The lines of the steps, with repetitions expanded."""
        return tuple(one.text for one in self._planned)

    @cached_property
    def slider(self) -> Slider:
        """The law with its parameters, spring, mass and mean load."""
        even = slider_from(get_law(self.law), {name: n.value for name, n in self._numbers.items()})
        if self.track is None:
            return even
        try:
            law = on_uneven_track(even.law, **self.track.model_dump())
        except InputError as error:
            raise error.about(error.field.name.replace("law.track_", "track.")) from None
        return Slider(law, spring=even.K, load=even.W0, mass=even.M)

    @cached_property
    def setup(self) -> RecordingSetup | None:
        """Sensors and recorder of the run; None without a tribometer."""
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
            **({} if self.solver.most_steps is None else {"most_steps": self.solver.most_steps}),
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
                # Arrays, which may have millions of samples, are compared by the digest.
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


#: Reads a protocol from a TOML file; raises `InputError`, with all mistakes a `ProtocolError`.
load_protocol = Protocol.from_file
