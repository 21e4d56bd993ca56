"""One table of parameters and outputs: names, symbols, units, rules, defaults, places.

Command line, tables, maps, sweeps, continuation, materials, JSON and the page of nomenclature take
every name from here.
"""

from asperity._lazy import public_names
from asperity.parameters.arguments import typed as typed
from asperity.parameters.parameter import (
    NAMES as NAMES,
    Names as Names,
    Output as Output,
    Parameter as Parameter,
)
from asperity.parameters.rules import RULES as RULES, Rule as Rule, obeying as obeying
from asperity.parameters.table import (
    DRIVE as DRIVE,
    EXPERIMENT as EXPERIMENT,
    INTERFACE as INTERFACE,
    MACHINE as MACHINE,
    MODULATION as MODULATION,
    OUTPUTS as OUTPUTS,
    RESULT_COLUMNS as RESULT_COLUMNS,
    all_parameters as all_parameters,
    canonical_name as canonical_name,
    display_name as display_name,
    known_name as known_name,
    law_parameters as law_parameters,
    plain_name as plain_name,
    point_parameters as point_parameters,
    required as required,
    suggestion as suggestion,
    symbol_of as symbol_of,
)

__all__ = public_names(globals())
