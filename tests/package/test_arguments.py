"""Annotations are the check of arguments: a `TypeError` for another type, sentences for values."""

from __future__ import annotations

import datetime
import inspect
import pickle
from collections.abc import Callable, Mapping, Sequence
from decimal import Decimal
from pathlib import Path
from typing import Annotated, Any, Literal

import numpy as np
import pytest
from jax.typing import ArrayLike

import asperity as asp
from asperity.errors import InputError, InputTypeError, closest
from asperity.figures.plot import Panel, Plot
from asperity.laws import Law
from asperity.loads import CyclicLoading, Hold, Programme, Slide
from asperity.outputs import UnfinishedText, output_file
from asperity.parameters.arguments import FilePath, annotations_of, at_least, of_type, typed
from asperity.questions.sweep import Sweep
from asperity.study.map import Axis, write_map
from asperity_papers.bureau2000.machine import Machine

PMMA = asp.materials.load("bureau2000")
LAW = PMMA.law("rice-ruina")
SLIDER = asp.Slider(LAW, spring=PMMA.K, load=PMMA.W0, mass=PMMA.M)
POINT = {"velocity": 1e-6, "epsilon": 0.1, "frequency": 120.0}

#: Values that are no number, text, path or list of them, none quite like another.
ODD: dict[str, Any] = {
    "an object": object(),
    "a complex number": 1j,
    "bytes": b"\0",
    "a set": {1.5, "x"},
    "a date": datetime.date(2000, 1, 1),
    "an array of objects": np.array([object(), None]),
    "a decimal": Decimal("NaN"),
    "a module": np,
}
#: By kind: what fits, as it comes in, and what has another type.
KINDS: list[tuple[Any, list[tuple[Any, Any]], list[Any]]] = [
    (bool, [(True, True), (np.False_, False)], [1, 0.0, "yes", None, [True], np.array([True])]),
    (int, [(3, 3), (np.int64(3), 3)], [2.0, True, "8", None, [8], np.array([4, 8])]),
    (float, [(0.5, 0.5), (2, 2), (np.float32(0.5), 0.5)], ["1", None, True, [0.5]]),
    (str, [("text", "text")], [3, None, ["text"], str]),
    (FilePath, [("a/b", Path("a/b")), (Path("c"), Path("c"))], [3, None, ["a"]]),
    (int | None, [(None, None), (1, 1)], ["1", 1.5]),
    (bool | Literal["direct"], [(False, False), ("direct", "direct")], [1, None]),
    (Callable[[int], None], [(print, print)], [3, "print", None]),
    (Mapping[str, float], [({"a": 1.0}, {"a": 1.0})], [3, "ab", [("a", 1.0)]]),
    (Sequence[str], [(["a"], ("a",)), ((), ())], ["ab", 3, [3], None]),
    (
        tuple[float, float],
        [([1, 2], (1, 2)), (np.ones(2), (1.0, 1.0))],
        ["ab", (1,), np.float64(0.1), None],
    ),
    (type[Law], [(type(LAW), type(LAW))], [LAW, int, "rice-ruina"]),
    (Law, [(LAW, LAW)], [type(LAW), SLIDER, "rice-ruina"]),
]


@pytest.mark.parametrize(("kind", "right", "wrong"), KINDS, ids=[str(k[0])[:40] for k in KINDS])
def test_a_value_has_the_type_of_its_annotation(kind, right, wrong) -> None:
    for value, expected in right:
        taken = of_type(value, kind, "argument")
        assert taken == expected
        assert type(taken) is type(expected) or isinstance(value, np.floating)
    for value in [*wrong, *ODD.values()]:
        with pytest.raises(TypeError, match=r"argument(\[\d\])? must be ") as caught:
            of_type(value, kind, "argument")
        assert len(str(caught.value)) < 200
        assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("kind", "value", "sentence"),
    [
        (Annotated[int, at_least(2)], 1, "x must be at least 2, got 1; give a larger one"),
        (Annotated[int, at_least(0)], 10**400, "got a huge integer"),
        (Literal["auto", "explicit"], "explicitt", "did you mean 'explicit'?"),
        (tuple[Literal["auto"], ...], ["auto", "quick"], "x[1] must be one of auto, got 'quick'"),
        (FilePath, "a\0b", "x must be the path of a file"),
        (FilePath, "a\ud800b", "x must be the path of a file"),
    ],
)
def test_a_value_obeys_the_rule_of_its_annotation(kind, value, sentence) -> None:
    with pytest.raises(InputError) as caught:
        of_type(value, kind, "x")
    assert sentence in str(caught.value)
    assert not isinstance(caught.value, TypeError)


@pytest.mark.parametrize("value", [*ODD.values(), dict, "9" * 9000, None, [[1], [1, 2]], [1, None]])
def test_a_quantity_is_a_number_or_a_text(value) -> None:
    """Of any shape: what converts it to SI says what is wrong, here through a public function."""
    with pytest.raises(InputError, match=r"velocity must .*; ") as caught:
        asp.periodic_response(SLIDER, **{**POINT, "velocity": value})
    assert len(str(caught.value)) < 600


@pytest.mark.parametrize(
    ("call", "name"),
    [
        (lambda: asp.Slider("rice-ruina", spring=1.0, load=1.0), "law"),
        (lambda: asp.periodic_response(LAW, **POINT), "slider"),
        (lambda: asp.periodic_response(SLIDER, **POINT, inertia=[True, False]), "inertia"),
        (lambda: asp.response_function("rice-ruina", modulation=0.2), "modulation"),
        (lambda: asp.transient(SLIDER, Slide("1 s")), "programme"),
        (lambda: Programme(3, load=7.0, velocity=1e-6), "steps"),
        (lambda: CyclicLoading("1 s", 0.2, 10.0), "modulation"),
        (lambda: asp.map("rice-ruina", {}, x="epsilon", y="K"), "x"),
        (lambda: Axis("epsilon", 0.0, 0.1, 2.5), "count"),
        (lambda: write_map(None, "rice-ruina", {}, x="epsilon", y="K"), "out"),
        (lambda: asp.laws.get_law(LAW), "name"),
        (lambda: PMMA[3], "name"),
        (lambda: asp.fit(SLIDER), "data"),
        (lambda: asp.compare("data.csv", [SLIDER]), "laws"),
        (lambda: asp.run(Hold("1 s"), "run.nc"), "protocol"),
        (lambda: asp.inference.averaged_cycle(3), "measurement"),
        (lambda: asp.ledger.reproduce("bureau2000", "paper"), "paper"),
        (lambda: asp.theory.closed_forms.determinant(PMMA), "p"),
        (lambda: asp.experiment.Exciter(120.0, "all"), "transfer"),
        (lambda: asp.recording.Channel("x"), "Channel.values"),
        (lambda: asp.recording.check(3), "trace"),
        (lambda: asp.recording.Finding(1, "note", 0.0, "F", "x"), "name"),
        (lambda: asp.loads.Periodic(load={1: 0.2}), "load"),
        (lambda: asp.inference.LockInTable("x", None, {}, {}), "points"),
        (lambda: asp.orbit.PeriodicResponse.from_search(3, (), 0.5, 3, 3), "solution"),
        (lambda: asp.orbit.ResponseValues.of_columns("x", 0, 2), "columns"),
        (lambda: asp.orbit.ResponseFunction(3, {}), "program"),
        (lambda: asp.orbit.response_function("rice-ruina")(["V"]), "parameters"),
        (lambda: asp.transients.Trajectory.joined(3), "blocks"),
        (lambda: asp.theory.linear_stability.steady_growth(SLIDER), "motion"),
        (lambda: asp.parameters.Parameter(3, "length", "positive"), "name"),
        (lambda: output_file(3), "path"),
        (lambda: UnfinishedText("out.csv", {}), "target"),
        (lambda: asp.slider.equation_of_motion(SLIDER, 1e-6, 1.0, eta="x"), "eta"),
        (lambda: Machine(3), "numbers"),
    ],
)
def test_public_functions_are_checked(call, name) -> None:
    with pytest.raises(TypeError, match=rf"^{name}(\[0\])? must be "):
        call()


TIME = np.arange(64) / 64.0
FORCE = asp.recording.Channel(3 + np.cos(9 * TIME), "force", "N")
TRACE = asp.recording.Trace(TIME, {"F": FORCE, "W": FORCE})
RECORDER = asp.tribometer.Recorder(rate=9.0)
PROGRAMME = Programme(Slide("1 s"), load=7.0, velocity=1e-6)
PRINTED = {"dimension": "length", "kind": "fitted", "place": "Fig. 1"}
READINGS = {"V": [1e-6], "epsilon": [0.1], "frequency": [9.0], "mu1": [1e-3], "mu1_err": [1e-5]}


@pytest.mark.parametrize(
    ("call", "sentence"),
    [
        (lambda: asp.fit([]), "data must hold readings or a recording, got none"),
        (lambda: asp.fit(TRACE, fixed=["A"]), "fixed must be a dictionary or None"),
        (lambda: asp.fit(TRACE, prior={"A": 1}), "prior.A must be a table, got 1"),
        (lambda: asp.fit(TRACE, prior=["A=1"]), r"prior.A must be VALUE\+-DEVIATION UNIT"),
        (lambda: asp.inference.Prior(0.1, -1.0, "given"), "prior.sd must be positive, got -1"),
        (lambda: asp.inference.table_of({**READINGS, "V": "fast"}), "data.V must be numbers in SI"),
        (lambda: asp.inference.table_of(READINGS, run=["a", "b"]), "run must have 1 names, got 2"),
        (lambda: asp.inference.recorded_run(TRACE, window=3), "window must be a tuple or None"),
        (lambda: asp.measure(TRACE, load="x"), "measure.load must name a channel, got none like"),
        (lambda: asp.recording.derive(TRACE, {"x": 3}), r"channels\['x'\] must be a text, got 3"),
        (lambda: asp.read("a.csv", columns={"W": 1.5}), r"columns\['W'\] must be a text or a wh"),
        (lambda: asp.loads.modulated(0.1, load=3), "load must be a dictionary or None"),
        (lambda: asp.loads.modulated(0.1, pull_phase=np.nan), "pull_phase must be finite, got nan"),
        (lambda: asp.loads.sampled("fast"), "load must be a finite number, got 'fast'"),
        (lambda: asp.run(3, "run.csv"), "protocol must be a Protocol"),
        (lambda: asp.experiment.hold_response(SLIDER, hold_time=[], velocity=1e-6), "have a point"),
        (lambda: asp.periodic_response(SLIDER, **{**POINT, "epsilon": []}), "have a point, got an"),
        (lambda: asp.write([], "a.csv"), "data must hold a measurement, got none"),
        (lambda: asp.experiment.Exciter("120 mm"), "Exciter.frequency must be a frequency"),
        (lambda: asp.recording.Trace([0.0], {"F": [1.0]}), r"Trace.channels\['F'\] must be a Chan"),
        (
            lambda: asp.tribometer.Tribometer(sensors={}, recorder=RECORDER).record(
                [0.0], {}, seed=-1
            ),
            "seed must be at least 0",
        ),
        (
            lambda: asp.tribometer.Recorder(rate=9.0, clock_error="x"),
            "clock_error must be a number",
        ),
        (lambda: asp.Slider(LAW, spring=-1.0, load=7.0), "slider.spring must be positive, got -1"),
        (
            lambda: asp.sensitivities(SLIDER, **{**POINT, "velocity": np.empty(0)}),
            "have a point",
        ),
        (lambda: asp.units.from_si(["x"], "um/s", "velocity"), "value must be a number or an arr"),
        (lambda: asp.units.from_si(1.0, 3, "velocity"), "unit must be a text, got 3"),
        (lambda: asp.units.to_si(1.0, ["velocity"], "x"), "units.kind must be a text, got a list"),
        (lambda: asp.units.format_si("x", "velocity"), "value must be a number, got 'x'"),
        (lambda: asp.units.format_si(1.0, "velocity", "4"), "digits must be a whole number from"),
        (lambda: asp.air.transfer_function(9.0, W0=7, M=1, lambda_z=1e-6, layer=3), "layer must"),
        (lambda: asp.air.NormalContact(7.0, 1e-6).load("fast"), "closure must be a finite number"),
        (lambda: asp.air.NormalContact(7.0, 1e-6).load_harmonics(1e-7, 2.5), "count must be a who"),
        (lambda: Axis.parse(3), "text must be a text, got 3"),
        (lambda: asp.units.from_si(True, "um/s", "velocity"), "value must be a number or an arr"),
        (lambda: asp.units.quantity_text(1.0, None), "unit must be a text, got None"),
        (lambda: asp.parameters.law_parameters(3), "law must be a class, got 3"),
        (lambda: asp.parameters.law_parameters(int), "law must be the class of a law, got the cla"),
        (lambda: asp.parameters.known_name(3, {}), "name must be a text, got 3"),
        (lambda: asp.parameters.display_name("A", "x"), "names must be one of friction"),
        (lambda: asp.Slider(LAW, spring=1e-320, load=7.0), "range of double precision, got 9."),
        (lambda: asp.parameters.obeying(1.0, "x", "velocity", 3), "rule must be a known rule"),
        (lambda: asp.study.reasons("x", 1.0), "outcome must be the variable of a store"),
        (lambda: asp.inference.LockInTable("x", {}, {}, {}), "points must have V of each row"),
        (lambda: TRACE.name_of(asp.recording.Channel([0.0])), "channel must be one of the trace"),
        (lambda: asp.protocol.outline("none.nc"), "run must be a NetCDF file of a run that can be"),
        (lambda: PROGRAMME.load("x"), "t must be a finite number with a unit"),
        (lambda: asp.materials.Number(unit="m"), r"\(1\) Number.dimension must be given"),
        (lambda: asp.materials.Number(value=1.0, unit=3, **PRINTED), "Number.unit must be a text"),
        (lambda: asp.materials.Number(unit="m", **PRINTED), "Number must have a value, a range or"),
        (lambda: asp.protocol.Repeat(repeat="x", steps=[]), "Repeat.repeat must be a whole number"),
        (lambda: asp.protocol.ProtocolStart(velocity="3 kg"), "ProtocolStart.velocity must be a v"),
        (lambda: Panel(x=3, y="y"), "Panel.x must be a text, got 3"),
        (lambda: Plot(panel=[{"x": 3, "y": "y"}]), "Plot.panel.0.x must be a text, got 3"),
    ],
)
def test_what_no_call_may_pass_on(call, sentence) -> None:
    """Each of these was an exception from within, or an answer that left the value out."""
    with pytest.raises(InputError, match=sentence) as caught:
        call()
    assert "\n" not in str(caught.value)


def test_every_public_argument_has_a_kind() -> None:
    functions = [getattr(asp, n) for n in asp.__all__ if inspect.isfunction(getattr(asp, n))]
    assert len(functions) > 15
    for function in (*functions, asp.inference.fit, asp.inference.compare, asp.Slider.__init__):
        assert inspect.unwrap(function) is not function, f"{function.__name__} is not `typed`"
        given = {n for n in inspect.signature(function).parameters if n != "self"}
        assert set(annotations_of(function)) == given


def test_values_that_jax_traces_pass() -> None:
    @typed
    def double(value: ArrayLike | str) -> Any:
        return 2 * value  # type: ignore[operator]

    import jax

    assert jax.jit(double)(1.5) == 3.0


def test_a_wrong_type_is_bad_input_at_every_door() -> None:
    """What the command line and the page show in one line, also from another process."""
    error = pickle.loads(pickle.dumps(InputTypeError("x", "be a text", "3")))
    assert isinstance(error, InputError)
    assert isinstance(error, TypeError)
    assert str(error) == "x must be a text, got 3"


def test_a_range_is_an_array() -> None:
    assert asp.units.to_si(range(3), "velocity", "velocity").tolist() == [0.0, 1.0, 2.0]


LAWS = ("amontons", "elasto-plastic", "linker-dieterich", "rice-ruina")


def test_input_error_is_a_value_error() -> None:
    with pytest.raises(ValueError, match="must be > 0"):
        raise InputError("slider.spring must be > 0, got -1 N/m; give a stiffness")


@pytest.mark.parametrize(
    ("written", "meant"),
    [
        ("rice-ruine", "rice-ruina"),
        ("Amontons", "amontons"),
        ("elastoplastic", "elasto-plastic"),
        ("LINKER", "linker-dieterich"),
    ],
)
def test_a_near_name_is_suggested(written: str, meant: str) -> None:
    assert closest(written, LAWS) == f"did you mean '{meant}'?"


def test_several_types_are_a_list_and_a_whole_number_is_a_number() -> None:
    @typed
    def function(value: bool | str | float | int | None) -> None: ...

    with pytest.raises(TypeError, match=r"value must be True or False, a text, a number or None,"):
        function([])  # type: ignore[arg-type]
    plan = {"law": "rice-ruina", "parameters": {"V": [1]}, "axes": {"K": "1:2:3 N/m"}}
    with pytest.raises(
        InputError, match=r"parameters\.V must be true or false, a number or a text,"
    ):
        Sweep.of_content(plan)


def test_names_are_listed_when_none_is_near() -> None:
    assert closest("qqq", LAWS) == "choose one of " + ", ".join(LAWS)


def test_the_suggestion_keeps_the_case_of_the_known_name() -> None:
    assert closest("d0", ["D0", "W0"]) == "did you mean 'D0'?"


def test_any_iterable_will_do() -> None:
    assert closest("amonton", (name for name in LAWS)) == "did you mean 'amontons'?"
