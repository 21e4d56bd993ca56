"""Segments of a load and drive programme between break points, as input of compiled programs.

Every number of a segment is an array, never part of the program's structure: two protocols made of
the same kinds of segment run the same compiled program. Times are counted from the beginning of the
segment, so that phases keep their digits in long programmes.
"""

from __future__ import annotations

from abc import abstractmethod
from typing import Any, TypeAlias

import equinox as eqx
import jax
import jax.numpy as jnp
from jax import Array
from jax.typing import ArrayLike

from asperity._jax import configure
from asperity.loads.modulation import Excitation

configure()  # double precision, before any segment makes an array

#: Type of a number of a segment: an array of shape ().
Scalar: TypeAlias = Any


def number(default: float) -> Any:
    """Declare an optional number of a segment."""
    # Arrays, not Python numbers: each Python number would need another compiled program.
    return eqx.field(converter=jnp.asarray, default=default)


class ProgrammeSegment(eqx.Module):
    """Load, shear force and pulling velocity over a length of time.

    Attributes
    ----------
    duration : array, shape ()
        Seconds, positive.
    """

    duration: eqx.AbstractVar[Scalar]

    @abstractmethod
    def at(self, t: ArrayLike, W0: ArrayLike, V: ArrayLike) -> Excitation:
        """Values over `W0` (N) and `V` (m/s); slopes are derivatives with respect to time.

        The shear force acts along the pulling direction, in addition to the spring's.
        """

    def load(self, t: ArrayLike) -> tuple[ArrayLike, ArrayLike]:
        """W (N) and dW/dt (N/s) at the time `t` (s) of the segment."""
        at = self.at(t, 1.0, 1.0)
        return at.w, at.w_slope

    def pull(self, t: ArrayLike) -> ArrayLike:
        """Velocity of the far end of the spring (m/s)."""
        return self.at(t, 1.0, 1.0).pull

    @abstractmethod
    def position(self, t: ArrayLike) -> Array:
        """Displacement of the far end of the spring since the beginning of the segment (m)."""

    @property
    @abstractmethod
    def lowest_load(self) -> float:
        """A lower bound of W (N), exact where it is positive or nearly so."""

    def surely_above(self, load: float) -> float:
        """A time (s) up to which W is larger than `load` (N) for certain."""
        return 0.0

    @property
    @abstractmethod
    def fastest_pull(self) -> float:
        """An upper bound of the size of the pulling velocity (m/s)."""

    @property
    @abstractmethod
    def longest_step(self) -> float:
        """Longest step (s) that misses no change of the programme."""

    def next_kink(self, t: ArrayLike) -> ArrayLike:
        """The next time (s) after `t` at which a step should end."""
        return jnp.inf

    @property
    def period(self) -> float | None:
        """Period of the modulation (s); None without one."""
        return None

    @property
    def constant(self) -> bool:
        """Whether load and pulling velocity are constant."""
        return False


#: W (N) and the pulling velocity (m/s) of a segment at times (s), each by one program.
load_of = jax.jit(lambda segment, t: segment.load(t)[0])
pull_of = jax.jit(lambda segment, t: segment.pull(t))
