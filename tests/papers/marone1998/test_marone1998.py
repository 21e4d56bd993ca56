"""Marone (1998): its ledger of 70 claims compared with SciPy, and the contents of its folder."""

import re
from collections import Counter
from pathlib import Path

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import asperity_papers.marone1998 as package
from asperity import materials
from asperity.errors import InputError
from asperity.ledger import Paper, altered
from references.holds_and_steps import Interface

PAPER = Paper("marone1998", "asperity_papers.marone1998")
FOLDER = Path(package.__file__).parent
A, B, D0 = 0.008, 0.009, 3e-6
SOFT, STIFF = (2e3, 1e-6), (7.4e4, 0.3162e-6)
LETTERS = {"rice-ruina": "D", "ruina-slip": "R", "perrin-rice-zheng": "PRZ"}

#: Claims whose rule needs readings that nobody took, or for which there is no rule.
UNDECIDED = {
    *("figure-2-ageing", "figure-2-slip", "figure-2-prz", "ageing-soft", "decade-of-velocity"),
    *("seismic-healing", "memory-length-against-strain", "distance-to-weakening"),
    "intrinsic-and-dilation",
}
MISPRINTS = {
    *("dynamic-slope-per-decade", "maximum-condition", "healing-law-as-rate"),
    "afterslip-amplitude",
}
DIFFERS = {
    *("peak-height", "peak-to-end", "end-level", "legend-velocity", "slip-falls-with-stiffness"),
    *("actual-velocities-improve", "data-same", "lower-velocity-higher-state"),
    *("complete-stress-drop", "dilation-too-small", "three-events"),
}


@pytest.fixture(scope="module")
def claims():
    return {claim.id: claim for claim in PAPER.ledger()}


@pytest.fixture(scope="module")
def computed(claims):
    return {name: claim.numbers for name, claim in claims.items()}


def healing(name, spring, time, **changes):
    """Rise of friction after a hold, by SciPy at a relative tolerance of 1e-12."""
    k, V = spring
    numbers = {"A": A, "B": B, "D0": D0} | changes
    level, _, high, *_ = Interface(name, k=k, **numbers).hold(V, time)
    return high - level


def test_the_seventy_claims_have_the_listed_verdicts(claims):
    assert len(claims) == 70
    by_verdict = {v: {n for n, c in claims.items() if c.verdict == v} for v in
                  ("undecided", "misprint", "differs")}  # fmt: skip
    assert by_verdict == {"undecided": UNDECIDED, "misprint": MISPRINTS, "differs": DIFFERS}
    kinds = Counter(c.kind for c in claims.values())
    assert kinds["test"] == 43
    assert set(kinds) == {"test", "fit", "arithmetic", "identity"}


def test_healing_of_figure_3_agrees_with_scipy(computed):
    digitised = {
        "ageing-stiff": ("rice-ruina", {1e5: 0.0823}),
        "slip-curves": ("ruina-slip", {1e3: 0.0078, 1e5: 0.0172}),
        "prz-curves": ("perrin-rice-zheng", {100: 0.0152, 1e3: 0.0312, 1e5: 0.0596}),
    }
    for claim, (name, values) in digitised.items():
        for time, value in values.items():
            difference = healing(name, STIFF, time) - value
            assert computed[claim][f"off at {time:g} s"] == pytest.approx(difference, abs=1e-9)
    legend = healing("rice-ruina", (STIFF[0], 0.3e-6), 1e5) - 0.0823
    assert computed["legend-velocity"]["off"] == pytest.approx(legend, abs=1e-9)


def test_differences_between_the_springs_agree_with_scipy(computed):
    for time in (1e3, 1e5):
        change = healing("rice-ruina", STIFF, time) / healing("rice-ruina", SOFT, time) - 1
        assert computed["ageing-same-values"][f"{time:g} s"] == pytest.approx(change, abs=1e-7)
    soft, stiff = (
        (healing("ruina-slip", (k, 1e-6), 1e5) - healing("ruina-slip", (k, 1e-6), 1e4))
        for k in (SOFT[0], STIFF[0])
    )
    assert computed["slip-rate-falls-with-stiffness"]["change"] == pytest.approx(
        stiff - soft, abs=1e-8
    )
    base, more = (healing("ruina-slip", STIFF, 1e3, A=f * A) for f in (1, 1.5))
    assert computed["not-the-direct-effect"]["R"] == pytest.approx(more / base - 1, abs=1e-7)


def test_the_misfit_of_the_points_agrees_with_scipy(claims):
    """The actual velocities double the misfit."""
    points = np.array([(2.5, 0.0037), (10, 0.0068), (20, 0.0167), (100, 0.0244), (400, 0.0372),
                       (1e3, 0.0501), (3e3, 0.0577), (1e4, 0.0705), (3e4, 0.0835),
                       (1e5, 0.0911)])  # fmt: skip
    misfit = [
        np.sqrt(np.mean([(healing("rice-ruina", (STIFF[0], V), t) - y) ** 2 for t, y in points]))
        for V in (1e-6, 0.3162e-6)
    ]
    assert claims["actual-velocities-improve"].numbers["improvement"] == pytest.approx(
        misfit[0] - misfit[1], abs=1e-9
    )
    assert f"{misfit[0]:.4f} with 1 um/s and {misfit[1]:.4f}" in (
        claims["actual-velocities-improve"].computed
    )


def test_steps_of_figure_2_agree_with_scipy(computed):
    for name, letter in LETTERS.items():
        interface = Interface(name, 0.01, 0.015, 20e-6, 1e4)
        before, peak, after = interface.step(1e-6, 1e-5)
        assert computed["peak-height"][letter] == pytest.approx(peak - before, abs=1e-9)
        assert computed["peak-to-end"][letter] == pytest.approx(peak - after, abs=1e-9)
        (at_7, *_), _ = interface.integrate(interface.steady(1e-6), 1e-5, 14.0, 1e-5)
        assert computed["end-level"][letter] == pytest.approx(before - at_7, abs=1e-8)


def test_velocities_in_the_hold_agree_with_scipy(computed):
    interface = Interface("rice-ruina", A, B, D0, STIFF[0])
    ends = []
    for V in (1e-6, 1e-5):
        (mu, y, _), _ = interface.integrate(interface.steady(V), 0.0, 100.0, V)
        ends.append((np.exp(interface.log_v(mu, y)), y))
    (slow, young), (fast, old) = ends
    assert computed["faster-falls-faster"]["D, 100 s"] == pytest.approx(fast / slow, rel=1e-7)
    assert computed["lower-velocity-higher-state"]["D, 100 s"] == pytest.approx(
        old - young, abs=1e-8
    )


def test_the_slip_to_steady_state_agrees_with_its_closed_form(computed):
    """ln(1 + (r - 1) exp(-u/Dc)) = 0.05 ln r solved for u by hand."""
    slip = {r: np.log((r - 1) / (r**0.05 - 1)) for r in (2.0, 10.0)}
    assert computed["slip-scales-with-velocity"]["2 to 10"] == pytest.approx(
        slip[10.0] / slip[2.0], rel=1e-4
    )


def test_the_afterslip_of_two_weeks_agrees_with_scipy(claims):
    done = solve_ivp(lambda t, u: [1 / (1 + 1.72 * t)], (0, 365), [0.0], rtol=1e-10, atol=1e-12,
                     t_eval=[14, 365])  # fmt: skip
    assert claims["half-of-the-year"].numbers["share"] == pytest.approx(
        done.y[0, 0] / done.y[0, 1], abs=1e-7
    )


def test_the_material_has_the_numbers_of_the_text():
    numbers = materials.load("marone1998")
    assert pytest.approx((A, B, D0)) == (numbers.A, numbers.B, numbers.D0)
    assert numbers.k_stiff == pytest.approx(STIFF[0])
    assert numbers["B_5"].kind == "fitted"
    assert not any(number.uncertainty for number in numbers.numbers.values())
    assert "Open:" in numbers.notes


def test_figures_are_computed_with_their_points():
    from asperity_papers.marone1998.figures import NUMBERS
    from asperity_papers.marone1998.laboratory import Laboratory

    laboratory = Laboratory(materials.load("marone1998"))
    third = NUMBERS["figure-03"](laboratory)
    assert len(third.points) == 16
    assert third.scalars["rms actual"] > 2 * third.scalars["rms equal"]
    for curve, spring, name in (("D, k_s", STIFF, "rice-ruina"), ("R, k_n", SOFT, "ruina-slip")):
        assert third.last(curve, "healing") == pytest.approx(healing(name, spring, 1e5), abs=1e-9)
    assert set(PAPER.words.figures) == set(NUMBERS)


def test_no_text_of_the_paper_is_in_its_folder():
    """The folder has facts and numbers; quotations have at most six words."""
    files = [*FOLDER.rglob("*.toml"), *FOLDER.rglob("*.py")]
    assert len(files) > 8
    for file in files:
        quoted = re.findall(r"“([^”]+)”", file.read_text(encoding="utf-8"))
        assert all(len(text.split()) <= 6 for text in quoted), file.name


def test_a_figure_follows_changed_numbers(capsys):
    """The Paper tab draws lines for changed numbers, and its code runs."""
    figure = PAPER.tab["figure-05"]
    assert set(PAPER.tab) < set(PAPER.words.figures)
    changes = {"B_5": 0.006}
    lines = figure.lines(altered(PAPER.numbers, changes))
    static = next(line for line in lines if line["name"] == "static")["values"]
    slope = np.diff(static["friction"]) / np.diff(np.log(static["over"]))
    np.testing.assert_allclose(slope, -0.006, rtol=1e-9)
    exec(compile(figure.python(changes), "figure-05", "exec"), {})
    assert "static" in capsys.readouterr().out
    with pytest.raises(InputError, match="reach the end of the figure, got the slider ran away"):
        PAPER.tab["figure-02"].lines(altered(PAPER.numbers, {"k_2": 2e-4}))
