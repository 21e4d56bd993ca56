"""Normal equations, solved with columns of equal length."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from asperity.errors import InputError

Array = NDArray[np.float64]


def solved(normal: Array, right: Array) -> Array:
    """Solution of normal equations.

    Parameters
    ----------
    normal : array, (p, p)
        Symmetric, positive definite.
    right : array, (p,) or (p, q)

    Returns
    -------
    array
        Of the shape of `right`.
    """
    return inverted(normal) @ right


def inverted(normal: Array) -> Array:
    """Inverse of a symmetric positive definite matrix, (p, p); `InputError` if it has none."""
    with np.errstate(divide="ignore", invalid="ignore"):
        scale = 1 / np.sqrt(np.diagonal(normal))
        equal = normal * scale * scale[:, None]
    try:
        inverse = np.asarray(np.linalg.inv(equal), dtype=np.float64)
    except np.linalg.LinAlgError:
        inverse = np.full_like(equal, np.nan)
    if not np.isfinite(inverse).all():
        raise InputError(
            "lock_in.time must resolve all harmonics and drift terms, got samples that do not; "
            "give a longer window or ask for fewer harmonics"
        )
    return inverse * scale * scale[:, None]
