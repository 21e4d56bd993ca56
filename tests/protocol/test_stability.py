"""A run that begins with unstable sliding says so, and a step to no load is refused."""

import numpy as np
import pytest

from asperity.errors import InputError
from asperity.protocol import Protocol
from asperity.protocol.run import stability_statement


def protocol(ratio, law="rice-ruina", **more):
    # Kc = (B - A) W0/D0 of rigid asperities; 1 + A lambda/D0 less of elastic ones.
    critical = 0.013 * 7 / 4e-7
    return Protocol(
        law=law,
        material="bureau2000",
        steps=("slide for 300 s",),
        start={"velocity": "10 um/s"},
        parameters={"K": ratio * critical, **more.pop("parameters", {})},
        **more,
    )


def test_a_tenth_of_the_critical_stiffness_is_said_to_be_unstable() -> None:
    statement = stability_statement(protocol(0.1))
    assert "K is 0.1 of the critical stiffness" in statement


@pytest.mark.parametrize("ratio", [1.01, 3.0])
def test_nothing_is_said_of_stable_sliding(ratio) -> None:
    assert stability_statement(protocol(ratio)) == ""


@pytest.mark.parametrize(
    ("law", "more"),
    [
        # At 10 um/s, far from rest, regularised friction is Rice-Ruina friction.
        ("regularised", {}),
        ("elasto-plastic", {"solver": {"inertia": True}, "parameters": {"M": 1.6}}),
        ("rice-ruina", {"parameters": {"eta": 500.0}}),
    ],
)
def test_unstable_sliding_without_a_closed_form_is_said_too(law, more) -> None:
    parameters = more.pop("parameters", {})
    unstable = protocol(0.1, law, parameters=dict(parameters), **more)
    stable = protocol(3.0, law, parameters=dict(parameters), **more)
    assert "a disturbance doubles in" in stability_statement(unstable)
    assert stability_statement(stable) == ""


def test_the_rate_of_growth_is_that_of_the_linearised_equations() -> None:
    # Rice-Ruina at K = 0.1 Kc: rates in units of V/D0 are roots of A s^2 + (k + A - B) s + k = 0,
    # k = K D0/W0, from the force's and the age's small changes.
    A, B, D0, V = 0.013, 0.026, 4e-7, 1e-5
    k = 0.1 * (B - A)
    rate = max((-b + s) / (2 * A) for b in [k + A - B] for s in [(b**2 - 4 * A * k) ** 0.5])
    said = stability_statement(protocol(0.1, "regularised"))
    found = float(said.split("doubles in ")[1].split(" s")[0])
    assert found == pytest.approx(np.log(2) * D0 / (V * rate), rel=0.01)


def test_inertia_raises_the_critical_stiffness() -> None:
    # 1 + M V^2/(A W0 D0) with M = 1.6 kg at 1 cm/s.
    heavy = {"solver": {"inertia": True}, "parameters": {"M": 1.6}}
    fast = protocol(1.5, **heavy)
    fast = fast.model_copy(update={"start": {"velocity": "1 cm/s"}})
    assert "is unstable" in stability_statement(fast)
    assert stability_statement(protocol(1.5)) == ""


def test_a_step_to_a_load_below_zero_is_refused() -> None:
    for load in ("-1 N", "0 N"):
        with pytest.raises(InputError, match=r"step 2\.to must be positive"):
            Protocol(
                law="rice-ruina",
                material="bureau2000",
                steps=("slide for 1 s", f"step load to {load}", "slide for 1 s"),
                start={"velocity": "10 um/s"},
                parameters={"K": "0.5 N/um"},
            )
