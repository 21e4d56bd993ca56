"""Geometries of rigs: conversion between machine forces and stresses on the sliding surface."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from asperity.arrays import Float
from asperity.tribometer.sensors import Given, convert_fields
from asperity.units import to_radians


@dataclass(frozen=True, kw_only=True)
class DirectShear:
    """One sliding surface: shear stress F/A under the normal stress N/A.

    Parameters
    ----------
    area : float or str
        Area of the surface (m^2).
    """

    area: Given
    surfaces = 1

    def __post_init__(self) -> None:
        convert_fields(self, {"area": ("area", "positive")})

    def stresses(self, shear_force: ArrayLike, normal_force: ArrayLike) -> tuple[Float, Float]:
        """Shear and normal stress (Pa) of the machine's forces (N)."""
        shear, normal = (np.asarray(f, dtype=np.float64) for f in (shear_force, normal_force))
        return shear / (self.surfaces * self.area), normal / self.area

    def forces(self, shear_stress: ArrayLike, normal_stress: ArrayLike) -> tuple[Float, Float]:
        """Shear and normal force of the machine (N) of the stresses (Pa)."""
        shear, normal = (np.asarray(s, dtype=np.float64) for s in (shear_stress, normal_stress))
        return shear * self.surfaces * self.area, normal * self.area


@dataclass(frozen=True, kw_only=True)
class DoubleDirectShear(DirectShear):
    """A block between two blocks: each surface has the normal force, and half the shear force.

    Parameters
    ----------
    area : float or str
        Area of one surface (m^2).
    """

    surfaces = 2


@dataclass(frozen=True, kw_only=True)
class Triaxial:
    """A cylinder with a plane cut at an angle to its axis, under confining pressure.

    Parameters
    ----------
    diameter : float or str
        Diameter of the cylinder (m).
    angle : float or str
        Between the cut and the axis of the cylinder (rad), such as ``"30 deg"``.
    """

    diameter: Given
    angle: Given

    def __post_init__(self) -> None:
        object.__setattr__(self, "angle", to_radians(self.angle, "Triaxial.angle"))
        convert_fields(self, {"diameter": ("length", "positive")})
        for rule in ("positive", "below a right angle"):
            convert_fields(self, {"angle": ("dimensionless", rule)})

    @property
    def area(self) -> float:
        """Area of the cut, an ellipse (m^2)."""
        return float(np.pi * self.diameter**2 / 4 / np.sin(self.angle))

    def stresses(
        self, axial_force: ArrayLike, confining_pressure: ArrayLike, pore_pressure: ArrayLike = 0.0
    ) -> tuple[Float, Float]:
        """Shear and effective normal stress (Pa) on the cut.

        Parameters
        ----------
        axial_force : array_like
            Beyond that of the confining pressure (N): differential stress times cross-section.
        confining_pressure, pore_pressure : array_like
            Pa.
        """
        difference = np.asarray(axial_force, dtype=np.float64) / (np.pi * self.diameter**2 / 4)
        shear = difference / 2 * np.sin(2 * self.angle)
        normal = np.asarray(confining_pressure) + difference * np.sin(self.angle) ** 2
        return shear, normal - np.asarray(pore_pressure)

    def forces(self, shear_stress: ArrayLike, normal_stress: ArrayLike) -> tuple[Float, Float]:
        """Axial force (N) and effective confining pressure (Pa) of the stresses on the cut (Pa)."""
        difference = 2 * np.asarray(shear_stress, dtype=np.float64) / np.sin(2 * self.angle)
        confining = np.asarray(normal_stress) - difference * np.sin(self.angle) ** 2
        return difference * np.pi * self.diameter**2 / 4, confining
