"""Wrong kinds of arguments at the public door: one sentence of `InputError`, whatever they are."""

import datetime
import inspect
import re
from collections.abc import Callable, Iterator
from decimal import Decimal
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import asperity as asp
from asperity.errors import InputError
from asperity.loads import (
    CyclicLoading,
    Hold,
    Modulate,
    Programme,
    RampLoad,
    RampVelocity,
    Slide,
    StepLoad,
    modulated,
)
from asperity.study.map import Axis, write_map
from asperity.study.threshold import stiffness_threshold

PMMA = asp.materials.load("bureau2000")
LAW = PMMA.law("rice-ruina")
SLIDER = asp.Slider(LAW, spring=PMMA.K, load=PMMA.W0, mass=PMMA.M)
PROGRAMME = Programme(Slide("1 s"), load="7 N", velocity="1 um/s")
POINT = {"velocity": 1e-6, "epsilon": 0.1, "frequency": 120.0}
NUMBERS = {n: PMMA[n].si for n in ("mu0", "A", "B", "D0", "V0", "K", "W0")} | {"V": 1e-6}
AXES = {"x": Axis("epsilon", 0.0, 0.1, 2), "y": Axis("frequency", 100.0, 120.0, 2)}

#: Values that no argument of a public function may have, none of them quite like another.
WRONG: dict[str, Any] = {
    "an object": object(),
    "a class": dict,
    "a complex number": 1j,
    "bytes": b"\0",
    "a text with a NUL": "a\0b",
    "a dictionary": {"a": object()},
    "a set": {1.5, "x"},
    "a ragged list": [[1.0], [1.0, 2.0]],
    "nan": float("nan"),
    "a date": datetime.date(2000, 1, 1),
    "an array of objects": np.array([object(), None]),
    "an array of texts": np.array(["one", "two"]),
    "a huge integer": 10**400,
    "a long text": "9" * 9000,
    "a decimal": Decimal("NaN"),
    "a module": np,
    "a lambda": lambda: None,
}
#: Kinds that fit some arguments, by the arguments that they fit.
FITS = {
    "progress": {"a class", "a lambda"},
    "numbers": set(),
}
#: By function: arguments that are right, and further wrong ones of single arguments.
CASES: dict[str, tuple[Callable[..., Any], dict[str, Any], list[tuple[str, Any]]]] = {
    "Slider": (
        lambda law, **given: asp.Slider(law, **given),
        {"law": LAW, "spring": 2e5, "load": 7.0, "mass": 1.6},
        [("law", "rice-ruina"), ("law", SLIDER), ("spring", None), ("mass", ["1 kg", "2 m"])],
    ),
    "periodic_response": (
        asp.periodic_response,
        {
            "slider": SLIDER,
            **POINT,
            "inertia": False,
            "harmonics": 4,
            "waveform": 0,
            "workers": 1,
            "methods": ("fourier",),
            "modulation": None,
            "radiation_damping": None,
            "progress": None,
        },
        [
            *[("harmonics", v) for v in (2.5, None, 1, True, "8", [8], np.array([4, 8]))],
            *[("waveform", v) for v in (-1, 1.0, None, "64")],
            *[("workers", v) for v in ("2", 0, 1.5, [1])],
            *[("methods", v) for v in (None, "fourier", (), 3, ("quick",), (1,))],
            *[("inertia", v) for v in ([True, False], np.array([True]), 1, None, "yes")],
            *[("slider", v) for v in (LAW, None, "slider", asp.Slider)],
            ("modulation", 0.2),
            ("epsilon", range(2)),
            ("velocity", None),
        ],
    ),
    "response_function": (
        asp.response_function,
        {"law": "rice-ruina", "inertia": False, "harmonics": 2, "modulation": None},
        [("law", LAW), ("inertia", [True]), ("harmonics", 1.5), ("modulation", 0.2)],
    ),
    "averaged_response": (
        asp.averaged_response,
        {"slider": SLIDER, "velocity": 1e-6, "epsilon": 0.1},
        [("slider", LAW)],
    ),
    "sensitivities": (asp.sensitivities, {"slider": SLIDER, **POINT}, [("inertia", [True])]),
    "perturbation_response": (
        asp.perturbation_response,
        {"slider": SLIDER, "velocity": 1e-6, "frequency": 120.0},
        [("slider", LAW)],
    ),
    "continuation": (
        asp.continuation,
        {
            "slider": SLIDER,
            "parameter": "epsilon",
            "span": (0.0, 0.1),
            "velocity": 1e-6,
            "frequency": 120.0,
            "most_steps": 5,
            "harmonics": 2,
            "inertia": False,
        },
        [
            *[("parameter", v) for v in (None, 3, ["K"], "inertia")],
            *[("span", v) for v in (None, 0.1, (0.1,), "ab", (0.0, None), ([0.0, 0.1], 0.2))],
            *[("most_steps", v) for v in (0, 2.0, None)],
            *[("inertia", v) for v in ([True, False], None)],
            ("slider", LAW),
        ],
    ),
    "stability_boundary": (
        asp.stability_boundary,
        {
            "slider": SLIDER,
            "x": "epsilon",
            "y": "K",
            "x_span": (0.0, 0.1),
            "y_span": (1e5, 2e5),
            "velocity": 1e-6,
            "frequency": 120.0,
            "lines": 2,
        },
        [("lines", 1.5), ("lines", None), ("x", 3), ("y_span", 1e5), ("slider", None)],
    ),
    "doubled_branch": (
        asp.doubled_branch,
        {"branch": None, "bifurcation": None},
        [("branch", 3)],
    ),
    "transient": (
        asp.transient,
        {
            "slider": SLIDER,
            "programme": PROGRAMME,
            "inertia": False,
            "method": "auto",
            "rtol": 1e-6,
        },
        [
            *[("programme", v) for v in (None, Slide("1 s"), [Slide("1 s")], Programme)],
            *[("method", v) for v in (None, 3, "quick", ("auto",))],
            *[("inertia", v) for v in ([True, False], 1)],
            *[("rtol", v) for v in (None, [1e-6, 1e-7], "small")],
            ("slider", LAW),
        ],
    ),
    "map": (
        asp.map,
        {"law": "rice-ruina", "numbers": NUMBERS, **AXES},
        [("law", 3), ("numbers", None), ("numbers", {"V": [1, 2]}), ("x", "epsilon"), ("y", None)],
    ),
    "Axis": (
        Axis,
        {"name": "epsilon", "low": 0.0, "high": 0.1, "count": 3, "log": False},
        [("name", 3), ("low", [0.0, 0.1]), ("count", 2.5), ("count", None), ("log", "yes")],
    ),
    "stiffness_threshold": (
        stiffness_threshold,
        {"slider": SLIDER, **POINT, "scan": 4, "between": None},
        [("scan", 1.5), ("between", 3), ("between", (1e5,)), ("epsilon", [[0.1], [0.1, 0.2]])],
    ),
    "Programme": (
        lambda load, velocity, **step: Programme(Slide(**step), load=load, velocity=velocity),
        {"load": 7.0, "velocity": 1e-6, "duration": 1.0},
        [("load", [7.0, 8.0]), ("duration", None), ("duration", np.array([1.0, 2.0]))],
    ),
    **{
        step.__name__: (
            lambda _step=step, **given: Programme(_step(**given), load=7.0, velocity=1e-6),
            right,
            [(name, [1.0, 2.0]) for name in right],
        )
        for step, right in (
            (Hold, {"duration": 1.0}),
            (RampLoad, {"to": 8.0, "duration": 1.0}),
            (RampVelocity, {"to": 1e-5, "duration": 1.0}),
            (Modulate, {"duration": 1.0, "epsilon": 0.1, "frequency": 10.0, "phase": 0.0}),
            (
                CyclicLoading,
                {"duration": 1.0, "modulation": modulated(epsilon=0.1), "frequency": 10.0},
            ),
        )
    },
    "StepLoad": (
        lambda **given: Programme(StepLoad(**given), Slide(1.0), load=7.0, velocity=1e-6),
        {"to": 8.0},
        [("to", [7.0, 8.0])],
    ),
    "materials.load": (asp.materials.load, {"name": "bureau2000"}, [("name", 5), ("name", "")]),
    "Material.law": (
        lambda name: PMMA.law(name),
        {"name": "rice-ruina"},
        [("name", 3), ("name", None)],
    ),
    "Material[]": (lambda name: PMMA[name], {"name": "K"}, [("name", 3), ("name", None)]),
    "laws.get_law": (asp.laws.get_law, {"name": "rice-ruina"}, [("name", []), ("name", LAW)]),
    "read": (asp.read, {"path": "recording.csv"}, [("path", 3), ("path", None)]),
    "measure": (
        asp.measure,
        {"recording": "recording.csv", "modulated": True, "harmonics": 4, "detrend": "linear"},
        [("recording", 3), ("modulated", None), ("detrend", 3), ("recording", SLIDER)],
    ),
    "fit": (
        asp.fit,
        {"data": "recording.csv", "law": "rice-ruina", "free": ["A"]},
        [("data", 3), ("data", SLIDER), ("law", 3), ("law", SLIDER), ("free", 3), ("free", [3])],
    ),
    "compare": (
        asp.compare,
        {"data": "recording.csv", "laws": ["rice-ruina", "ruina-slip"]},
        [("data", 3), ("data", SLIDER), ("laws", 3), ("laws", [SLIDER]), ("laws", "rice")],
    ),
    "run": (
        asp.run,
        {"protocol": "protocol.toml", "out": "run.nc"},
        [("protocol", 3), ("protocol", PROGRAMME), ("protocol", None)],
    ),
    "units.to_si": (
        lambda value: asp.units.to_si(value, "velocity", "velocity"),
        {"value": 1e-6},
        [("value", None), ("value", [1, None])],
    ),
}


def attempts() -> Iterator[Any]:
    for name, (call, right, more) in CASES.items():
        for argument in right:
            for what, value in WRONG.items():
                if what not in FITS.get(argument, ()):
                    yield pytest.param(
                        call, {**right, argument: value}, id=f"{name} {argument} {what}"
                    )
        for argument, value in more:
            shown = re.sub(r"\s+", " ", repr(value))[:30]
            yield pytest.param(call, {**right, argument: value}, id=f"{name} {argument} {shown}")


@pytest.mark.parametrize(("call", "arguments"), list(attempts()))
def test_a_wrong_kind_of_argument_is_refused_in_a_sentence(call, arguments) -> None:
    with pytest.raises(InputError) as caught:
        call(**arguments)
    message = str(caught.value)
    assert "\n" not in message
    assert " must " in message
    assert "; " in message
    assert len(message) < 600


def test_all_public_functions_are_tried() -> None:
    functions = {n for n in asp.__all__ if inspect.isfunction(getattr(asp, n))}
    # `explore` starts a server; tests/app has it.
    assert functions - {"explore"} <= set(CASES)


def test_a_range_is_an_array() -> None:
    assert asp.units.to_si(range(3), "velocity", "velocity").tolist() == [0.0, 1.0, 2.0]


def test_outputs_have_paths(tmp_path: Path) -> None:
    for path in (3, None, "a\0b"):
        with pytest.raises(InputError, match="must be"):
            write_map(path, "rice-ruina", NUMBERS, **AXES)  # type: ignore[arg-type]
