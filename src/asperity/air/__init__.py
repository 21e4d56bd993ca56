"""The normal direction: elastic contacts and the squeezed air layer that work in parallel.

`effective_modulation` answers the question the friction laws ask: which fraction of the load
modulation do the micro-contacts bear? No module of this room depends on friction.
"""

from asperity.air.inverse import InverseResult, gap, patch_radius
from asperity.air.layer import AirLayer, bessel_ratio, shear_viscosity_ratio
from asperity.air.normal_contact import NormalContact, mindlin_length_ratio, normal_length
from asperity.air.transfer import (
    air_vacuum_ratio,
    effective_modulation,
    modulation_phase,
    transfer_function,
)

__all__ = [
    "AirLayer",
    "InverseResult",
    "NormalContact",
    "air_vacuum_ratio",
    "bessel_ratio",
    "effective_modulation",
    "gap",
    "mindlin_length_ratio",
    "modulation_phase",
    "normal_length",
    "patch_radius",
    "shear_viscosity_ratio",
    "transfer_function",
]
