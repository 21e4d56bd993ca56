"""Friction laws, one in each file, and their registry by name."""

from asperity._lazy import public_names
from asperity.laws.amontons import Amontons as Amontons
from asperity.laws.cut_off import CutOff as CutOff
from asperity.laws.elasto_plastic import ElastoPlastic as ElastoPlastic
from asperity.laws.elasto_plastic_age import ElastoPlasticAge as ElastoPlasticAge
from asperity.laws.law import Law as Law, State as State
from asperity.laws.linker_dieterich import LinkerDieterich as LinkerDieterich
from asperity.laws.nagata import Nagata as Nagata
from asperity.laws.parameter import parameter as parameter
from asperity.laws.perrin_rice_zheng import PerrinRiceZheng as PerrinRiceZheng
from asperity.laws.prakash_clifton import PrakashClifton as PrakashClifton
from asperity.laws.registry import (
    get_law as get_law,
    known_law as known_law,
    register as register,
    registered as registered,
)
from asperity.laws.regularised import Regularised as Regularised
from asperity.laws.rice_ruina import RiceRuina as RiceRuina
from asperity.laws.ruina_slip import RuinaSlip as RuinaSlip
from asperity.laws.strength_area import StrengthArea as StrengthArea
from asperity.laws.two_state import TwoState as TwoState
from asperity.parameters import law_parameters as law_parameters

for _law in (
    *(Amontons, RiceRuina, LinkerDieterich, ElastoPlastic, ElastoPlasticAge, StrengthArea),
    *(Regularised, CutOff, RuinaSlip, PerrinRiceZheng, Nagata, TwoState, PrakashClifton),
):
    register(_law)

__all__ = public_names(globals())
