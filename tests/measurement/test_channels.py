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
def test_a_load_of_either_sign_is_read_as_compression(truth, protocol, trace, seed) -> None:
    rng = np.random.default_rng(seed)
    source = truth.but(W0=rng.uniform(2, 40), mean_friction=rng.uniform(0.2, 0.9))
    time, load, force = protocol(source, seed=seed)
    reference = measure(trace(time, load, force))
    right = reference.reading
    for signs in itertools.product((1, -1), (1, -1)):
        measurement = measure(trace(time, signs[0] * load, signs[1] * force))
        reading, checks = measurement.reading, {c.name: c for c in measurement.checks}
        assert pytest.approx(source.W0, rel=1e-3) == reading.W0
        assert np.allclose(abs(reading.harmonics), abs(right.harmonics), rtol=1e-6)
        if signs == (-1, -1):
            # Both channels have the other sign: every number and the verdict stay as they are.
            assert np.allclose(reading.harmonics, right.harmonics, rtol=1e-6)
            assert reading.mean_friction == pytest.approx(right.mean_friction)
            assert checks["sign"].verdict == "ok"
            assert "other sign" in checks["sign"].sentence
            assert [f.name for f in measurement.samples.findings] == ["sign"]
            assert measurement.verdict == reference.verdict
        elif signs == (-1, 1):
            assert reading.mean_friction == pytest.approx(right.mean_friction)
            assert checks["sign"].verdict == "suspicious"
        elif signs == (1, -1):
            assert reading.mean_friction == pytest.approx(-right.mean_friction)
            assert checks["friction"].verdict == "suspicious"
        else:
            assert "sign" not in checks


def stepped(seed):
    """Time, displacement, normal and shear stress, and friction of a velocity step."""
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
def test_sliding_reports_opposite_signs_and_reads_a_positive_load(signs) -> None:
    time, slip, load, shear, friction = stepped(0)
    signals = channels(slip=slip, sigma=signs[0] * load, tau=signs[1] * shear)
    measurement = measure_sliding(Trace(time, signals))
    assert measurement.load.value == pytest.approx(5e6, rel=1e-3)
    assert measurement.friction.value == pytest.approx(friction.mean(), rel=1e-6)
    verdicts = [c.verdict for c in measurement.checks if c.name == "sign"]
    assert verdicts == {(1, 1): [], (-1, -1): ["ok"]}.get(signs, ["suspicious"])
    run = recorded_run(Trace(time, signals))
    assert pytest.approx(5e6, rel=5e-3) == run.W0


def written(tmp_path, columns):
    path = tmp_path / "steps.csv"
    rows = zip(*columns.values(), strict=True)
    text = "\n".join(",".join(f"{x:.9g}" for x in row) for row in rows)
    path.write_text(",".join(columns) + "\n" + text + "\n")
    return path


@pytest.mark.parametrize("seed", population(3))
@pytest.mark.parametrize("columns", [None, {"friction": "mu"}])
def test_recorded_friction_is_read_if_no_load_divides_the_shear(tmp_path, seed, columns) -> None:
    rng = np.random.default_rng(seed)
    time, slip, load, shear, friction = stepped(seed)
    table = {
        "displacement (um)": slip / UM,
        "tau (MPa)": shear / 1e6,
        "mu": friction,
        # A stress cannot be divided by a load in newton.
        "Fn (N)": load * 25e-4,
    }
    names = rng.permutation(list(table)[: 3 + seed % 2])
    path = written(tmp_path, {"time (s)": time} | {n: table[n] for n in names})
    measurement = measure_sliding(read(path, columns=columns))
    assert measurement.friction.value == pytest.approx(friction.mean(), rel=1e-6)
    (step,) = measurement.steps
    assert step.time == pytest.approx(100, abs=0.2)
    assert recorded_run(read(path, columns=columns)).friction == pytest.approx(friction, rel=1e-6)


def test_a_friction_that_agrees_with_force_and_load_changes_nothing() -> None:
    time, slip, load, shear, friction = stepped(0)
    alone = measure_sliding(Trace(time, channels(slip=slip, sigma=load, tau=shear)))
    # Friction corrected for a seal by some percent, and rounded.
    rounded = np.round(0.97 * friction, 3)
    with_friction = Trace(time, channels(slip=slip, sigma=load, tau=shear, mu=rounded))
    assert measure_sliding(with_friction).friction == alone.friction


@pytest.mark.parametrize("factor", population([1e-3, -3.0, 0.5, 1e3], short=2))
def test_a_friction_that_contradicts_force_and_load_is_refused(factor) -> None:
    time, slip, load, shear, friction = stepped(0)
    signals = channels(slip=slip, sigma=load, tau=factor * shear, mu=friction)
    with pytest.raises(InputError, match="must agree with the recorded friction") as refused:
        measure_sliding(Trace(time, signals))
    # The sentence names both remedies, and each works.
    for role, name, mean in (("F", "tau", abs(factor)), ("friction", "mu", 1.0)):
        assert f"columns={{'{role}': '{name}'}}" in str(refused.value)
        measurement = measure_sliding(Trace(time, signals, roles={role: name}))
        assert measurement.friction.value == pytest.approx(mean * friction.mean(), rel=1e-6)
