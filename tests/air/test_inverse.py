"""Patch radius and gap from a measured fraction: round trips, several solutions, none."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, strategies as st

from asperity.air import AirLayer, effective_modulation, gap, patch_radius
from asperity.errors import InputError

SLIDER = {"W0": 7.0, "M": 1.6, "lambda_z": 0.4e-6}
LAYER = AirLayer(P0=1e5, h0=6.5e-6, eta=1e-5, R=3.9e-2)


# Below a radius of 3 mm the air hardly matters, and the inverse is ill-posed.
@given(st.floats(-2.5, 0))
def test_the_inverse_finds_the_radius(log_R):
    ratio = effective_modulation(120.0, **SLIDER, layer=replace(LAYER, R=10**log_R))
    answer = patch_radius(float(ratio), 120.0, **SLIDER, layer=LAYER)
    assert answer.found
    assert answer.result == "found"
    assert answer.solutions == pytest.approx((10**log_R,), rel=1e-8)


@given(st.floats(-8, -4))
def test_the_inverse_finds_the_gap(log_h):
    ratio = effective_modulation(120.0, **SLIDER, layer=replace(LAYER, h0=10**log_h))
    answer = gap(float(ratio), 120.0, **SLIDER, layer=LAYER)
    assert answer.solutions == pytest.approx((10**log_h,), rel=1e-8)


STIFF = AirLayer(P0=1e6, h0=1e-7, eta=1e-5, R=1.0)


@pytest.mark.parametrize("ratio", [3.5, 5.0, 6.0])
def test_above_the_resonance_both_radii_are_found(ratio):
    answer = patch_radius(ratio, 600.0, **SLIDER, layer=STIFF)
    assert len(answer.solutions) == 2
    back = effective_modulation(600.0, **SLIDER, layer=replace(STIFF, R=np.array(answer.solutions)))
    np.testing.assert_allclose(back, ratio, rtol=1e-10)


def test_a_resonance_far_narrower_than_the_scan_is_found():
    # An absurd gas whose trapped cushion resonates at |gamma R| = 3e4: the peak is 1e-4 wide in
    # ln R, the scan's step 0.03.
    narrow = AirLayer(P0=1e6, h0=1e-10, eta=1.0, R=1.0)
    answer = patch_radius(1000.0, 600.0, **SLIDER, layer=narrow, bracket=(1e-7, 1.0))
    assert answer.reachable_max > 1000
    assert len(answer.solutions) == 2
    back = effective_modulation(
        600.0, **SLIDER, layer=replace(narrow, R=np.array(answer.solutions))
    )
    np.testing.assert_allclose(back, 1000.0, rtol=1e-8)


def test_a_fraction_out_of_reach_has_the_reachable_range():
    answer = patch_radius(1.2, 120.0, **SLIDER, layer=LAYER)
    assert not answer.found
    assert answer.solutions == ()
    assert answer.reachable_max == pytest.approx(1.054826, abs=1e-6)
    assert answer.result.startswith("no R between 1e-05 and 10 m gives eps_eff/eps = 1.2; there it")
    assert "to 1.05483" in answer.result


def test_the_jump_of_the_free_molecular_model_is_no_solution():
    thin = replace(LAYER, P0=2e3, gas_flow="free-molecular", R=0.2)
    jump = float(thin.mean_free_path)
    sides = effective_modulation(
        120.0, **SLIDER, layer=replace(thin, h0=jump * np.array([0.999, 1.001]))
    )
    middle = float(sides.mean())
    answer = gap(middle, 120.0, **SLIDER, layer=thin, bracket=(jump / 2, jump * 1.01))
    assert sides[0] / sides[1] > 2
    assert answer.solutions == ()


def test_the_fraction_of_the_vacuum_determines_no_gap_and_no_radius():
    """Where the gap is narrower than the mean free path, air without viscosity has no effect."""
    thin = replace(LAYER, P0=2e3, gas_flow="free-molecular", R=0.2)
    vacuum = float(effective_modulation(120.0, **SLIDER))
    for find in (gap, patch_radius):
        answer = find(vacuum, 120.0, **SLIDER, layer=replace(thin, h0=1e-7))
        assert answer.solutions == ()
        assert answer.result.endswith("m gives eps_eff/eps = 1.05483, which does not determine it")
    answer = gap(vacuum, 120.0, **SLIDER, layer=thin)
    first, last = (float(answer.result.split()[i]) for i in (3, 5))
    assert first == 1e-8
    assert last == pytest.approx(float(thin.mean_free_path), rel=0.05)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"ratio": 0.0}, "inverse.ratio must be positive, got 0;"),
        ({"ratio": [[0.4], [0.5, 0.6]]}, "inverse.ratio must"),
        ({"ratio": [0.4, 0.5]}, "inverse.arguments must be single numbers, got an array of shape"),
        (
            {"bracket": (1.0, 1e-3)},
            "inverse.bracket must be two ascending lengths, got .1.0, 0.001",
        ),
        ({"bracket": (1.0,)}, "inverse.bracket must be two ascending lengths"),
        ({"bracket": (0.0, 1.0)}, "inverse.bracket must be positive, got 0 m;"),
        ({"layer": replace(LAYER, P0=np.ones(2))}, "inverse.arguments must be single numbers"),
        ({"W0": -7.0}, "NormalContact.W0 must be positive, got -7 N;"),
    ],
)
def test_bad_input_is_answered_by_one_sentence(change, message):
    arguments = {"ratio": 0.48, "frequency": 120.0, **SLIDER, "layer": LAYER, **change}
    with pytest.raises(InputError, match=message):
        patch_radius(**arguments)
    with pytest.raises(InputError, match=message):
        gap(**arguments)


def test_a_gap_on_a_slope_of_1e_11_is_not_said_to_be_out_of_reach():
    # Beyond the jump of the viscosity the fraction rises by 6e-12, and then falls.
    layer = AirLayer(P0=53.0, h0=1e-6, eta=1.8e-5, R=2.2e-3, gas_flow="free-molecular")
    slider = {"W0": 36.0, "M": 2.2, "lambda_z": 1.5e-6}
    ratio = float(effective_modulation(4.0, **slider, layer=replace(layer, h0=2e-4)))
    answer = gap(ratio, 4.0, **slider, layer=layer)
    assert answer.solutions[-1] == pytest.approx(2e-4, rel=1e-3)
