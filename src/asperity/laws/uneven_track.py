"""A friction level that varies along the track: mu0 is a random function of the slider's position.

    mu0(x) = mu0 + s sqrt(2/n) sum_j cos(k_j (x + x0) + p_j),        j = 1 ... n,

with n wavenumbers whose density is the spectrum

    S(k) = s^2 (p - 1) l / (1 + k l)^p,        integral of S over k > 0 = s^2,

constant below k = 1/l and a power law above it: l is the correlation length of the level, and p = 2
is the exponent of a self-affine profile of Hurst exponent 1/2. S is divided into n equal parts, and
each wavenumber lies at a fixed random place within one part; the phases are fixed too. There is
therefore only one track, which never repeats, and x0 is the place on it at which the slider begins
(spectral representation: Shinozuka and Jan, J. Sound Vib. 25, 111, 1972). The level is the law's
mu0 and thus part of the equation of motion; the position is one more state of the law, in units
of l.
"""

from __future__ import annotations

import dataclasses
from functools import cache
from typing import Any, ClassVar

import jax.numpy as jnp
import numpy as np
from jax import Array
from jax.typing import ArrayLike

from asperity.errors import InputError
from asperity.laws.law import Law, State
from asperity.laws.parameter import parameter

#: Name of the state that has no steady value.
POSITION = "position"
#: Modes of the level, their places in the quantiles of the spectrum, and their phases.
_MODES = 32
_random = np.random.default_rng(1972)
_PLACES = (np.arange(_MODES) + _random.random(_MODES)) / _MODES
_PHASES = 2 * np.pi * _random.random(_MODES)


def on_uneven_track(
    law: Law,
    *,
    amplitude: ArrayLike | str,
    length: ArrayLike | str,
    exponent: ArrayLike = 2.0,
    origin: ArrayLike | str = 0.0,
) -> Law:
    """The law on a track along which its mu0 varies, for transients.

    Parameters
    ----------
    law : Law
        With a parameter mu0.
    amplitude : float
        Standard deviation s of the level (dimensionless), not negative.
    length : float or str
        l of the spectrum (m).
    exponent : float
        p of the spectrum, above 1.
    origin : float or str
        Place on the track at which the slider begins (m); levels at places far apart are
        independent.

    Returns
    -------
    Law
        Of a subclass, with the parameters ``track_amplitude``, ``track_length``,
        ``track_exponent`` and ``track_origin`` and the further state ``position``, x/l.

    Raises
    ------
    InputError
        If a value breaks its rule, or the law has no mu0.
    """
    fields = {f.name: getattr(law, f.name) for f in dataclasses.fields(law)}
    if "mu0" not in fields or POSITION in law.state_names:
        raise InputError(
            "track",
            "be that of a law with a mu0 that is the same everywhere",
            f"'{law.name}'",
            "choose another law",
        )
    made = _on_track(type(law))(
        **fields,
        track_amplitude=amplitude,
        track_length=length,
        track_exponent=exponent,
        track_origin=origin,
    )
    if not np.all(np.asarray(made.track_exponent) > 1):
        raise InputError(
            "track.exponent",
            "be above 1",
            f"{made.track_exponent:g}",
            "give one such as 2: the spectrum has a finite power then",
        )
    return made


@cache
def _on_track(base: type[Law]) -> type[Any]:
    """Subclass of a law whose mu0 depends on the position."""

    class OnUnevenTrack(base):  # type: ignore[valid-type, misc]
        __doc__ = f"{base.__name__} with a mu0 that varies along the track."

        state_names: ClassVar[tuple[str, ...]] = (*base.state_names, POSITION)

        track_amplitude: ArrayLike = parameter(
            "law.track_amplitude", "dimensionless", "not negative", symbol="s",
            meaning="standard deviation of mu0 along the track",
        )  # fmt: skip
        track_length: ArrayLike = parameter(
            "law.track_length", "length", symbol="l", meaning="correlation length of mu0"
        )
        track_exponent: ArrayLike = parameter(
            "law.track_exponent", "dimensionless", symbol="p", meaning="exponent of its spectrum"
        )
        track_origin: ArrayLike = parameter(
            "law.track_origin", "length", "finite", symbol="x_0",
            meaning="where on the track the slider begins",
        )  # fmt: skip

        def level(self, position: ArrayLike) -> Array:
            """mu0 at the positions x/l."""
            wavenumber = (1 - _PLACES) ** (-1 / (jnp.asarray(self.track_exponent) - 1)) - 1
            here = jnp.asarray(position + self.track_origin / self.track_length)[..., None]
            waves = jnp.cos(wavenumber * here + _PHASES).sum(-1)
            return self.mu0 + self.track_amplitude * np.sqrt(2 / _MODES) * waves

        def _here(self, state: State) -> tuple[Any, State]:
            """The law with the mu0 of the position, and its states."""
            here = object.__new__(base)
            for field in dataclasses.fields(base):
                object.__setattr__(here, field.name, getattr(self, field.name))
            object.__setattr__(here, "mu0", self.level(state[-1]))
            return here, state[:-1]

        def friction(self, v: ArrayLike, state: State, w: ArrayLike) -> Array:
            """That of the law at the position."""
            here, inner = self._here(state)
            return here.friction(v, inner, w)

        def log_velocity(self, friction: ArrayLike, state: State, w: ArrayLike) -> Array:
            """That of the law at the position."""
            here, inner = self._here(state)
            return here.log_velocity(friction, inner, w)

        def state_rate(
            self, v: ArrayLike, v_plastic: ArrayLike, state: State, w: ArrayLike
        ) -> State:
            """Those of the law, and dx/dt / l."""
            here, inner = self._here(state)
            return (*here.state_rate(v, v_plastic, inner, w), jnp.asarray(v / self.track_length))

        def steady_state(self, v: ArrayLike) -> State:
            """Those of the law at the beginning of the track."""
            start = jnp.zeros_like(jnp.asarray(v, float))
            here, _ = self._here((start,))
            return (*here.steady_state(v), start)

    if base.velocity is not Law.velocity:
        # A law with rest and reversal has them on a track too.
        def velocity(self: Any, friction: ArrayLike, state: State, w: ArrayLike) -> Array:
            here, inner = self._here(state)
            return here.velocity(friction, inner, w)

        OnUnevenTrack.velocity = velocity
    return OnUnevenTrack
