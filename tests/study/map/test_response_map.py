"""Maps of real sliders: closed forms, other root finders, files and interruptions; their axes."""

import dataclasses

import numpy as np
import pytest
import xarray
from scipy.optimize import brentq

import asperity as asp
from asperity.errors import InputError
from asperity.operating_point import SourcedNumber, respond
from asperity.orbit import Outcome
from asperity.outputs import Interrupted, targets
from asperity.study import crossings, responses
from asperity.study.map import SHOWN, Axis, response_map, write_map

EPS = Axis("epsilon", 0.0, 0.4, 7)
K = Axis("K", "0.1 N/um", "0.3 N/um", 8)


@pytest.fixture(scope="module")
def rigid(numbers):
    return response_map("rice-ruina", numbers, x=EPS, y=K)


def on_lines(dataset, name):
    return dataset[f"boundary_{name}"].values[dataset["boundary_line"].values >= 0]


def test_without_modulation_the_boundary_is_the_critical_stiffness(rigid, pmma) -> None:
    Kc = (pmma.B - pmma.A) * pmma.W0 / pmma.D0
    eps, stiffness = on_lines(rigid, "epsilon"), on_lines(rigid, "K")
    (unmodulated,) = np.flatnonzero(eps == 0)
    assert stiffness[unmodulated] == pytest.approx(Kc, rel=2e-6)
    np.testing.assert_allclose(rigid["critical_stiffness"], Kc, rtol=1e-12)
    # The pulsation there is the paper's omega_c, Eq. (19), below half the modulation frequency.
    mode = on_lines(rigid, "mode_frequency")[unmodulated]
    omega_c = np.sqrt((pmma.B - pmma.A) / pmma.A) * 1e-6 / pmma.D0
    assert mode == pytest.approx(omega_c / (2 * np.pi), rel=1e-5)
    assert set(on_lines(rigid, "kind")) == {"Neimark-Sacker"}


def test_elastic_asperities_have_their_own_critical_stiffness(numbers, pmma) -> None:
    rest = {name: value for name, value in numbers.items() if name != "lambda"}
    dataset = response_map(
        "elasto-plastic",
        rest | {"epsilon": 0.0},
        x=Axis("lambda", "0 um", "1 um", 3),
        y=Axis("K", 1.5e5, 3e5, 4),
    )
    stiffness, length = on_lines(dataset, "K"), on_lines(dataset, "lambda")
    expected = (pmma.B - pmma.A) * pmma.W0 / (pmma.D0 + pmma.A * length)
    # The span of the axis is 1.5e5 N/m, a crossing is located to 1e-6 of it.
    np.testing.assert_allclose(stiffness, expected, atol=0.5)


def test_the_boundary_is_where_another_root_finder_has_it(rigid, pmma) -> None:
    def log_multiplier(stiffness: float, eps: float) -> float:
        slider = asp.Slider(pmma.law("rice-ruina"), spring=stiffness, load=pmma.W0)
        r = asp.periodic_response(slider, velocity=1e-6, epsilon=eps, frequency=120.0)
        return float(r.log_multipliers[0].real)

    eps, stiffness = on_lines(rigid, "epsilon"), on_lines(rigid, "K")
    for i in np.linspace(0, len(eps) - 1, 5).astype(int):
        root = brentq(log_multiplier, 1e5, 3e5, args=(eps[i],), xtol=1e-3)
        assert abs(root - stiffness[i]) < 1e-4 * 2e5


def test_chords_between_the_points_stay_on_the_boundary(rigid, pmma) -> None:
    eps, stiffness = on_lines(rigid, "epsilon"), on_lines(rigid, "K")
    middle, across = (eps[1:] + eps[:-1]) / 2, (stiffness[1:] + stiffness[:-1]) / 2
    near = across + 1e-4 * 2e5 * np.array([[-1.0], [1.0]])
    slider = asp.Slider(pmma.law("rice-ruina"), spring=near, load=pmma.W0)
    r = asp.periodic_response(slider, velocity=1e-6, epsilon=middle, frequency=120.0)
    assert not r.stable[0].any()
    assert r.stable[1].all()


def test_a_planted_mistake_in_the_search_is_seen(numbers, pmma, monkeypatch) -> None:
    monkeypatch.setattr(crossings, "TOLERANCE", 0.3)
    dataset = response_map("rice-ruina", numbers, x=Axis("epsilon", 0.0, 0.4, 2), y=K)
    Kc = (pmma.B - pmma.A) * pmma.W0 / pmma.D0
    eps, stiffness = dataset["boundary_epsilon"].values, dataset["boundary_K"].values
    assert abs(stiffness[eps == 0][0] / Kc - 1) > 1e-4


def test_the_grid_holds_the_responses(rigid, pmma) -> None:
    eps, stiffness = np.meshgrid(rigid["epsilon"], rigid["K"])
    slider = asp.Slider(pmma.law("rice-ruina"), spring=stiffness, load=pmma.W0)
    r = asp.periodic_response(slider, velocity=1e-6, epsilon=eps, frequency=120.0)
    assert rigid["mu1"].dims == ("K", "epsilon")
    for name in set(SHOWN) - {"log_multiplier"}:
        np.testing.assert_allclose(rigid[name], getattr(r, name), rtol=1e-9, atol=1e-12)
    assert (rigid["stable"].values == r.stable).all()
    assert (rigid["mode"].values == r.mode).all()


def test_rows_are_y_also_where_the_axes_are_exchanged(rigid, numbers) -> None:
    turned = response_map("rice-ruina", numbers, x=K, y=EPS)
    assert turned["mu1"].dims == ("epsilon", "K")
    np.testing.assert_allclose(turned["mu1"].values.T, rigid["mu1"].values, rtol=1e-9)
    assert turned["critical_stiffness"].dims == ("epsilon",)


def test_a_point_that_fails_says_why_and_costs_no_other(numbers, monkeypatch) -> None:
    def failing(law, values, progress=None, **options):
        response = respond(law, values, progress, **options)
        lost = np.asarray(values["epsilon"]) > 0.3
        logs = np.where(lost[:, None], np.nan + 0j, response.log_multipliers)
        outcome = np.where(lost, Outcome.NO_ORBIT, response.outcome)
        mean = np.where(lost, np.nan, response.mean_friction)
        planted = {"log_multipliers": logs, "outcome": outcome, "mean_friction": mean}
        return dataclasses.replace(response, **planted)

    monkeypatch.setattr(responses, "respond", failing)
    dataset = response_map("rice-ruina", numbers, x=EPS, y=K)
    failed = ~dataset["converged"].values
    assert (failed == (dataset["epsilon"].values > 0.3)).all()
    for name in SHOWN:
        assert (np.isnan(dataset[name].values) == failed).all(), name
    reasons = dataset["result"].values
    assert all("no method found a periodic orbit" in text for text in reasons[failed])
    assert (reasons[~failed] == "converged").all()
    assert not dataset["stable"].values[failed].any()
    assert dataset["boundary_epsilon"].max() <= 0.3


def test_a_law_without_dynamics_has_no_boundary(numbers) -> None:
    dataset = response_map("amontons", numbers, x=Axis("epsilon", 0.1, 0.4, 4), y=K)
    np.testing.assert_allclose(
        dataset["mu1"].values, 0.5 * dataset["epsilon"].values + 0 * dataset["mu1"]
    )
    assert dataset["stable"].values.all()
    assert dataset.sizes["boundary_point"] == 0


def test_inertia_and_damping_are_passed_on(numbers, monkeypatch) -> None:
    asked = []

    def note(law, values, progress=None, **options):
        asked.append(values)
        return respond(law, {**values, "inertia": 0.0, "eta": 0.0}, progress)

    monkeypatch.setattr(responses, "respond", note)
    x, y = Axis("M", "1 kg", "2 kg", 2), Axis("eta", 0.0, 500.0, 2)
    point = {"K": 2.2e5, "epsilon": 0.2, "inertia": 1}
    dataset = response_map("elasto-plastic", numbers | point, x=x, y=y)
    # Points with and without damping have equations of their own, and are asked for apart.
    assert [call["eta"].tolist() for call in asked] == [[0.0, 0.0], [500.0, 500.0]]
    for call in asked:
        assert call["M"].tolist() == [1.0, 2.0]
        assert (call["inertia"] == 1).all()
    assert float(dataset["inertia"]) == 1.0


def test_the_file_is_read_back_with_units(rigid, numbers, tmp_path) -> None:
    sourced = {
        name: SourcedNumber(value, "a paper") if isinstance(value, float) else value
        for name, value in numbers.items()
    }
    out = tmp_path / "map.nc"
    write_map(out, "rice-ruina", sourced, x=EPS, y=K, block=20)
    assert [path.name for path in tmp_path.iterdir()] == ["map.nc"]
    with xarray.open_dataset(out, engine="h5netcdf") as read:
        for name in set(read.variables):
            assert "units" in read[name].attrs, name
            assert "long_name" in read[name].attrs, name
        assert read["K"].attrs["units"] == "N/m"
        assert read["growth_rate"].attrs["units"] == "1/s"
        assert read["A"].attrs["origin"] == "a paper"
        assert float(read["frequency"]) == 120.0
        assert read.attrs["law"] == "rice-ruina"
        for name in rigid.variables:
            stored, made = read[name].values, rigid[name].values
            if made.dtype.kind == "f":
                np.testing.assert_allclose(stored, made, rtol=1e-9, atol=1e-9)
            else:
                assert (stored.astype(made.dtype) == made).all(), name


def test_an_interrupted_map_goes_on_to_the_same_result(numbers, tmp_path) -> None:
    whole, parts = tmp_path / "whole.nc", tmp_path / "parts.nc"
    ask = {"law": "rice-ruina", "numbers": numbers, "x": EPS, "y": K, "block": 16}
    write_map(whole, **ask)

    def stop(done: int, total: int) -> None:
        if done > 32:
            raise KeyboardInterrupt

    with pytest.raises(Interrupted, match=r"with 32 of 56 points finished.*--resume"):
        write_map(parts, **ask, progress=stop)
    assert not parts.exists()
    with pytest.raises(InputError, match="must not have an unfinished run"):
        write_map(parts, **ask)
    with pytest.raises(
        InputError, match=r"must belong to the same inputs, got x\.\w+ = .* there and .* here"
    ):
        write_map(parts, **{**ask, "x": Axis("epsilon", 0.0, 0.3, 7)}, resume=True)
    seen = []
    write_map(parts, **ask, resume=True, progress=lambda done, total: seen.append(done))
    assert seen[0] == 32
    with xarray.open_dataset(whole) as a, xarray.open_dataset(parts) as b:
        assert a.identical(b)
    assert sorted(path.name for path in tmp_path.iterdir()) == ["parts.nc", "whole.nc"]


@pytest.mark.parametrize(
    ("law", "more", "axes", "parts"),
    [
        ("rice-ruina", {}, (EPS, EPS), ["axes must be two numbers, got 'epsilon' on both"]),
        ("rice-ruina", {"K": 2e5}, (EPS, K), ["K must be given once, got an axis and a fixed"]),
        ("rice-ruina", {}, (Axis("alpha", 0.0, 0.1, 3), K), ["'alpha'", "linker-dieterich"]),
        ("rice-runia", {}, (EPS, K), ["did you mean 'rice-ruina'?"]),
        ("rice-ruina", {"V": "1 um"}, (EPS, K), ["numbers['V'] must be a velocity (m/s)"]),
        ("rice-ruina", {"inertia": 1}, (EPS, K), ["M must be positive where inertia"]),
        ("linker-dieterich", {}, (EPS, K), ["must have all its numbers, got none for alpha"]),
        ("rice-ruina", {}, (Axis("V", 1e-6, 1e-5, 3), K), ["got none for epsilon"]),
    ],
)
def test_bad_questions(numbers, law, more, axes, parts) -> None:
    asked = numbers | more
    if axes[0].name == "V":
        asked = {k: v for k, v in asked.items() if k != "V"}
    with pytest.raises(InputError) as error:
        response_map(law, asked, x=axes[0], y=axes[1])
    for part in parts:
        assert part in str(error.value)


def test_an_axis_of_another_modulation(numbers, pmma) -> None:
    numbers = numbers | {"K": pmma.K}
    x, y = Axis("epsilon2", 0.0, 0.4, 3), Axis("epsilon", 0.2, 0.7, 2)
    dataset = response_map("rice-ruina", numbers, x=x, y=y)
    # w = 1 + 0.7 cos t + 0.4 cos 2t: lowest where cos t = -0.4375, at 1 - 0.4 - 0.153 > 0.
    assert dataset["converged"].all()
    slider = asp.Slider(pmma.law("rice-ruina"), spring=pmma.K, load=pmma.W0)
    load = asp.loads.modulated([0.2, 0.7], load={2: (0.2, 0.0)})
    r = asp.periodic_response(slider, velocity=1e-6, frequency=120.0, modulation=load)
    np.testing.assert_allclose(dataset["mu1"].sel(epsilon2=0.2), r.mu1, rtol=1e-8)
    lost = response_map("rice-ruina", numbers | {"epsilon2_phase": np.pi}, x=x, y=y)
    assert "lowest W/W0 of -0.1;" in str(lost["result"].values[1, 2])
    assert lost["converged"].sum() == 5


def test_points_at_which_slip_would_reverse_are_marked(numbers, pmma) -> None:
    """On a tilted exciter the shear force on the slider exceeds that of the spring."""
    x, y = Axis("epsilon", 0.1, 0.5, 2), Axis("tilt", 0.0, 0.8, 2)
    dataset = response_map("rice-ruina", numbers | {"K": pmma.K}, x=x, y=y, boundary=False)
    assert dataset["converged"].all()
    assert dataset["reverses"].values.tolist() == [[False, False], [False, True]]


def test_a_map_beyond_memory_is_refused_before_anything(numbers, tmp_path, monkeypatch) -> None:
    monkeypatch.setattr(targets, "free_memory", lambda: 16e9)
    draw = np.random.default_rng(0)
    for _ in range(5):
        columns = int(10 ** draw.uniform(0.5, 8))
        x = Axis("epsilon", 0.0, 0.4, columns)
        y = Axis("K", 1e5, 3e5, int(min(10**8, max(2, 10 ** draw.uniform(7.6, 9) / columns))))
        with pytest.raises(InputError, match=r"axes must fit into the free space, got .* x"):
            write_map(tmp_path / "map.nc", "rice-ruina", numbers, x=x, y=y)
    assert list(tmp_path.iterdir()) == []


def test_an_axis_as_text() -> None:
    axis = Axis.parse("K=0.05:0.5:10 N/um")
    assert (axis.name, axis.count, axis.unit, axis.log) == ("K", 10, "N/m", False)
    np.testing.assert_allclose(axis.values, np.linspace(5e4, 5e5, 10), rtol=1e-14)
    assert Axis.parse(" epsilon = 1:50:3 %").values.tolist() == [0.01, 0.255, 0.5]
    assert Axis.parse("epsilon=1:50:3%") == Axis("epsilon", 0.01, 0.5, 3)
    assert Axis.parse("lambda=0.1:1:3 um").name == "lambda"


def test_a_logarithmic_axis_has_equal_ratios() -> None:
    axis = Axis("frequency", "0.1 Hz", "1 kHz", 5, log=True)
    np.testing.assert_allclose(axis.values, [0.1, 1.0, 10.0, 100.0, 1000.0], rtol=1e-13)
    assert axis.values[[0, -1]].tolist() == [0.1, 1000.0]


@pytest.mark.parametrize(
    ("text", "parts"),
    [
        ("K", ["axis must be NAME=LOW:HIGH:COUNT UNIT, got 'K'"]),
        ("K=1:2 N/um", ["got 'K=1:2 N/um'"]),
        ("K=1:2:3.5 N/um", ["got 'K=1:2:3.5 N/um'"]),
        ("K=1:2:10", ["axis of K must carry a unit", "'K=1:2:10 N/m'"]),
        ("K=1:2:10 N", ["axis of K must be a stiffness (N/m), got '1 N'"]),
        ("K=2:1:10 N/um", ["axis of K must go from a smaller to a larger", "2e+06 to 1e+06 N/m"]),
        ("K=1:1:10 N/um", ["axis of K must go from a smaller to a larger"]),
        ("K=1:2:1 N/um", ["axis of K must have 2 to 100,000,000 points, got 1"]),
        ("K=0:2:9 N/um", ["axis of K must be positive, got 0 N/m"]),
        ("epsilon=0.1:1:9", ["axis of epsilon must be at least 0 and below 1", "got 1;"]),
        ("epsilon=x:1:9", ["axis of epsilon must be a finite number, got 'x'"]),
        ("epsilom=0.1:0.2:9", ["axis must be a number of an operating point, got 'epsilom'"]),
        ("inertia=0:1:2", ["axis must be a number of an operating point, got 'inertia'"]),
    ],
)
def test_a_bad_axis(text: str, parts: list[str]) -> None:
    with pytest.raises(InputError) as error:
        Axis.parse(text)
    for part in parts:
        assert part in str(error.value)


def test_a_logarithmic_axis_does_not_start_at_zero() -> None:
    with pytest.raises(InputError, match="must start above zero to be logarithmic, got 0"):
        Axis.parse("epsilon=0:0.5:10", log=True)
