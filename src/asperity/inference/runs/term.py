"""A recording in the likelihood of a fit."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from copy import copy
from dataclasses import dataclass
from typing import Annotated, Any, Literal

import equinox as eqx
import jax
import numpy as np

from asperity.arrays import Float
from asperity.errors import Argument
from asperity.inference.objective import DataTerm, Residuals
from asperity.inference.runs.blocks import checked_rate
from asperity.inference.runs.cleaning import first_after_changes, most_wrong
from asperity.inference.runs.drive import filled_up
from asperity.inference.runs.gauge import reading_at
from asperity.inference.runs.likelihood import (
    MOST_STEPS,
    RunArrays,
    RunResiduals,
    recorded_friction,
    room_for,
    run_equations,
)
from asperity.inference.runs.noise import (
    added_by_noise,
    added_without,
    innovations,
    largest_departure,
    misfit_after_changes,
    whiteness,
    wrong_samples,
)
from asperity.inference.runs.run import RecordedRun
from asperity.inference.unknowns import Prior, Unknown
from asperity.laws import Law
from asperity.parameters import Parameter, law_parameters
from asperity.parameters.arguments import at_least, number, typed
from asperity.recording.defects.autoregression import Autoregression, fitted

#: The model of the noise fails if white innovations have a lower probability.
_NOT_WHITE = 1e-3
#: Correlation of neighbouring samples under a slow drift.
_SLOW = 0.999
#: Iterations for the noise at given parameters, and smallest relative eigenvalue of the fitted
#: curve that counts.
_NOISE_STEPS, _SEEN = 3, 1e-10
#: Times of velocity changes are known to this many sampling intervals.
_CUT_INTERVALS = 2.0
#: The law fails if such large innovations after changes have a lower probability.
_LAW_FAILS = 1e-4
#: A sample with a larger leverage alone determines a delay. In 60 recordings of compliant
#: machines no sample next to a change has more than 0.65; on stiff machines half of them have more
#: than 0.9, and intervals that count those above 0.99 are too narrow.
_ALONE = 0.99
#: Largest number of spikes, or other samples, that a warning names.
_NAMED = 5

Linear = Literal["offset", "trend", "bend", "drift"]


@typed
@dataclass(frozen=True)
class RunOptions:
    """Options of the comparison of recorded runs with the motion.

    Attributes
    ----------
    linear : tuple of str
        Linear nuisances of each run: "offset", "trend" (over slip), "bend" (over the square of the
        slip) or "drift" (over time).
    initial : {"steady", "free"}
        Whether runs begin in steady sliding.
    gauge : (int, float), optional
        Order and corner frequency (Hz) of the low-pass of the force gauge.
    order : int, optional
        Order of the autoregressive noise; by default the data choose it.
    fit_rate : float or str, optional
        Number of block means per second (Hz) that replace the samples, or "full" for every sample.
        By default recordings of up to 20,000 samples are compared sample by sample, and longer ones
        by means over blocks that are short enough to resolve their changes.
    """

    linear: tuple[Linear, ...] = ("offset", "trend")
    initial: Literal["steady", "free"] = "steady"
    gauge: tuple[Annotated[int, at_least(1)], float] | None = None
    order: Annotated[int, at_least(0)] | None = None
    fit_rate: float | str | None = None

    def __post_init__(self) -> None:
        checked_rate(self.fit_rate)
        if self.gauge is not None:
            number(self.gauge[1], "gauge", "frequency", "positive")


class RunTerm(DataTerm):
    """A recorded run as a `DataTerm` of an objective.

    Linear nuisances, such as the offset of the gauge and a trend over slip, are eliminated by
    projection: the residuals are those at their best values, under flat priors.

    Parameters
    ----------
    run : RecordedRun
    law : type of Law
    fixed : mapping of str to float
        Parameters of the law and the machine that are not free, in SI.
    options : RunOptions
    nuisances : tuple of Unknown
        Delays of the velocity changes, the stiffness, the gain of the gauge, and departures of the
        initial states.
    suffix : str
        End of the names of the nuisances, which tells those of several runs apart.
    inertia, radiation_damping : bool

    Attributes
    ----------
    models : list of Autoregression
        Noise of each stretch with one sampling rate.
    basis : array, shape (n, columns)
        Whitened linear nuisances, orthonormal.
    """

    failure = (
        "no start gives a motion through the whole recording: sliding is unstable, or too fast to "
        "compute; give start values with a stiffness above the critical one, or a shorter window"
    )
    observables = ("friction",)

    def __init__(
        self,
        run: RecordedRun,
        law: type[Law],
        fixed: Mapping[str, float],
        options: RunOptions,
        *,
        nuisances: tuple[Unknown, ...] = (),
        suffix: str = "",
        inertia: bool = False,
        radiation_damping: bool = False,
    ) -> None:
        self.run, self.law, self.name = run, law, run.name
        # The load of a recording is measured: a free or fixed W0 is that of a table.
        self._known = {*law_parameters(law), "K", "M", "eps_ratio"}
        self._known |= {"eta"} if radiation_damping else set()
        self.fixed = {n: v for n, v in fixed.items() if n in self._known} | {"W0": run.W0}
        self.options, self.nuisances = options, nuisances
        # Names of the nuisances in the motion.
        shifts = {f"step_time_{k}": f"shift_{edge}" for k, edge in enumerate(run.cuts, start=1)}
        inner = {u.name: u.name.removesuffix(suffix) for u in nuisances}
        self._own = {name: shifts.get(inside, inside) for name, inside in inner.items()}
        # In a list that copies share: the number of steps does not depend on the noise.
        self._room = [room_for(run.drive)]
        self.motion = run_equations(
            law, run.velocity, self.fixed, inertia=inertia, radiation_damping=radiation_damping
        )
        self.reading = reading_at(run.at, options.gauge)
        self._columns = _columns(run, options.linear)
        self._whiteness = math.nan
        self._after_changes = (1.0, 1.0)
        self._alone: tuple[float, ...] = ()
        steps = [np.diff(run.friction[a:b]) for a, b in run.stretches]
        none = np.zeros(0)
        self.models = [Autoregression(none, max(float(np.mean(s**2)) / 2, 1e-300)) for s in steps]
        self._prepare()

    @property
    def profiled(self) -> int:
        """Number of fitted parameters other than coordinates: linear nuisances and the noise."""
        return self._linear + sum(m.order + 1 for m in self.models)

    @property
    def noise(self) -> dict[str, Any]:
        """Order, standard deviation and effective samples of the noise."""
        sizes = [b - a for a, b in self.run.stretches]
        orders = [m.order for m in self.models]
        return {
            "model": "AR(" + ", ".join(map(str, orders)) + ")",
            "samples": int(sum(sizes)),
            "averaged": "" if self.run.blocks is None else self.run.blocks.sentence,
            "effective_samples": round(
                sum(m.effective_samples(n) for m, n in zip(self.models, sizes, strict=True)), 1
            ),
            "lines_removed": [] if self.run.blocks is None else list(self.run.blocks.lines),
            "outliers": self.run.recorded_times(
                sorted({*(self.run.spikes or ()), *(self.run.wrong or ())})
            ).tolist(),
            "jumps": self.run.recorded_times(self.run.jumps or ()).tolist(),
            "whiteness_p": self._whiteness,
            "standard_deviation": [math.sqrt(m.variance) for m in self.models],
        }

    def under_drift(self) -> RunTerm:
        """The term with a slow drift, nearly a random walk, as its noise.

        Under white noise a drift looks like a slow evolution of friction, and the true minimum may
        vanish. If the user has chosen the order 0, the noise stays white.
        """
        if self.options.order == 0:
            return self
        result, slow = copy(self), np.array([_SLOW])
        result.models = [Autoregression(slow, m.variance / (1 - _SLOW**2)) for m in self.models]
        result._prepare()
        return result

    def wrong_samples(self, values: Mapping[str, float]) -> tuple[float, ...]:
        """Times of samples that neither the motion at `values` nor its noise explains."""
        raw = self.departures(values)
        assert raw is not None  # there is a motion at an estimate
        moving = raw[1][:, np.any(raw[1], axis=0)]
        columns = [raw[0][:, None], moving, self._columns[:, : self._linear]]
        white = self._whitened(np.column_stack(columns))
        noise = [m.whitening for m in self.models]
        stretches, most = self.run.stretches, most_wrong(self.run)
        rows = wrong_samples(white[:, 0], white[:, 1:], noise, stretches, most)
        return tuple(self.run.time[rows].tolist())

    def use_search(self, always: bool) -> None:
        """As in `DataTerm`: allow the motion the largest number of steps from now on."""
        self._room[:] = [max(MOST_STEPS, *self._room)] if always else self._room

    def residuals(self, values: Mapping[str, float]) -> Residuals | None:
        """Innovations of the noise; None if the motion cannot be computed."""
        raw = self.departures(values)
        if raw is None:
            return None
        difference, jacobian = raw
        white = self._whitened(np.column_stack([difference, jacobian]), self.basis)
        n = difference.size
        scale = sum(
            m.log_scale(b - a) for m, (a, b) in zip(self.models, self.run.stretches, strict=True)
        )
        # A wrong sample has the density of the smallest departure that makes a sample wrong.
        scale += len(self.run.wrong or ()) * largest_departure(n) ** 2 / 2
        return Residuals(
            white[:, 0], white[:, 1:], np.full(n, "friction"), np.arange(n, dtype=np.intp), scale
        )

    def chi2_of_many(self, values: Sequence[Mapping[str, float]], *, near: bool = False) -> Float:
        """Sums of the squared innovations; see `DataTerm`.

        Near an estimate, an integral needs hundreds of sums: they come from a program without
        derivatives, which is ten times as fast. A search needs too few sums to compile it.
        """
        result = []
        for numbers in values:
            raw = self.departures(numbers, slopes=not near)
            white = np.array([np.inf]) if raw is None else self._whitened(raw[0], self.basis)
            result.append(float(white @ white))
        return np.array(result)

    def observed(self) -> dict[str, Float]:
        """Times and friction."""
        return {"time": self.run.time, "friction": self.run.friction}

    def departures(
        self, values: Mapping[str, float], *, slopes: bool = True
    ) -> tuple[Float, Float] | None:
        """Computed less recorded friction without linear nuisances, and the derivatives.

        Without `slopes` the derivatives are zero.
        """
        inner = self._inner_names(values)
        given = self.fixed | {inside: values[name] for name, inside in inner.items()}
        free = tuple(inner.values()) if slopes else ()
        drive, reading = self.run.drive, self.reading
        computed = recorded_friction(self.motion, given, free, drive, reading, *self._room)
        if computed is None:
            return None
        jacobian = np.zeros((self.run.time.size, len(values)))
        if slopes:
            jacobian[:, [name in inner for name in values]] = computed[1]
        return computed[0] - self.run.friction, jacobian

    def compiled(self, names: tuple[str, ...]) -> tuple[RunResiduals, RunArrays]:
        """As in `DataTerm`."""
        inner, stretches = tuple(self._inner_names(names).items()), tuple(self.run.stretches)
        arrays, equation = eqx.partition(self.motion, eqx.is_array_like)
        return RunResiduals(equation, inner, stretches, *self._room), RunArrays(
            jax.tree.map(np.asarray, arrays),
            {n: np.float64(v) for n, v in self.fixed.items()},
            filled_up(self.run.drive),
            self.reading,
            self.run.friction,
            tuple(m.whitening for m in self.models),
            self.basis,
        )

    def update_noise(self, values: Mapping[str, float]) -> bool:
        """Estimate the noise from the residuals at `values`; False without a motion."""
        raw = self.departures(values)
        if raw is None:
            return False
        for _ in range(_NOISE_STEPS):
            self._estimate_noise(*raw)
        left = raw[0] + self._columns @ self._coefficients(raw[0])
        white = self._whitened(left[:, None])[:, 0]
        innovations = [white[a:b] for a, b in self.run.stretches]
        self._whiteness = whiteness(innovations, max(m.order for m in self.models))
        self._after_changes = misfit_after_changes(white, first_after_changes(self.run))
        return True

    def _estimate_noise(self, difference: Float, jacobian: Float) -> None:
        """One iteration for the noise of the residual, corrected for the fitted parameters."""
        left = difference + self._columns @ self._coefficients(difference)
        curves = np.column_stack([jacobian[:, np.any(jacobian, axis=0)], self._columns])
        white = self._whitened(curves)
        size = np.sqrt(np.einsum("ij,ij->j", white, white))
        # A root of the covariance of the fitted curve; its whitened columns are orthonormal.
        values, vectors = np.linalg.eigh(white.T @ white / np.outer(size, size))
        seen = values > _SEEN * values[-1]
        root = (curves / size) @ (vectors[:, seen] / np.sqrt(values[seen]))
        self.models = [
            fitted(
                [left[a:b]],
                order=self.options.order,
                parameters=round(curves.shape[1] * (b - a) / left.size),
                uncertain=[root[a:b].T],
            )
            for a, b in self.run.stretches
        ]
        self._prepare()

    @property
    def law_fails_after_changes(self) -> bool:
        """Whether the innovations after changes of the drive are too large for the law."""
        return self._after_changes[0] < _LAW_FAILS

    @property
    def doubts(self) -> tuple[str, ...]:
        """Short reasons why intervals from this recording are wrong."""
        doubts = []
        if self.law_fails_after_changes:
            doubts.append(
                f"the computed motion does not fit {self.name} after its velocity changes"
            )
        if self._whiteness < _NOT_WHITE:
            doubts.append(f"the noise of {self.name} is not the process that was fitted")
        return tuple(doubts)

    def uncertainty_of_noise(
        self, values: Mapping[str, float], slopes: Float, covariance: Float
    ) -> tuple[Float, Float]:
        """As in `DataTerm`, with the addition of samples that alone determine a delay.

        If the spring relaxes between two samples, friction jumps, and a delay ends where the jump
        reaches a sample. Close to there the sample seems to determine the delay, as friction at
        this sample is steep in it; on the other side it does not depend on the delay at all.
        """
        raw = self.departures(values)
        assert raw is not None  # there is a motion at the estimate
        curves = raw[1] * slopes
        white = self._whitened(curves)
        share = np.linalg.solve(self._triangle, self.basis.T @ white)
        curves = curves - self._columns @ share
        added, variance = np.zeros_like(covariance), np.zeros(slopes.size)
        for model, (a, b) in zip(self.models, self.run.stretches, strict=True):
            more, spread = added_by_noise(model, curves[a:b], self.basis[a:b], covariance)
            added += more
            variance += spread
        delays = [
            k for k, name in enumerate(values) if self._own.get(name, "").startswith("shift_")
        ]
        rows = np.unique(np.argmax(np.abs(raw[1][:, delays]), axis=0)).tolist()
        white -= self.basis @ (self.basis.T @ white)
        noise = [m.whitening for m in self.models]
        more, alone = added_without(
            rows, white, covariance, noise, self.run.stretches, self.basis, _ALONE
        )
        self._alone = tuple(self.run.time[alone].tolist())
        return added + more, variance

    def fitted_friction(self, values: Mapping[str, float]) -> Float:
        """Friction at the samples by the law with linear nuisances; NaN without a motion.

        Parameters
        ----------
        values : mapping of str to float
            Free parameters and nuisances of the fit, in SI.
        """
        raw = self.departures(values)
        if raw is None:
            return np.full(self.run.time.size, np.nan)
        linear = slice(self._linear)
        shift = self._columns[:, linear] @ self._coefficients(raw[0])[linear]
        return np.asarray(self.run.friction + raw[0] + shift)

    def warnings(
        self, residuals: Residuals, information: Float, outliers: Sequence[int] = ()
    ) -> list[str]:
        """Warnings about the noise, wrong samples, jumps, and misfit after changes."""
        sentences = []
        if self._whiteness < _NOT_WHITE:
            sentences.append(
                f"the noise of {self.name} is not the autoregressive process that was fitted (p = "
                f"{self._whiteness:.2g} for white innovations): the intervals may be too narrow; "
                "look at the residual, leave out stretches, or give a window"
            )
        effective = float(self.noise["effective_samples"])
        if effective < 3 * (len(self.options.linear) + 4):
            sentences.append(
                f"the noise of {self.name} is so slow that its {self.run.time.size} samples count "
                f"as {max(effective, 1):.2g} independent of each other: the intervals are rough; "
                f"give a longer window, or {Argument('drift')} if friction drifts with time"
            )
        if self.run.spikes:
            sentences.append(
                self._sentence_on(self.run.spikes, "sample", "is a spike", "are spikes")
                + ", which no motion of the slider makes; replaced by the line between the "
                "neighbours"
            )
        what = "sample" if self.run.blocks is None else "mean"
        if self.run.wrong:
            sentences.append(
                self._sentence_on(self.run.wrong, what, "is", "are")
                + f" farther from the motion of {self.law.name} than noise reaches, and left out: "
                "if friction itself is so, the law or the drive is not that of the recording"
            )
        if self._alone:
            sentences.append(
                self._sentence_on(self._alone, what, "says", "say")
                + " alone when the velocity of the drive changes there, because friction jumps "
                "between two samples: the intervals are those without it; sample faster"
            )
        if self.run.jumps:
            times = ", ".join(f"{t:.6g}" for t in self.run.recorded_times(self.run.jumps))
            sentences.append(
                f"{self.name} jumps by itself at {times} s, as a gauge does that slips or is "
                "moved: its level there is fitted; look at the recording, or give a window without "
                "it"
            )
        chance, size = self._after_changes
        if self.law_fails_after_changes:
            sentences.append(
                f"what {self.name} shows just after changes of its drive is {size:.2g} times "
                f"as far from the motion as elsewhere (p = {chance:.2g}): the law, the gauge's lag "
                f"({Argument('gauge')}), the drive or its times are not those of the recording, or "
                "a sample there is wrong, and intervals do not hold"
            )
        sentences += [f"{self.name}: {doubt}" for doubt in self.run.doubts]
        return sentences

    def _sentence_on(self, times: Sequence[float], what: str, one: str, several: str) -> str:
        shown = ", ".join(f"{time:.6g}" for time in self.run.recorded_times(times[:_NAMED]))
        shown += ", ..." if len(times) > _NAMED else ""
        those, are = (f"{len(times)} {what}s", several) if len(times) > 1 else (f"a {what}", one)
        return f"{those} of {self.name}, at {shown} s, {are}"

    @property
    def _linear(self) -> int:
        """Number of linear nuisances, whose columns come before those of wrong samples."""
        return len(self.options.linear) + len(self.run.jumps or ())

    def _inner_names(self, names: Iterable[str]) -> dict[str, str]:
        """Parameters that this run depends on, with their names in the motion."""
        shared = self._known - set(self._own.values())
        return {n: self._own.get(n, n) for n in names if n in self._own or n in shared}

    def _prepare(self) -> None:
        self.basis, self._triangle = np.linalg.qr(self._whitened(self._columns))

    def _whitened(self, columns: Float, basis: Float | None = None) -> Float:
        noise = [m.whitening for m in self.models]
        return np.asarray(innovations(columns, noise, self.run.stretches, basis))

    def _coefficients(self, difference: Float) -> Float:
        white = self._whitened(difference[:, None])[:, 0]
        return np.asarray(-np.linalg.solve(self._triangle, self.basis.T @ white))


def _columns(run: RecordedRun, names: Sequence[str]) -> Float:
    """Linear nuisances, the levels after jumps, and an impulse at each wrong sample."""
    known = {
        "offset": np.ones_like(run.slip),
        "trend": run.slip,
        "bend": run.slip * (run.slip - run.slip[-1]),
        "drift": run.time,
    }
    levels = [_behind(run, at) for at in run.jumps or ()]
    wrong = np.unique(run.rows_at(run.wrong or ()))
    impulses = np.zeros((run.time.size, wrong.size))
    impulses[wrong, np.arange(wrong.size)] = 1.0
    return np.column_stack([*(known[n] for n in names), *levels, impulses])


def _behind(run: RecordedRun, at: float) -> Float:
    """Share of each sample, or block, that lies at or after a time."""
    if run.blocks is None:
        return np.asarray(run.time >= at, float)
    begin, end = run.blocks.edges.T
    return np.asarray(np.clip((end - at) / (end - begin), 0.0, 1.0))


def cut_delays(run: RecordedRun, suffix: str) -> list[Unknown]:
    """Delays of the velocity changes as nuisances."""
    result = []
    for k, (edge, sd) in enumerate(zip(run.cuts, run.cut_uncertainty, strict=True), start=1):
        name = f"step_time_{k}{suffix}"
        sd = _CUT_INTERVALS * sd
        near = np.diff(run.drive.edges)[max(edge - 1, 0) : edge + 1].min()
        limit = min(20 * sd, 0.9 * float(near))
        parameter = Parameter(name, "time", "finite", "delay of a velocity change", place="drive")
        result.append(about_zero(parameter, sd, limit, "sampling interval"))
    return result


def about_zero(parameter: Parameter, sd: float, limit: float, source: str) -> Unknown:
    """A nuisance with mean zero and a standard deviation, bounded by plus and minus a limit."""
    prior, start = Prior(0.0, sd, source), (0.0, 0.0)
    return Unknown(parameter, False, sd, -limit, limit, start, 0.0, prior, nuisance=True)
