"""Laws of one's own that break what the solvers assume are refused before anything is solved."""

from typing import ClassVar

import jax.numpy as jnp
import pytest

from asperity import Slider
from asperity.errors import InputError
from asperity.laws import Law, RiceRuina, law_parameters, registered
from asperity.laws.consistency import checked_law

NUMBERS = {"mu0": 0.5, "A": 0.013, "B": 0.026, "D0": 4e-7, "V0": 1e-6}


class Sound(RiceRuina):
    """Not of the package, and right."""

    name: ClassVar[str] = "sound"


class TwoRates(Sound):
    def state_rate(self, v, v_plastic, state, w):
        return 2 * super().state_rate(v, v_plastic, state, w)


class NoTuple(Sound):
    def steady_state(self, v):
        return super().steady_state(v)[0]


class Fails(Sound):
    def friction(self, v, state, w):
        raise ValueError("no such thing")


class ByValue(Sound):
    def friction(self, v, state, w):
        return super().friction(v, state, w) if v > 1e-6 else self.mu0


class OneNumber(Sound):
    def friction(self, v, state, w):
        return jnp.mean(super().friction(v, state, w))


class Mixed(Sound):
    def friction(self, v, state, w):
        return super().friction(v, state, w) + 0 * v + jnp.mean(jnp.log(v))


class NotANumber(Sound):
    def friction(self, v, state, w):
        return super().friction(-v, state, w)


class WrongSteadyState(Sound):
    def steady_state(self, v):
        return (super().steady_state(v)[0] + 0.1,)


class Falling(Sound):
    def friction(self, v, state, w):
        return self.mu0 - self.A * jnp.log(v / self.V0) + self.B * state[0]

    log_velocity = Law.log_velocity


class OneText(Sound):
    state_names: ClassVar[str] = "phi"


class Blanks(Sound):
    name: ClassVar[str] = "my law"


@pytest.mark.parametrize(
    ("law", "message"),
    [
        (TwoRates, r"state_rate must return a tuple with an array for each of the 1 .*got 2"),
        (NoTuple, "steady_state must return a tuple .*got no tuple"),
        (Fails, r"friction must work on arrays .*ValueError \(no such thing\)"),
        (ByValue, "friction must work on arrays .*truth value"),
        (OneNumber, r"of the shape of its arguments, got \(\) for \(4,\)"),
        (Mixed, "act on each element for itself"),
        (NotANumber, "must be finite in steady sliding"),
        (WrongSteadyState, "steady_state must be the states at which every rate vanishes"),
        (Falling, "must not decrease with the velocity"),
        (OneText, "state_names must be a tuple of names, got 'phi'"),
        (Blanks, "without blanks and colons, got 'my law'"),
    ],
)
def test_a_law_that_breaks_an_assumption_is_refused(law, message) -> None:
    with pytest.raises(InputError, match=message) as raised:
        Slider(law(**NUMBERS), spring=2e5, load=7.0)
    assert "\n" not in str(raised.value)


def test_sound_laws_pass_with_any_number_of_points() -> None:
    assert Slider(Sound(**NUMBERS), spring=2e5, load=7.0).law.name == "sound"
    many = Sound(**NUMBERS | {"A": jnp.array([[0.01, 0.02]])})
    assert Slider(many, spring=2e5, load=7.0).law.A.shape == (1, 2)


@pytest.mark.parametrize("law", sorted(registered()))
def test_the_laws_of_the_package_would_pass(law) -> None:
    kind = type("Copy", (registered()[law],), {"__module__": "elsewhere"})
    every = {"A": 0.013, "B": 0.026, "alpha": 0.2, "c": 0.2, "V1": 1e-8, "V2": 1e-4, "mu0": 0.5}
    own = {n: every.get(n, 1e-6) for n in law_parameters(kind)}
    own = {n + "_" * (n == "lambda"): value for n, value in own.items()}
    checked_law(kind(**own))
