"""Which columns a measurement takes for load and shear, and with which sign."""

import itertools
from functools import partial

import numpy as np
import pytest

import asperity as asp
from asperity.errors import InputError
from asperity.inference.runs.run import recorded_run
from asperity.recording import Channel, Trace, read
from references.populations import population

measure = partial(asp.measure, modulated=True)
measure_sliding = partial(asp.measure, modulated=False)

UM = 1e-6


@pytest.mark.parametrize("seed", population(3))
def test_a_load_is_read_as_compression_whatever_the_recorder_calls_it(
    truth, protocol, trace, seed
) -> None:
    rng = np.random.default_rng(seed)
    made = truth.but(W0=rng.uniform(2, 40), mean_friction=rng.uniform(0.2, 0.9))
    time, load, force = protocol(made, seed=seed)
    right = measure(trace(time, load, force))
    for signs in itertools.product((1, -1), (1, -1)):
        found = measure(trace(time, signs[0] * load, signs[1] * force))
        said = {c.name: c for c in found.checks}
        assert pytest.approx(made.W0, rel=1e-3) == found.reading.W0
        assert np.allclose(abs(found.reading.harmonics), abs(right.reading.harmonics), rtol=1e-6)
        if signs == (-1, -1):
            # One convention: nothing else differs, and the recording is as good as it was.
            assert np.allclose(found.reading.harmonics, right.reading.harmonics, rtol=1e-6)
            assert found.reading.mean_friction == pytest.approx(right.reading.mean_friction)
            assert said["sign"].verdict == "ok"
            assert "other sign" in said["sign"].sentence
            assert [f.name for f in found.samples.findings] == ["sign"]
            assert found.verdict == right.verdict
        elif signs == (-1, 1):
            assert found.reading.mean_friction == pytest.approx(right.reading.mean_friction)
            assert said["sign"].verdict == "suspicious"
        elif signs == (1, -1):
            assert found.reading.mean_friction == pytest.approx(-right.reading.mean_friction)
            assert said["friction"].verdict == "suspicious"
        else:
            assert "sign" not in said


def stepped(seed):
    """Time, displacement, load, shear and friction of a velocity step, as Channels make them."""
    rng = np.random.default_rng(seed)
    time = np.arange(0, 200, 0.05)
    slip = UM * (time + 9 * np.clip(time - 100, 0, None))
    friction = 0.6 + 0.01 * (time >= 100) * (1 - 2 * np.exp(-(time - 100) / 3))
    friction = friction + 3e-4 * rng.standard_normal(time.size)
    load = 5e6 * (1 + 1e-3 * rng.standard_normal(time.size))
    return time, slip, load, friction * load, friction


def channels(**values):
    kinds = {"slip": ("length", "m"), "mu": ("dimensionless", ""), "Fn": ("force", "N")}
    return {
        name: Channel(v, *kinds.get(name, ("pressure", "Pa")), name) for name, v in values.items()
    }


@pytest.mark.parametrize("signs", [*itertools.product((1, -1), (1, -1))])
def test_signs_of_sliding_are_said_and_the_load_is_positive(signs) -> None:
    time, slip, load, shear, friction = stepped(0)
    made = channels(slip=slip, sigma=signs[0] * load, tau=signs[1] * shear)
    found = measure_sliding(Trace(time, made))
    assert found.load.value == pytest.approx(5e6, rel=1e-3)
    assert found.friction.value == pytest.approx(friction.mean(), rel=1e-6)
    said = [c for c in found.checks if c.name == "sign"]
    assert [c.verdict for c in said] == {
        (1, 1): [],
        (-1, -1): ["ok"],
    }.get(signs, ["suspicious"])
    run = recorded_run(Trace(time, made))
    assert pytest.approx(5e6, rel=5e-3) == run.W0


def written(tmp_path, columns):
    path = tmp_path / "steps.csv"
    rows = zip(*columns.values(), strict=True)
    text = "\n".join(",".join(f"{x:.9g}" for x in row) for row in rows)
    path.write_text(",".join(columns) + "\n" + text + "\n")
    return path


@pytest.mark.parametrize("seed", population(3))
@pytest.mark.parametrize("columns", [None, {"friction": "mu"}])
def test_a_friction_beside_a_shear_without_its_load_is_read(tmp_path, seed, columns) -> None:
    rng = np.random.default_rng(seed)
    time, slip, load, shear, friction = stepped(seed)
    table = {
        "displacement (um)": slip / UM,
        "tau (MPa)": shear / 1e6,
        "mu": friction,
        # In newton it cannot be divided by.
        "Fn (N)": load * 25e-4,
    }
    names = rng.permutation(list(table)[: 3 + seed % 2])
    path = written(tmp_path, {"time (s)": time} | {n: table[n] for n in names})
    found = measure_sliding(read(path, columns=columns))
    assert found.friction.value == pytest.approx(friction.mean(), rel=1e-6)
    (step,) = found.steps
    assert step.time == pytest.approx(100, abs=0.2)
    assert recorded_run(read(path, columns=columns)).friction == pytest.approx(friction, rel=1e-6)


def test_a_friction_that_agrees_with_force_and_load_changes_nothing() -> None:
    time, slip, load, shear, friction = stepped(0)
    alone = measure_sliding(Trace(time, channels(slip=slip, sigma=load, tau=shear)))
    # A correction for a seal of some percent, rounded.
    written = np.round(0.97 * friction, 3)
    both = Trace(time, channels(slip=slip, sigma=load, tau=shear, mu=written))
    assert measure_sliding(both).friction == alone.friction


@pytest.mark.parametrize("factor", [1e-3, 0.5, -3.0, 1e3])
def test_a_friction_that_contradicts_force_and_load_is_asked_about(factor) -> None:
    time, slip, load, shear, friction = stepped(0)
    made = channels(slip=slip, sigma=load, tau=factor * shear, mu=friction)
    with pytest.raises(InputError, match="must agree with the recorded friction") as refused:
        measure_sliding(Trace(time, made))
    # Both ways out are in the sentence, and each is one.
    for role, name, mean in (("F", "tau", abs(factor)), ("friction", "mu", 1.0)):
        assert f"columns={{'{role}': '{name}'}}" in str(refused.value)
        found = measure_sliding(Trace(time, made, roles={role: name}))
        assert found.friction.value == pytest.approx(mean * friction.mean(), rel=1e-6)
