"""The table of outputs: every quantity that a periodic response has, by its one name."""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType

from asperity.parameters.parameter import Output

#: Every output. Convention: F/W0 = mean_friction + sum of mu_n cos(n w t + phase_n).
OUTPUTS: Mapping[str, Output] = MappingProxyType(
    {
        output.name: output
        for output in (
            Output("mean_friction", "1", "mean of F/W0", r"\bar F/W_0"),
            Output("delta_mu", "1", "change of the mean by the modulation", r"\Delta\bar\mu"),
            Output("mu_ss", "1", "friction coefficient of steady sliding", r"\bar\mu(V)"),
            Output("mu1", "1", "first harmonic of F/W0, peak", r"\mu_1"),
            Output("mu2", "1", "second harmonic of F/W0, peak", r"\mu_2"),
            Output("phase1", "rad", "phase of the first harmonic", r"\arg c_1"),
            Output("phase2", "rad", "phase of the second harmonic", r"\arg c_2"),
            Output("harmonics", "1", "complex amplitudes of F/W0", "c_n"),
            Output("multipliers", "1", "Floquet multipliers", "m", former=("floquet",)),
            Output(
                "log_multipliers",
                "1",
                "ln|m| + i arg m of the Floquet multipliers",
                r"\ln m",
            ),
            Output("floquet_max", "1", "largest modulus of the multipliers", r"\max\lvert m\rvert"),
            Output(
                "log_multiplier",
                "1",
                "logarithm of the largest modulus of the multipliers",
                r"\max\ln\lvert m\rvert",
            ),
            Output("mode", "1", "bifurcation of the leading multiplier"),
            Output("mode_frequency", "Hz", "frequency of the leading mode, modulo f"),
            Output("growth_rate", "1/s", "growth rate of the leading mode"),
            Output("stable", "1", "all multipliers inside the unit circle"),
            Output("converged", "1", "whether the point was solved"),
            Output("result", "1", "converged, or why not"),
        )
    }
)

#: Columns that a table of operating points gets.
RESULT_COLUMNS = (
    "mean_friction",
    "delta_mu",
    "mu1",
    "mu2",
    "phase1",
    "phase2",
    "floquet_max",
    "stable",
    "converged",
    "result",
)
