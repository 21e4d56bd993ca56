"""Friction laws, one a file, and the registry that the command line and tables look them up in."""

from asperity.laws.amontons import Amontons
from asperity.laws.elasto_plastic import ElastoPlastic
from asperity.laws.elasto_plastic_age import ElastoPlasticAge
from asperity.laws.law import Law, State
from asperity.laws.linker_dieterich import LinkerDieterich
from asperity.laws.parameter import parameter
from asperity.laws.registry import get_law, law_parameters, register, registered
from asperity.laws.rice_ruina import RiceRuina
from asperity.laws.strength_area import StrengthArea

for _law in (Amontons, RiceRuina, LinkerDieterich, ElastoPlastic, ElastoPlasticAge, StrengthArea):
    register(_law)

__all__ = [
    "Amontons",
    "ElastoPlastic",
    "ElastoPlasticAge",
    "Law",
    "LinkerDieterich",
    "RiceRuina",
    "State",
    "StrengthArea",
    "get_law",
    "law_parameters",
    "parameter",
    "register",
    "registered",
]
