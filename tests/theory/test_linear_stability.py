"""Decay of states and critical stiffness, against closed forms and roots of the equations."""

import numpy as np
import pytest

from asperity.errors import InputError
from asperity.laws import ElastoPlastic, ElastoPlasticAge, PrakashClifton, TwoState, registered
from asperity.theory import closed_forms
from asperity.theory.linear_stability import critical_stiffness, decay_rates, sliding_threshold

A, B, D0, V0 = 0.008, 0.009, 3e-6, 1e-6
NUMBERS = {"mu0": 0.6, "A": A, "B": B, "D0": D0, "V0": V0}
LAWS = ("rice-ruina", "ruina-slip", "perrin-rice-zheng")


def law(name, **changes):
    return registered()[name](**(NUMBERS | changes))


@pytest.mark.parametrize("name", LAWS)
def test_states_relax_over_the_memory_length(name):
    np.testing.assert_allclose(decay_rates(law(name), "3 um/s"), [1 / D0], rtol=1e-12)


@pytest.mark.parametrize("name", LAWS)
def test_the_critical_stiffness_of_three_laws_is_the_closed_form(name):
    assert critical_stiffness(law(name), 2e-6) == pytest.approx((B - A) / D0, rel=1e-9)
    assert critical_stiffness(law(name, A=0.01), 2e-6) == 0
    assert closed_forms.critical_stiffness_form(name, elastic=False, inertia=False)


def test_the_critical_stiffness_of_other_laws_agrees_with_special_cases():
    """Elastic asperities by their closed forms; of two states as the larger of two alike."""
    lengths = {"D0": D0, "lambda_": 2e-6}
    small = closed_forms.SmallModulation(
        mu=0.6, A=A, B=B, K=1.0, W0=1.0, V=V0, omega=1.0, **lengths
    )
    for kind, age in ((ElastoPlastic, "slider"), (ElastoPlasticAge, "plastic")):
        closed = closed_forms.critical_stiffness_elastic(small, age)
        got = critical_stiffness(kind(**NUMBERS, lambda_=2e-6), V0)
        assert got == pytest.approx(float(closed), rel=1e-8)
    # Two states of one length are one state of B + B2.
    same = TwoState(**(NUMBERS | {"B": 0.005}), B2=0.004, D2=D0)
    assert critical_stiffness(same, V0) == pytest.approx((B - A) / D0, rel=1e-8)
    # A load memory that relaxes in time, 1e11 times faster than the age: it has no effect.
    loaded = PrakashClifton(**NUMBERS, L=1e-7, V_star=1e-2)
    assert critical_stiffness(loaded, 3e-12) == pytest.approx((B - A) / D0, rel=1e-8)


@pytest.mark.parametrize(
    "change",
    [
        {"B": 0.5 * A, "B2": 1.5 * A, "D2": 7 * D0},  # weakening by the second state alone
        {"B": 1.6 * A, "B2": -0.7 * A, "D2": 9 * D0},  # strengthening, yet unstable
        {"B": 0.5 * A, "B2": 0.2 * A, "D2": 3 * D0},  # stable at any stiffness
        {"B": B, "B2": 0.0, "D2": D0 / 5},
    ],
)
def test_the_threshold_of_two_states_is_where_their_equations_lose_stability(change):
    law = TwoState(**(NUMBERS | change))
    closed = sliding_threshold({"A": A, "D0": D0, **change})
    expected = critical_stiffness(law, V0)
    assert max(float(closed.stiffness), 0.0) == pytest.approx(expected, rel=1e-9)
    a1, product = A - change["B"] - change["B2"], D0 * change["D2"]
    a2 = A * (D0 + change["D2"]) - change["B"] * change["D2"] - change["B2"] * D0
    k = float(closed.stiffness)
    cubic = [A * product, a2 + k * product, a1 + k * (D0 + change["D2"]), k]
    leading = np.roots(cubic)[np.argmax(np.roots(cubic).real)] if k > 0 else 0.0
    assert abs(leading.imag) == pytest.approx(float(closed.wavenumber), rel=1e-9)


def test_the_threshold_of_one_state_is_that_of_the_paper():
    closed = sliding_threshold({"A": A, "B": np.array([B, 0.5 * A]), "D0": D0})
    np.testing.assert_allclose(closed.stiffness, [(B - A) / D0, -0.5 * A / D0], rtol=1e-15)
    np.testing.assert_allclose(closed.wavenumber, [np.sqrt((B - A) / A) / D0, 0.0], rtol=1e-14)


def test_several_interfaces_are_refused_in_one_sentence():
    with pytest.raises(InputError, match=r"law\.A must be one number, got an array"):
        critical_stiffness(law("rice-ruina", A=np.array([0.008, 0.01])), V0)


@pytest.mark.parametrize("share", [0.9, 1.1])
def test_no_spring_stabilises_sliding_on_soft_asperities(share):
    """Spring and asperities in series, with the age on the plastic velocity: k below 1/lambda."""
    length = share * D0 / (B - A)
    series = (B - A) / (D0 - (B - A) * length) if share < 1 else np.inf
    soft = ElastoPlasticAge(**NUMBERS, lambda_=length)
    assert critical_stiffness(soft, V0) == pytest.approx(series, rel=1e-8)
    small = closed_forms.SmallModulation(
        mu=0.6, A=A, B=B, D0=D0, K=1.0, W0=1.0, V=V0, omega=1.0, lambda_=length
    )
    closed = closed_forms.critical_stiffness_elastic(small, "plastic")
    assert float(closed) == pytest.approx(series, rel=1e-8)
