"""What the solvers ask of a modulation."""

from __future__ import annotations

from abc import abstractmethod
from typing import Self

import equinox as eqx
from jax.typing import ArrayLike

from asperity.loads.excitation import Excitation


class Modulation(eqx.Module):
    """One period of an excitation; its arrays carry the operating points along the last axis."""

    @abstractmethod
    def at(self, theta: ArrayLike) -> Excitation:
        """Values and slopes at the phase `theta` (rad)."""

    @property
    @abstractmethod
    def amplitude(self) -> ArrayLike:
        """Amplitude of the first harmonic of W/W0."""

    @abstractmethod
    def scaled(self, share: ArrayLike) -> Self:
        """The modulation with `share` of its amplitude: 0 is steady sliding."""

    @property
    def even(self) -> bool:
        """Whether load, shear force and pulling velocity are known to be even in theta."""
        return False

    @property
    @abstractmethod
    def formula(self) -> str:
        """What is modulated and how, as a text for provenance."""
