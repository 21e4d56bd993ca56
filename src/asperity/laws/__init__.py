"""Friction laws, one in each file, and their registry by name."""

from asperity.laws.amontons import Amontons
from asperity.laws.cut_off import CutOff
from asperity.laws.elasto_plastic import ElastoPlastic
from asperity.laws.elasto_plastic_age import ElastoPlasticAge
from asperity.laws.law import Law, State, parameter
from asperity.laws.linker_dieterich import LinkerDieterich
from asperity.laws.nagata import Nagata
from asperity.laws.perrin_rice_zheng import PerrinRiceZheng
from asperity.laws.prakash_clifton import PrakashClifton
from asperity.laws.registry import get_law, known_law, register, registered
from asperity.laws.regularised import Regularised
from asperity.laws.rice_ruina import RiceRuina
from asperity.laws.ruina_slip import RuinaSlip
from asperity.laws.strength_area import StrengthArea
from asperity.laws.two_state import TwoState
from asperity.parameters import law_parameters

for _law in (
    *(Amontons, RiceRuina, LinkerDieterich, ElastoPlastic, ElastoPlasticAge, StrengthArea),
    *(Regularised, CutOff, RuinaSlip, PerrinRiceZheng, Nagata, TwoState, PrakashClifton),
):
    register(_law)

__all__ = [
    "Amontons",
    "CutOff",
    "ElastoPlastic",
    "ElastoPlasticAge",
    "Law",
    "LinkerDieterich",
    "Nagata",
    "PerrinRiceZheng",
    "PrakashClifton",
    "Regularised",
    "RiceRuina",
    "RuinaSlip",
    "State",
    "StrengthArea",
    "TwoState",
    "get_law",
    "known_law",
    "law_parameters",
    "parameter",
    "register",
    "registered",
]
