"""Planted mistakes that other codes have had: the comparison with an integration detects each."""

import dataclasses

import jax.numpy as jnp
import numpy as np
import pytest

from asperity import Slider, periodic_response
from asperity.laws import ElastoPlastic, LinkerDieterich, RiceRuina
from asperity.slider import QuasiStatic
from references.populations import population

#: What a converged point promises, relative.
PROMISED = 1e-8

BASE = {"mu0": 0.5, "A": 0.013, "B": 0.026, "D0": 4e-7, "V0": 1e-6}
LAMBDA, ALPHA = 7e-7, 0.2
K, W0, V, FREQUENCY = 2e5, 7.0, 1e-6, 120.0
EPSILON = np.array([0.02, 0.1])
#: Samples of the waveform, at which the integration is cut into segments.
SEGMENTS = 32
VARIANTS = {
    RiceRuina: {},
    LinkerDieterich: {"alpha": ALPHA},
    ElastoPlastic: {"lambda_": LAMBDA},
}


class ForgottenLoadRate(LinkerDieterich):
    """dPhi/dt without the term in dW/dt."""

    def log_age(self, state, w):
        return state[0]


class OtherLinkerDieterich(LinkerDieterich):
    """alpha W'/W in place of (alpha/B) W'/W."""

    def log_age(self, state, w):
        return state[0] - self.alpha * jnp.log(w)


class StiffeningAsperities(ElastoPlastic):
    """lambda with the wrong sign."""

    @property
    def elastic_length(self):
        return -self.lambda_


class ConstantLoad(RiceRuina):
    """F = W0 mu in place of F = W mu."""

    def log_velocity(self, friction, state, w):
        return super().log_velocity(friction * w, state, w)


class NoElasticAgeing(ElastoPlastic):
    """Age law on the plastic velocity in place of the slider's."""

    def state_rate(self, v, v_plastic, state, w):
        return (self.ageing(v_plastic, state, w),)


#: In every run one in a law; another one is planted in the equation of motion.
MISTAKEN = population(
    [
        (LinkerDieterich, ForgottenLoadRate),
        (LinkerDieterich, OtherLinkerDieterich),
        (ElastoPlastic, StiffeningAsperities),
        (ElastoPlastic, NoElasticAgeing),
        (RiceRuina, ConstantLoad),
    ],
    several=True,
)


def solve(law):
    extra = {"alpha": ALPHA} if issubclass(law, LinkerDieterich) else {}
    extra |= {"lambda_": LAMBDA} if issubclass(law, ElastoPlastic) else {}
    return periodic_response(
        Slider(law(**BASE, **extra), spring=K, load=W0),
        velocity=V,
        epsilon=EPSILON,
        frequency=FREQUENCY,
        waveform=SEGMENTS,
        methods=("fourier",),
    )


def caught(errors):
    """Whether each point is off by far more than promised; one that did not converge is, too."""
    return ~(errors <= 1e3 * PROMISED).all(axis=1)


@pytest.fixture(scope="module")
def truth(reference):
    """The correct law's response and the integration of the published equations."""

    def both(law):
        response = solve(law)
        printed = reference.Printed(V=V, frequency=FREQUENCY, **VARIANTS[law])
        return response, reference.multiple_shooting(printed, EPSILON[:, None], *response.waveform)

    return {law: both(law) for law in VARIANTS}


@pytest.mark.parametrize("law", VARIANTS)
def test_no_mistake_no_alarm(reference, truth, law):
    assert reference.disagreement(*truth[law]).max() < PROMISED


@pytest.mark.parametrize(("law", "mistaken"), MISTAKEN)
def test_planted_mistakes_in_laws_are_detected(reference, truth, law, mistaken):
    errors = reference.disagreement(solve(mistaken), truth[law][1])
    assert caught(errors).all()


def test_a_forgotten_load_rate_in_the_elastic_force_is_detected(reference, truth, monkeypatch):
    original = QuasiStatic.rates

    def forgetful(self, Y, at):
        return original(self, Y, at._replace(w_slope=0.0))

    # A subclass, lest programs compiled for the correct equations be used.
    class Forgetful(ElastoPlastic):
        pass

    monkeypatch.setattr(QuasiStatic, "rates", forgetful)
    errors = reference.disagreement(solve(Forgetful), truth[ElastoPlastic][1])
    assert caught(errors).all()


@pytest.mark.parametrize(
    ("field", "change"),
    [
        ("harmonics", lambda c: 2 * c),
        ("harmonics", np.conj),
        ("harmonics", lambda c: np.roll(c, 1, axis=-1)),
        ("log_multipliers", np.negative),
        ("log_multipliers", lambda m: m * FREQUENCY),
        ("mean_friction", lambda m: m * (1 + 3e-8)),
    ],
)
def test_planted_mistakes_in_results_are_detected(reference, truth, field, change):
    response, expected = truth[RiceRuina]
    wrong = dataclasses.replace(response, **{field: change(getattr(response, field))})
    assert (reference.disagreement(wrong, expected).max(axis=1) > PROMISED).all()
