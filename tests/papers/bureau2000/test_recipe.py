"""The procedure of the paper recovers the true values of synthetic measurements."""

import json

import numpy as np
import pytest

from asperity import Slider, laws, periodic_response
from asperity.errors import InputError
from asperity.inference import table_of
from asperity_papers.bureau2000.recipe import Thresholds, paper_procedure, read_thresholds

#: Not the central values of the paper, from which the procedure may start.
TRUTH = {"mu0": 0.52, "A": 0.015, "B": 0.027, "D0": 0.45e-6, "lambda": 0.6e-6, "eps_ratio": 0.55}
MACHINE = {"K": "0.2 N/um", "W0": "7 N"}
#: Relative uncertainties of K/W0, the critical frequency and mu1; absolute ones of the means.
STIFFNESS, FREQUENCY, FIRST, MEAN, DROP = 0.03, 0.1, 0.05, 1e-3, 2e-3


def procedure(columns, bifurcations, name="bifurcations", **fixed):
    thresholds = Thresholds(name, **bifurcations)
    return paper_procedure(table_of(columns), thresholds, fixed=MACHINE | fixed)


def test_a_number_that_the_procedure_finds_is_not_fixed():
    with pytest.raises(InputError, match=r"fixed must name one of K, W0, V0, .*, got 'A'"):
        paper_procedure(None, None, fixed={"A": 0.02})


@pytest.fixture(scope="module")
def exact():
    """Columns of a table without noise, and the exact bifurcations (Eqs. 18 and 19)."""
    numbers = {n: TRUTH[n] for n in ("mu0", "A", "B", "D0")} | {"V0": 1e-6}
    V, epsilon = np.repeat([1e-6, 1e-5], 4), np.tile([0.2, 0.3, 0.4, 0.5], 2)
    # The drop is that of the Rice-Ruina law, which step 3 of the paper assumes.
    response, rigid = (
        periodic_response(
            Slider(law, spring=2e5, load=7.0),
            velocity=V,
            epsilon=TRUTH["eps_ratio"] * epsilon,
            frequency=120.0,
        )
        for law in (
            laws.ElastoPlastic(**numbers, lambda_=TRUTH["lambda"]),
            laws.RiceRuina(**numbers),
        )
    )
    steady = np.geomspace(1e-7, 1e-4, 6)
    weakening = TRUTH["B"] - TRUTH["A"]
    empty, none = np.full(6, np.nan), np.full(8, np.nan)
    columns = {
        "V": np.r_[steady, V],
        "epsilon": np.r_[0 * steady, epsilon],
        "frequency": 120.0,
        "mean_friction": np.r_[TRUTH["mu0"] - weakening * np.log(steady / 1e-6), none],
        "mean_friction_err": MEAN,
        "delta_mu": np.r_[empty, rigid.delta_mu],
        "delta_mu_err": DROP,
        "mu1": np.r_[empty, response.mu1],
        "mu1_err": np.r_[empty, FIRST * response.mu1],
    }
    pulled = np.array([1e-6, 1e-5])
    stiffness = np.full(2, weakening / TRUTH["D0"])
    omega = np.sqrt(weakening / TRUTH["A"]) * pulled / TRUTH["D0"]
    frequency = omega / (2 * np.pi)
    bifurcations = {
        "V": pulled,
        "K_over_W0": stiffness,
        "K_over_W0_err": STIFFNESS * stiffness,
        "frequency": frequency,
        "frequency_err": FREQUENCY * frequency,
    }
    return columns, bifurcations


@pytest.fixture(scope="module")
def recovered(exact):
    return procedure(*exact)


def test_measurements_without_noise_give_the_true_values(recovered):
    for name, value in TRUTH.items():
        assert recovered.numbers[name].value == pytest.approx(value, rel=1e-5)
    assert recovered.numbers["alpha"].value == pytest.approx(0, abs=1e-5)


def test_a_bifurcation_that_occurs_twice_is_named(exact, recovered):
    columns, bifurcations = exact
    twice = {n: np.append(c, c[0]) for n, c in bifurcations.items()}
    # Without the rows of the later steps, which are left out.
    steady = {n: c if np.ndim(c) == 0 else c[:6] for n, c in columns.items()}
    found = procedure(steady, twice, "ends")
    assert "row 3 of ends is equal to row 1 of ends: remove it" in found.warnings[0]
    assert not any("is equal to" in warning for warning in recovered.warnings)


def test_errors_of_the_first_steps_are_those_of_error_propagation(recovered):
    weakening = TRUTH["B"] - TRUTH["A"]
    log_v = np.log(np.geomspace(1e-7, 1e-4, 6))
    slope = MEAN / np.sqrt(((log_v - log_v.mean()) ** 2).sum())
    numbers = recovered.numbers
    # Two bifurcations: their errors are averaged. A = (K/W0)^2 V^2 / (omega^2 (B - A)).
    stiffness, frequency = STIFFNESS / np.sqrt(2), FREQUENCY / np.sqrt(2)
    relative = slope / weakening
    assert numbers["B - A"].se == pytest.approx(slope, rel=1e-6)
    assert numbers["D0"].se == pytest.approx(TRUTH["D0"] * np.hypot(relative, stiffness), rel=1e-3)
    assert numbers["A"].se == pytest.approx(
        TRUTH["A"] * np.sqrt(relative**2 + 4 * stiffness**2 + 4 * frequency**2), rel=1e-3
    )


def test_errors_of_later_steps_include_those_of_the_earlier_ones(exact, recovered):
    columns, bifurcations = exact
    names = ("eps_ratio", "lambda")
    for name in names:
        assert recovered.numbers[name].se > 1.02 * recovered.numbers[name].se_own
    # The critical frequency is shifted by one standard deviation.
    moved = bifurcations | {"frequency": bifurcations["frequency"] * (1 + FREQUENCY / np.sqrt(2))}
    changed = procedure(columns, moved, "moved")
    for name in names:
        number = recovered.numbers[name]
        shift = abs(changed.numbers[name].value - number.value)
        # Errors are to first order, and the shift of 7 % is one of 14 % in A.
        assert shift <= 1.2 * np.sqrt(number.se**2 - number.se_own**2)
    shift = abs(changed.numbers["eps_ratio"].value - recovered.numbers["eps_ratio"].value)
    number = recovered.numbers["eps_ratio"]
    assert shift == pytest.approx(np.sqrt(number.se**2 - number.se_own**2), rel=0.3)


def test_the_reference_velocity_changes_only_mu0(exact, recovered):
    moved = procedure(*exact, V0="10 um/s")
    weakening = TRUTH["B"] - TRUTH["A"]
    mu0 = moved.numbers["mu0"]
    assert mu0.value == pytest.approx(TRUTH["mu0"] - weakening * np.log(10), rel=1e-5)
    assert (mu0.published, mu0.deviation) == (None, None)
    for name in ("A", "B", "D0", "eps_ratio", "lambda"):
        assert moved.numbers[name].value == pytest.approx(recovered.numbers[name].value, rel=1e-5)


def test_the_bound_on_alpha_is_weaker_with_a_free_eps_ratio(recovered):
    numbers = recovered.numbers
    assert 0 < numbers["alpha"].upper_limit_95 < 0.05
    assert numbers["alpha, eps_ratio free"].upper_limit_95 > 3 * numbers["alpha"].upper_limit_95


def test_the_record_has_the_published_values_and_deviations(recovered):
    record = json.loads(json.dumps(recovered.record()))["numbers"]
    for name, published in {
        "A": 0.013,
        "B": 0.026,
        "D0": 0.4e-6,
        "eps_ratio": 0.48,
        "lambda": 0.7e-6,
        "alpha": 0.02,
    }.items():
        assert record[name]["published"] == pytest.approx(published)
    se = record["A"]["se"]
    assert record["A"]["deviation"] == pytest.approx(0.002 / np.hypot(se, 0.005), rel=1e-3)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"mean_friction": None, "mean_friction_err": None}, "epsilon = 0 and mean_friction"),
        ({"mean_friction": np.r_[np.linspace(0.4, 0.6, 6), np.full(8, np.nan)]}, "must have fric"),
        (
            {
                "V": np.r_[np.full(6, 1e-6), np.full(8, 1e-6)],
                "mean_friction": np.r_[np.linspace(0.5, 0.51, 6), np.full(8, np.nan)],
            },
            "two velocities or more",
        ),
        ({"epsilon": np.linspace(0.1, 0.5, 14)}, "rows with epsilon = 0"),
    ],
)
def test_missing_measurements_are_refused(exact, change, message):
    columns, bifurcations = exact
    changed = {n: v for n, v in {**columns, **change}.items() if v is not None}
    with pytest.raises(InputError) as raised:
        procedure(changed, bifurcations)
    assert message in str(raised.value)


@pytest.mark.parametrize(
    ("absent", "left", "warning"),
    [
        (("delta_mu", "mu1"), {"mu0", "A", "B", "D0", "B - A"}, "steps 3 to 5 are left out"),
        (("mu1",), {"eps_ratio", "alpha"}, "step 4 is left out"),
    ],
)
def test_steps_without_rows_are_left_out(exact, absent, left, warning):
    columns, bifurcations = exact
    kept = {n: v for n, v in columns.items() if n.removesuffix("_err") not in absent}
    result = procedure(kept, bifurcations)
    assert left <= set(result.numbers)
    assert "lambda" not in result.numbers
    assert any(warning in text for text in result.warnings)
    assert result.numbers["D0"].value == pytest.approx(TRUTH["D0"], rel=1e-5)


@pytest.mark.parametrize("seed", range(4))
def test_bifurcations_beyond_doubles_are_refused(exact, seed):
    columns, bifurcations = exact
    draw = np.random.default_rng(seed)
    # One to five columns are so large or small that no slider follows from them.
    names = draw.permutation(["K_over_W0", "V", "K_over_W0_err", "frequency", "frequency_err"])
    sizes = 10.0 ** (draw.choice([-1, 1], 5) * draw.uniform(150, 308, 5))
    huge = {
        name: np.full(2, size)
        for name, size in zip(names[: draw.integers(1, 6)], sizes, strict=False)
    }
    with pytest.raises(InputError, match="must have bifurcations from which A, B and D0 follow"):
        procedure(columns, bifurcations | huge, "huge")


HEADING = "V,K_over_W0,K_over_W0_err,frequency,frequency_err\n"


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("V,K_over_W0\n1e-6,3e4\n", "got none for K_over_W0_err"),
        (HEADING, "must have a heading and a bifurcation a row"),
        (f"{HEADING}1e-6,x,1,1,1\n", "row 1 must have a number in column K_over_W0, got 'x'"),
        (f"{HEADING}1e-6,3e4,0,1,1\n", "must be positive"),
    ],
)
def test_a_wrong_table_of_bifurcations_is_refused(tmp_path, text, message):
    path = tmp_path / "bifurcation.csv"
    path.write_text(text)
    with pytest.raises(InputError) as raised:
        read_thresholds(path)
    assert message in str(raised.value)
    with pytest.raises(InputError, match="no such file"):
        read_thresholds(tmp_path / "absent.csv")


def test_bifurcations_in_other_units_are_converted(tmp_path):
    path = tmp_path / "bifurcation.csv"
    path.write_text(
        "V (um/s),K_over_W0 (1/um),K_over_W0_err (1/um),frequency (mHz),frequency_err (mHz)\n"
        "2,0.03,0.001,400,5\n"
    )
    read = read_thresholds(path)
    expected = {"V": 2e-6, "K_over_W0": 3e4, "K_over_W0_err": 1e3, "frequency": 0.4}
    assert {n: float(getattr(read, n)[0]) for n in expected} == pytest.approx(expected, rel=1e-12)
