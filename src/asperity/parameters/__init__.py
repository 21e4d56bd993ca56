"""One table of parameters and outputs: names, symbols, units, rules, defaults, places.

Command line, tables, maps, sweeps, continuation, materials, JSON and the page of nomenclature take
every name from here.
"""

from asperity.parameters.names import display_name, in_names, symbol_of
from asperity.parameters.parameter import NAMES, RULES, Names, Output, Parameter, Rule, obeying
from asperity.parameters.table import (
    DRIVE,
    EXPERIMENT,
    INTERFACE,
    MACHINE,
    MODULATION,
    OUTPUTS,
    RESULT_COLUMNS,
    all_parameters,
    canonical_name,
    known_name,
    law_parameters,
    plain_name,
    point_parameters,
    required,
    suggestion,
)

__all__ = [
    "DRIVE",
    "EXPERIMENT",
    "INTERFACE",
    "MACHINE",
    "MODULATION",
    "NAMES",
    "OUTPUTS",
    "RESULT_COLUMNS",
    "RULES",
    "Names",
    "Output",
    "Parameter",
    "Rule",
    "all_parameters",
    "canonical_name",
    "display_name",
    "in_names",
    "known_name",
    "law_parameters",
    "obeying",
    "plain_name",
    "point_parameters",
    "required",
    "suggestion",
    "symbol_of",
]
