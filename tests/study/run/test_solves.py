"""Each kind of solve gives what its own function gives, or a closed form."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest

import asperity as asp
from asperity import materials
from asperity.errors import InputError
from asperity.study import SweepPlan, job, open_store, run_sweep, store_status
from asperity.study.grid import SweepGrid
from asperity.theory.linear_stability import critical_stiffness
from references.closed_form_sweep import ThisProcess

PMMA = materials.load("bureau2000")
KC = (PMMA.B - PMMA.A) * PMMA.W0 / PMMA.D0


@pytest.fixture(autouse=True)
def _one_thread(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("NPROC", "1")
    job._opened.cache_clear()


def sweep(out: Path, **fields: Any) -> Any:
    plan = SweepPlan(**{"material": "bureau2000", **fields})
    run_sweep(plan, out, workers=ThisProcess())
    return open_store(out)


def test_periodic_responses_of_several_laws(tmp_path: Path) -> None:
    dataset = sweep(
        tmp_path / "s.zarr",
        parameters={"V": "1 um/s", "frequency": "120 Hz"},
        axes={
            "interface": {
                "cases": (
                    {"law": "rice-ruina"},
                    {"law": "linker-dieterich", "alpha": [0.02, 0.2]},
                )
            },
            "K/Kc": {"values": (0.9, 1.5)},
            "epsilon": {"values": (0.1, 0.3, 0.5)},
        },
    )
    assert dataset["law"].values.tolist() == ["rice-ruina", "linker-dieterich", "linker-dieterich"]
    assert np.array_equal(dataset["alpha"], [np.nan, 0.02, 0.2], equal_nan=True)
    assert dataset["K"].values == pytest.approx([0.9 * KC, 1.5 * KC], rel=1e-14)
    for i, law in enumerate((PMMA.law("rice-ruina"), PMMA.law("linker-dieterich"))):
        if i:
            law = type(law)(**{**vars(law), "alpha": 0.02})
        slider = asp.Slider(law, spring=np.array([[0.9], [1.5]]) * KC, load=PMMA.W0)
        alone = asp.periodic_response(
            slider, velocity=1e-6, epsilon=np.array([0.1, 0.3, 0.5]), frequency=120.0
        )
        for name in ("delta_mu", "mu1", "phase2"):
            assert dataset[name][i].values == pytest.approx(getattr(alone, name), rel=1e-8)
        assert np.array_equal(dataset["stable"][i].values == 1, alone.stable)


def test_points_that_cannot_be_solved_say_why(tmp_path: Path) -> None:
    sweep(
        tmp_path / "s.zarr",
        law="rice-ruina",
        parameters={"V": 1e-6, "frequency": 120.0, "K": 3e5, "epsilon": 0.1},
        axes={
            "epsilon2": {"values": (0.0, 1.2)},
            "motion": {"zip": {"inertia": (False, True), "M": (0.0, 0.0)}},
        },
        outputs=("mu1",),
    )
    message = store_status(tmp_path / "s.zarr").outcomes
    # Inertia without mass, and a load that does not stay positive.
    assert message == {"converged": 1, "invalid": 2, "contact_lost": 1}


def test_thresholds_without_modulation_are_the_closed_form(tmp_path: Path) -> None:
    dataset = sweep(
        tmp_path / "s.zarr",
        solve="threshold",
        law="elasto-plastic",
        parameters={"V": 1e-6, "frequency": 120.0, "epsilon": 0.0},
        axes={"lambda": {"values": ("0.1 um", "0.62 um")}, "B": {"values": (0.02, 0.026)}},
        threshold={"between": (0.5, 2.0), "scan": 5},
    )
    lambda_, B = np.meshgrid(dataset["lambda"], dataset["B"], indexing="ij")
    expected = PMMA.D0 / (PMMA.D0 + PMMA.A * lambda_)
    assert dataset["threshold_ratio"].values == pytest.approx(expected, rel=1e-5)
    K = expected * (B - PMMA.A) * PMMA.W0 / PMMA.D0
    assert dataset["K_threshold"].values == pytest.approx(K, rel=1e-5)
    assert (dataset["bifurcation"] == 2).all()


def test_a_threshold_without_a_scale_says_so(tmp_path: Path) -> None:
    """The outcome was that a parameter breaks its rule."""
    sweep(
        tmp_path / "s.zarr",
        solve="threshold",
        law="rice-ruina",
        parameters={"V": 1e-6, "frequency": 120.0, "epsilon": 0.0},
        axes={"B": {"values": (0.01, 0.026)}},
        threshold={"between": (0.5, 2.0), "scan": 5},
    )
    assert store_status(tmp_path / "s.zarr").outcomes == {"converged": 1, "no_scale": 1}


def test_the_stiffness_ratio_counts_the_states_of_each_law(tmp_path: Path) -> None:
    second = {"B2": 0.012, "D2": "3 um"}
    grid = SweepGrid.of(
        SweepPlan(
            material="bureau2000",
            parameters={"V": 1e-6, "frequency": 120.0, "epsilon": 0.1, **second},
            axes={"law": {"values": ("rice-ruina", "two-state")}, "K/Kc": {"values": (0.9,)}},
        )
    )
    K = np.concatenate([grid.at(chunk).values["K"] for chunk in range(grid.chunk_count)])
    two = PMMA.law("two-state", B2=0.012, D2=3e-6)
    exact = critical_stiffness(two, 1e-6) * PMMA.W0
    np.testing.assert_allclose(K, [0.9 * KC, 0.9 * exact], rtol=1e-9)


def test_transients_become_named_numbers(tmp_path: Path) -> None:
    dataset = sweep(
        tmp_path / "s.zarr",
        solve="transient",
        law="rice-ruina",
        parameters={"V": 1e-6, "K": 2 * KC},
        axes={"W0": {"values": ("7 N", "3.5 N")}},
        transient={
            "steps": ("slide for 1 s", "ramp velocity to 2 um/s in 0.01 s", "slide for 20 s"),
            "sampling": "20 Hz",
            "numbers": {
                "before": {"of": "friction", "take": "first"},
                "after": {"of": "friction", "take": "last"},
                "peak": {"of": "friction", "take": "max", "from": "1 s"},
            },
        },
    )
    steady = PMMA.mu0 - (PMMA.B - PMMA.A) * np.log(np.array([1e-6, 2e-6]) / PMMA.V0)
    assert dataset["before"].values == pytest.approx(steady[0], abs=1e-9)
    assert dataset["after"].values == pytest.approx(steady[1], abs=1e-5)
    # The direct effect of the step, at most A ln 2, less for a soft spring.
    peak = dataset["peak"].values - steady[0]
    assert (peak > 0).all()
    assert (peak < PMMA.A * np.log(2)).all()
    assert peak[1] > peak[0]  # the lighter slider is held by the stiffer spring, K/Kc


def test_an_interval_without_samples_has_no_number_and_a_reason(tmp_path: Path) -> None:
    dataset = sweep(
        tmp_path / "s.zarr",
        solve="transient",
        law="rice-ruina",
        parameters={"V": 1e-6, "K": 2 * KC},
        axes={"W0": {"values": ("7 N",)}},
        transient={
            "steps": ("slide for 1 s",),
            "sampling": "20 Hz",
            "numbers": {"late": {"of": "friction", "take": "mean", "from": "2 s"}},
        },
    )
    words = dict(
        zip(
            dataset.outcome.flag_values,
            dataset.outcome.flag_meanings.split(),
            strict=True,
        )
    )
    assert words[int(dataset.outcome.values[0])] == "no_samples"
    assert dataset.detail.values == pytest.approx([1.0])
    assert np.isnan(dataset["late"].values).all()


def test_a_transient_follows_a_recording_next_to_its_plan(tmp_path: Path) -> None:
    """The working folder has none of that name; another recording is another plan."""

    def record(load: float) -> None:
        rows = "".join(f"{t / 10},7,1\n" for t in range(10)) + f"1,{load},1\n"
        (tmp_path / "load.csv").write_text("time (s),load (N),velocity (um/s)\n" + rows)

    plan = {
        "solve": "transient",
        "law": "rice-ruina",
        "parameters": {"V": 1e-6, "K": 2 * KC},
        "axes": {"W0": {"values": ("7 N",)}},
        "transient": {
            "steps": ("follow load and velocity from load.csv",),
            "sampling": "10 Hz",
            "numbers": {"last": {"of": "load", "take": "last"}},
        },
        "folder": tmp_path,
    }
    record(7.5)
    dataset = sweep(tmp_path / "s.zarr", **plan)
    assert dataset["last"].values == pytest.approx([7.5])
    record(8.0)
    with pytest.raises(InputError, match=r"have the same plan, got settings\.followed = "):
        sweep(tmp_path / "s.zarr", **plan)


@pytest.mark.parametrize(
    ("fields", "place"),
    [
        ({"parameters": {"V": 1e-6, "epsilon": 0.2}}, "parameters.epsilon"),
        ({"parameters": {"V": 1e-6, "frequency": 120.0}}, "parameters.frequency"),
        ({"axes": {"pull": {"values": (0.1, 0.2)}}}, "axes.pull"),
        ({"axes": {"slip_ratio": {"values": (0.1, 0.2)}}}, "axes.slip_ratio"),
    ],
)
def test_a_modulation_that_no_step_uses_is_refused(
    tmp_path: Path, fields: dict[str, Any], place: str
) -> None:
    """The load is what the steps say: the numbers would be those of a constant load."""
    plan = {
        "solve": "transient",
        "law": "rice-ruina",
        "parameters": {"V": 1e-6},
        "axes": {"K": {"values": (2 * KC,)}},
        "transient": {
            "steps": ("slide for 1 s",),
            "sampling": "10 Hz",
            "numbers": {"last": {"of": "friction", "take": "last"}},
        },
    }
    with pytest.raises(InputError, match=rf"{place} must stand in a step"):
        sweep(tmp_path / "s.zarr", **{**plan, **fields})


@pytest.mark.parametrize(
    ("fields", "message"),
    [
        ({"axes": {"epsilom": {"values": (0.1,)}}}, "did you mean 'epsilon'"),
        ({"axes": {"epsilon": {"values": (0.1,), "count": 3}}}, "axes.epsilon must have one of"),
        ({"axes": {"epsilon": {"from": 0.1}}}, "got no to and no count"),
        ({"axes": {"epsilon": {"values": (1.2,)}}}, "at least 0 and below 1"),
        ({"axes": {"a": {"zip": {"epsilon": (0.1, 0.2), "V": (1e-6,)}}}}, "epsilon of 2, V of 1"),
        ({"axes": {"K/Kc": {"values": (1.0,)}}, "parameters": {"K": 2e5}}, "stiffness_ratio too"),
        ({"axes": {}}, "at least one axis"),
        ({"outputs": ("mu3",)}, "did you mean 'mu"),
        ({"law": "rice-runa"}, "did you mean 'rice-ruina'"),
        ({"solve": "transient"}, "transient must be given"),
        ({"material": ""}, "got none for mu0, A, B, D0, V0"),
        ({"sed": 3}, "did you mean 'seed'"),
        ({"axes": {"epsilon": {"from": 0.1, "to": 0.2, "cuont": 3}}}, "did you mean 'count'"),
        ({"axes": {"K/Kc": {"values": (1.0,)}, "stiffness_ratio": {"values": (2.0,)}}},
         "'stiffness_ratio' under two names"),
        ({"axes": {"epsilon": {"values": (0.1,)}, "status": {"zip": {"K": (1e5, 3e5)}}}},
         "axes.status must have a name of its own"),
        ({"axes": {"epsilon": {"values": (0.1,)}, "mu1": {"zip": {"K": (1e5, 3e5)}}}},
         "axes.mu1 must have a name of its own"),
        ({"axes": {"epsilon": {"values": (0.1,)}, "a/b": {"zip": {"K": (1e5, 3e5)}}}},
         "letters, digits and underscores, got 'a/b'"),
        ({"seed": -1}, "seed must be at least 0, got -1"),
    ],
)  # fmt: skip
def test_mistakes_are_told_before_anything_is_written(
    tmp_path: Path, fields: dict[str, Any], message: str
) -> None:
    whole = {
        "law": "rice-ruina",
        "material": "bureau2000",
        "parameters": {"V": 1e-6, "frequency": 120.0},
        "axes": {"epsilon": {"values": (0.1,)}, "K": {"values": (3e5,)}},
    }
    with pytest.raises(InputError, match=message):
        run_sweep(SweepPlan(**{**whole, **fields}), tmp_path / "s.zarr", workers=ThisProcess())
    assert list(tmp_path.iterdir()) == []
