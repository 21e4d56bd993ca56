"""Plans: files with units, grids, cases and draws."""

from pathlib import Path

import numpy as np
import pytest
from scipy.stats import kstest

from asperity.errors import InputError
from asperity.outputs import targets
from asperity.study import SweepPlan, load_plan, run_sweep
from asperity.study.grid import SweepGrid

FIXED = {"law": "rice-ruina", "material": "bureau2000",
         "parameters": {"V": 1e-6, "frequency": 120.0}}  # fmt: skip


def drawn(method: str, count: int) -> SweepGrid:
    over = {
        "K": {"from": 1e5, "to": 1e7, "spacing": "log"},
        "epsilon": {"from": 0.1, "to": 0.5},
        "W0": {"mean": 7.0, "std": 0.1},
        "tilt": {"from": -0.1, "to": -0.001, "spacing": "log"},
    }
    axes = {"sample": {"draw": method, "count": count, "over": over}}
    return SweepGrid.of(SweepPlan(**FIXED, axes=axes, seed=5))


@pytest.mark.parametrize("method", ["random", "sobol", "halton"])
def test_draws_follow_their_distributions_and_need_no_earlier_ones(method: str) -> None:
    grid = drawn(method, 9000)
    (axis,) = grid.axes
    whole = axis.rows(0, 9000)
    for start, stop in ((0, 1), (4090, 4100), (8999, 9000)):
        part = axis.rows(start, stop)
        assert all(np.array_equal(part[name], whole[name][start:stop]) for name in whole)
    longer = drawn(method, 20_000).axes[0].rows(0, 9000)
    assert all(np.array_equal(longer[name], whole[name]) for name in whole)
    uniform = np.log(whole["K"] / 1e5) / np.log(100)
    assert kstest(uniform, "uniform").pvalue > 1e-3
    assert kstest(np.log(whole["tilt"] / -0.1) / np.log(0.01), "uniform").pvalue > 1e-3
    assert kstest((whole["W0"] - 7.0) / 0.1, "norm").pvalue > 1e-3
    assert abs(np.corrcoef(whole["epsilon"], uniform)[0, 1]) < 0.05


def test_the_grid_is_the_product_in_c_order(tmp_path: Path) -> None:
    axes = {"K": {"values": (1e5, 2e5)}, "epsilon": {"from": 0.1, "to": 0.3, "count": 3}}
    grid = SweepGrid.of(SweepPlan(**FIXED, axes=axes))
    assert grid.shape == (2, 3)
    points = grid.between((slice(0, 2), slice(0, 3)))
    assert points.values["K"].tolist() == [1e5] * 3 + [2e5] * 3
    assert points.values["epsilon"].tolist() == [0.1, 0.2, 0.3] * 2
    every = np.concatenate([grid.at(c).values["epsilon"] for c in range(grid.chunk_count)])
    assert sorted(every.tolist()) == sorted([0.1, 0.2, 0.3] * 2)


def test_a_thousand_billion_points_take_no_memory() -> None:
    axes = {
        "sample": {"draw": "halton", "count": 10**9, "over": {"K": {"from": 1e5, "to": 1e6}}},
        "epsilon": {"from": 0.1, "to": 0.3, "count": 1000},
    }
    grid = SweepGrid.of(SweepPlan(**FIXED, axes=axes))
    assert grid.points == 10**12
    last = grid.at(grid.chunk_count - 1)
    assert len(last) == grid.size(grid.chunk_count - 1) <= 20_000
    assert last.values["epsilon"][-1] == 0.3


def test_a_file_says_its_units(tmp_path: Path) -> None:
    plan = tmp_path / "plan.toml"
    head = 'law = "rice-ruina"\nmaterial = "bureau2000"\n'
    text = head + "[parameters]\nV = {V}\n[axes.K]\nvalues = {K}\n"
    plan.write_text(text.format(V='"1 um/s"', K='["0.2 N/um"]'))
    assert load_plan(plan).parameters["V"] == "1 um/s"
    plan.write_text(text.format(V="1e-6", K="[2e5]"))
    with pytest.raises(InputError, match=r"parameters\.V must carry a unit.*axes\.K must carry"):
        load_plan(plan)
    plan.write_text("law = [")
    with pytest.raises(InputError, match="must be valid TOML"):
        load_plan(plan)


@pytest.mark.parametrize(
    ("fields", "message"),
    [
        ({"parameters": {"V": 10**400}}, r"parameters\.V must"),
        ({"solve": "threshold", "threshold": {"scan": 10**400}}, r"threshold\.scan must"),
        (
            {
                "axes": {
                    "s": {"draw": "random", "count": 2, "over": {"M": {"mean": "1 kg", "std": []}}}
                }
            },
            r"axes\.s\.M\.std must be one number",
        ),
    ],
)
def test_no_value_of_a_plan_is_beyond_a_sentence(fields: dict[str, object], message: str) -> None:
    axes = {"epsilon": {"values": [0.1]}}
    plan = {"law": "rice-ruina", "material": "bureau2000", "axes": axes, **fields}
    with pytest.raises(InputError, match=message):
        SweepGrid.of(SweepPlan.of_content(plan, "plan"))


@pytest.mark.parametrize(
    ("fields", "place"),
    [
        ({"parameters": {"K": "0.3 N/um"}}, "parameters.K"),
        ({"axes": {"K": {"values": ["0.2 N/um", "0.3 N/um"]}}}, "axes.K"),
        ({"axes": {"K/Kc": {"values": [0.5, 1.5]}}}, "axes.K/Kc"),
    ],
)
def test_a_threshold_of_the_stiffness_refuses_a_stiffness(fields, place) -> None:
    axes = {"epsilon": {"values": [0.1]}}
    parameters = {"V": "1 um/s", "frequency": "120 Hz", **fields.get("parameters", {})}
    plan = SweepPlan(
        law="rice-ruina", material="bureau2000", solve="threshold",
        **{"axes": axes, **fields, "parameters": parameters},
    )  # fmt: skip
    with pytest.raises(InputError, match=f"{place} must be left out where its threshold"):
        SweepGrid.of(plan)


def test_a_number_of_a_transient_has_times_in_order() -> None:
    number = {"of": "friction", "take": "mean", "from": "2 s", "to": "1 s"}
    table = {"steps": ["slide for 3 s"], "numbers": {"late": number}, "sampling": "5 Hz"}
    axes = {"V": {"values": ["1 um/s"]}}
    plan = SweepPlan(
        law="rice-ruina", material="bureau2000", solve="transient", transient=table, axes=axes
    )
    with pytest.raises(InputError, match=r"late must have a 'from' before its 'to', got 2 s and"):
        SweepGrid.of(plan)


def test_an_unknown_law_is_the_one_mistake_of_a_plan() -> None:
    """The parameters, which the law that was meant may have, are no second mistake."""
    axes = {"K": {"values": (1e5, 2e5)}}
    plan = SweepPlan(**{**FIXED, "law": "rice-runia"}, axes=axes)
    with pytest.raises(InputError, match="did you mean 'rice-ruina'") as caught:
        SweepGrid.of(plan)
    assert "belong to the laws" not in str(caught.value)


def spans(*counts: int) -> dict[str, object]:
    names = ("K", "epsilon", "A", "B", "W0", "V0")
    return {
        name: {"from": 0.1, "to": 0.3, "count": count}
        for name, count in zip(names, counts, strict=False)
    }


def test_plans_beyond_memory_are_refused_before_anything(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A hundred gigabytes and more, by any of the ways in which a short plan asks for them."""
    monkeypatch.setattr(targets, "free_memory", lambda: 16e9)
    monkeypatch.setattr(targets, "free_disk", lambda folder: 1e12)
    draw = np.random.default_rng(0)
    rows = [int(n) for n in draw.integers(60_000, 100_000, 4)]
    lists = {n: (draw.uniform(0.1, 0.3, 1000)).tolist() for n in ("A", "B", "epsilon", "W0")}
    drawn = {"draw": "random", "count": int(10 ** draw.uniform(11.5, 22)),
             "over": {"epsilon": {"from": 0.1, "to": 0.2}}}  # fmt: skip
    few = {"epsilon": {"values": (0.1, 0.2)}}
    huge = int(10 ** draw.uniform(9, 18))
    plans = {
        "axes must give at most": {"axes": spans(*rows)},
        "axes.case must have from 1 to 1,000,000 rows": {"axes": {"case": {"cases": [lists]}}},
        "axes must (fit into|give at most)": {"axes": {"sample": drawn}},
        "threshold.scan must fit into": {
            "axes": few, "solve": "threshold", "threshold": {"scan": huge}
        },
        "chunk must fit into": {
            "axes": {**spans(10**5, 1, 10**5), **few}, "chunk": huge
        },
    }  # fmt: skip
    for message, fields in plans.items():
        with pytest.raises(InputError, match=message):
            run_sweep(SweepPlan(**{**FIXED, **fields}), tmp_path / "s.zarr", workers=1)
    assert list(tmp_path.iterdir()) == []


def test_every_case_names_its_law_if_one_does() -> None:
    """The case without a law would be solved with that of another case."""
    cases = [{"epsilon": 0.1}, {"law": "ruina-slip", "epsilon": 0.1}]
    axes = {"case": {"cases": cases}}
    with pytest.raises(InputError, match=r"cases must all have 'law' or none of them.* case 1;"):
        SweepGrid.of(SweepPlan(material="bureau2000", parameters=FIXED["parameters"], axes=axes))


def test_a_plan_may_not_name_its_reader(tmp_path: Path) -> None:
    (tmp_path / "plan.toml").write_text('self = 5\nlaw = "rice-ruina"\naxes.K.values = []\n')
    with pytest.raises(InputError, match="self must be a known field"):
        load_plan(tmp_path / "plan.toml")


def test_the_word_of_one_field_is_meant_for_it(tmp_path: Path) -> None:
    """By the likeness of names "scale" is "cases", which takes no such word."""
    grid = '{ from = 0.1, to = 0.2, count = 3, scale = "log" }'
    (tmp_path / "plan.toml").write_text(f'law = "rice-ruina"\naxes.epsilon = {grid}\n')
    with pytest.raises(InputError, match=r"scale must be a known field, .* mean 'spacing'"):
        load_plan(tmp_path / "plan.toml")
