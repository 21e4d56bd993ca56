"""Stability boundaries: unmodulated limits in closed form, and shooting elsewhere."""

import dataclasses

import numpy as np
import pytest

import asperity as asp
from asperity.branches import boundaries
from asperity.branches.boundaries import BoundaryHalf
from asperity.errors import InputError

pytestmark = pytest.mark.slow

#: Promised relative accuracy of a boundary.
BOUNDARY = 1e-6


@pytest.fixture(scope="module")
def slow(shooting):
    return shooting(K=2e5)


@pytest.fixture(scope="module", autouse=True)
def _long_steps():
    """Each point of a boundary is solved by itself: longer steps leave fewer of them."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(BoundaryHalf, "control", BoundaryHalf.control._replace(longest=0.2))
        yield


@pytest.fixture(scope="module")
def stiffness(slow):
    """Boundary in epsilon and K under fast modulation."""
    return asp.stability_boundary(
        slow.slider,
        x="epsilon",
        y="K",
        x_span=(0, 0.2),
        y_span=("0.1 N/um", "0.3 N/um"),
        velocity=slow.V,
        frequency=slow.frequency,
        lines=2,
    )


def test_without_modulation_the_boundary_is_at_the_critical_stiffness(stiffness, slow):
    (curve,) = stiffness.curves
    assert curve.kind == "Neimark-Sacker"
    at = np.argmin(curve.x)
    assert curve.x[at] == pytest.approx(0, abs=1e-12)
    assert curve.y[at] == pytest.approx(slow.Kc, rel=BOUNDARY)
    critical = slow.V / slow.D0 * np.sqrt((slow.B - slow.A) / slow.A) / (2 * np.pi)
    assert curve.frequency[at] == pytest.approx(critical, rel=BOUNDARY)


def test_modulation_stabilises_softer_springs(stiffness):
    (curve,) = stiffness.curves
    assert stiffness.unsearched == ()
    order = np.argsort(curve.x)
    assert (np.diff(curve.y[order]) < 0).all()
    assert curve.bounds_stability.all()
    assert all("leaves" in end for end in curve.result)


def test_the_boundary_inside_the_rectangle_agrees_with_shooting(stiffness, slow):
    (curve,) = stiffness.curves
    for i in np.linspace(1, len(curve.x) - 2, 3).astype(int):
        here = dataclasses.replace(slow, K=curve.y[i])
        state, monodromy = here.followed(curve.x[i], 10)
        # How fast the growth changes with epsilon says what a change of it means.
        _, beside = here.orbit(state, curve.x[i] * 1.001)
        growth, change = (np.log(np.linalg.det(m)) for m in (monodromy, beside))
        assert abs(growth / ((change - growth) / 1e-3)) < BOUNDARY


@pytest.mark.long
def test_period_doubling_boundaries_agree_with_shooting(slow):
    boundary = asp.stability_boundary(
        slow.slider,
        x="epsilon",
        y="frequency",
        x_span=(0.15, 0.25),
        y_span=("1.25 Hz", "1.5 Hz"),
        velocity=slow.V,
        lines=2,
    )
    doublings = [c for c in boundary.curves if c.kind == "period doubling"]
    assert doublings
    for curve in doublings:
        np.testing.assert_allclose(curve.frequency, curve.y / 2, rtol=1e-12)
        for i in (1, len(curve.x) // 2):
            here = dataclasses.replace(slow, frequency=curve.y[i])
            state, monodromy = here.followed(curve.x[i], 10)
            _, beside = here.orbit(state, curve.x[i] * 1.001)
            test, other = (1 + np.trace(m) + np.linalg.det(m) for m in (monodromy, beside))
            assert abs(test / ((other - test) / 1e-3)) < BOUNDARY


def test_radiation_damping_lowers_the_critical_stiffness(slow):
    damping = 5e4
    corrected = slow.Kc - damping * slow.V / slow.D0
    branch = asp.continuation(
        slow.slider,
        parameter="K",
        span=(0.8 * corrected, 1.2 * corrected),
        velocity=slow.V,
        epsilon=0,
        frequency=slow.frequency,
        radiation_damping=damping,
    )
    (bifurcation,) = branch.bifurcations
    assert bifurcation.kind == "Neimark-Sacker"
    assert bifurcation.value == pytest.approx(corrected, rel=BOUNDARY)
    assert bifurcation.stability_change == 1


def test_a_dataset_of_curves_has_units(stiffness):
    data = stiffness.to_dataset()
    assert data.y.attrs["units"] == "N/m"
    assert data.y.attrs["long_name"] == "K"
    assert set(data.kind.values) == {"Neimark-Sacker"}


def test_lines_that_are_not_followed_to_their_ends_are_named(slow, monkeypatch):
    """Boundaries on the rest of such a line were missed without a word."""
    plane = {"x": "epsilon", "y": "K", "x_span": (0, 0.01), "y_span": (4e5, 5e5)}
    at = {"velocity": slow.V, "frequency": slow.frequency, "lines": 2}
    monkeypatch.setattr(boundaries.BranchFollower, "begin", lambda self: None)
    none = asp.stability_boundary(slow.slider, **plane, **at)
    lines = [f"K beyond 4e+05 N/m at epsilon = {e}" for e in (0, 0.01)]
    lines += [f"epsilon beyond 0 at K = {K} N/m" for K in ("4e+05", "5e+05")]
    assert none.unsearched == tuple(lines)
    assert none.to_dataset().attrs["unsearched"] == "; ".join(lines)
    assert f"not searched={lines[0]}" in repr(none)


def test_equal_parameters_are_refused(slow):
    with pytest.raises(InputError, match="y must differ from x"):
        asp.stability_boundary(
            slow.slider,
            x="K",
            y="K",
            x_span=(1, 2),
            y_span=(1, 2),
            velocity=1e-6,
            epsilon=0.1,
            frequency=120.0,
        )
