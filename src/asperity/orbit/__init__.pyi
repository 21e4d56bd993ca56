# Public names of the package, each with its module; `asperity._lazy` imports them when used.

from asperity.orbit.derivatives.mesh_search import KnownOrbits as KnownOrbits
from asperity.orbit.derivatives.parametrised import ResponseValues as ResponseValues
from asperity.orbit.derivatives.response_function import (
    ResponseFunction as ResponseFunction,
    response_function as response_function,
)
from asperity.orbit.derivatives.sensitivities import (
    Sensitivities as Sensitivities,
    sensitivities as sensitivities,
)
from asperity.orbit.outcome import Outcome as Outcome
from asperity.orbit.periodic import (
    averaged_response as averaged_response,
    periodic_response as periodic_response,
)
from asperity.orbit.response import PeriodicResponse as PeriodicResponse
from asperity.orbit.waveform import (
    Period as Period,
    over_a_period as over_a_period,
)
