"""Operating points that all programs solve, and the parameters of their equations."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

import asperity as asp

FREQUENCY = 120.0
SEED = 20000


@dataclass(frozen=True)
class Batch:
    """Operating points of one law with the parameters of Bureau et al. (2000).

    Attributes
    ----------
    law : str
    velocity : array, shape (points,)
        V (m/s).
    epsilon : array, shape (points,)
    """

    law: str
    velocity: np.ndarray
    epsilon: np.ndarray

    def __len__(self) -> int:
        return len(self.velocity)

    def part(self, rows: slice | np.ndarray) -> Batch:
        """Some of the points."""
        return Batch(self.law, self.velocity[rows], self.epsilon[rows])

    def slider(self) -> asp.Slider:
        """The slider for asperity."""
        paper = asp.materials.load("bureau2000")
        return asp.Slider(paper.law(self.law), spring=paper.K, load=paper.W0, mass=paper.M)

    def numbers(self) -> dict[str, np.ndarray]:
        """Dimensionless parameters of the equations in `benchmarks.equations`, each (points,)."""
        slider = self.slider()
        return dimensionless(slider.law, slider.K / slider.W0, self.velocity, self.epsilon)


def dimensionless(
    law: asp.laws.Law, stiffness: float, velocity: np.ndarray, epsilon: np.ndarray
) -> dict[str, np.ndarray]:
    """Parameters of the equations in `benchmarks.equations` for points (n,) and K/W0 (1/m)."""
    omega = 2 * np.pi * FREQUENCY
    numbers = {
        "mu": law.mu0 - (law.B - law.A) * np.log(velocity / law.V0),
        "A": law.A,
        "B": law.B,
        "kappa": velocity * stiffness / omega,
        "ratio": law.elastic_length * stiffness,
        "ageing": velocity / (omega * law.D0),
        "epsilon": epsilon,
    }
    return {name: np.broadcast_to(value, len(velocity)) for name, value in numbers.items()}


def batch(law: str, points: int) -> Batch:
    """V log-uniform in 0.1 to 10 um/s, epsilon uniform in 0.005 to 0.3, at 120 Hz."""
    rng = np.random.default_rng(SEED)
    return Batch(law, 10 ** rng.uniform(-7, -5, points), rng.uniform(0.005, 0.3, points))


def stable_batch(law: str, points: int) -> Batch:
    """Points of the batch that marching in time can solve.

    With the paper's parameters steady sliding is unstable; modulation stabilises it above
    epsilon = 0.15, and a transient dies out over D0/V.
    """
    rng = np.random.default_rng(SEED)
    return Batch(law, rng.uniform(5e-6, 1e-5, points), rng.uniform(0.2, 0.3, points))
