"""The page in a cell of a notebook."""

from __future__ import annotations

import html
from functools import cache
from typing import Annotated, Any
from urllib.parse import urlencode

import numpy as np

from asperity.errors import require
from asperity.laws import registered
from asperity.parameters import DRIVE
from asperity.parameters.arguments import at_least, typed
from asperity.slider import Slider
from asperity.slider.parameters import slider_values


class Page:
    """A view of the page, which a notebook shows in its cell.

    Attributes
    ----------
    address : str
        Address for any browser of this machine.
    height : int
        Height of the frame (px).
    """

    def __init__(self, address: str, height: int) -> None:
        self.address = address
        self.height = height

    def __repr__(self) -> str:
        return f"<asperity page: {self.address}>"

    def _repr_html_(self) -> str:
        address = html.escape(self.address, quote=True)
        return (
            f'<iframe src="{address}" width="100%" height="{self.height}" '
            'title="asperity" style="border: 0"></iframe>'
        )


@typed
def explore(
    slider: Slider | None = None,
    *,
    velocity: Any = None,
    epsilon: Any = None,
    frequency: Any = None,
    height: Annotated[int, at_least(100)] = 900,
) -> Page:
    """Show the page's Explore tab in a notebook's cell.

    A server runs in the background of this process, for browsers of this machine only.

    Parameters
    ----------
    slider : Slider, optional
        Start values of the page's sliders; its law must be registered.
    velocity, epsilon, frequency : float or str, optional
        As for `asperity.periodic_response`.
    height : int
        Height of the frame (px).

    Returns
    -------
    Page
        Shown by Jupyter; elsewhere, open its `address`.

    Raises
    ------
    InputError
        If the extra ``app`` is not installed, or a value breaks its rule.

    Examples
    --------
    The last line of a cell is ``page``.

    >>> import asperity as asp
    >>> pmma = asp.materials.load("bureau2000")
    >>> slider = asp.Slider(pmma.law("rice-ruina"), spring=pmma.K, mass=pmma.M, load=pmma.W0)
    >>> page = asp.explore(slider, velocity="1 um/s", epsilon=0.24, frequency="120 Hz")
    """
    values: dict[str, Any] = {}
    if slider is not None:
        law = type(slider.law)
        known, advice = registered().get(law.name) is law, "register it with asperity.laws.register"
        require(known, "slider.law", "be a registered one", law.__name__, advice)
        values = {"law": law.name, "laws": "", **slider_values(slider)}
    for name, value in (("V", velocity), ("epsilon", epsilon), ("frequency", frequency)):
        if value is not None:
            values[name] = DRIVE[name].check(value)
    for name, value in values.items():
        if isinstance(value, str):
            continue
        got, advice = f"an array of shape {np.shape(value)}", "the page shows one operating point"
        require(
            np.size(value) == 1,
            DRIVE[name].label if name in DRIVE else name,
            "be one number",
            got,
            advice,
        )
        values[name] = repr(float(np.ravel(value)[0]))
    fragment = f"#explore?{urlencode(values)}" if values else "#explore"
    return Page(_server() + fragment, height)


@cache
def _server() -> str:
    """The address of the server of this process, which starts at the first call."""
    from asperity.app.server import serve_in_background

    return serve_in_background()
