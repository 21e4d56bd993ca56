"""The normal direction: elastic contacts and the squeezed air layer that work in parallel.

`effective_modulation` answers the question the friction laws ask: which fraction of the load
modulation do the micro-contacts carry? No module of this room depends on friction.
"""

from asperity._lazy import public_names
from asperity.air.inverse import (
    InverseResult as InverseResult,
    gap as gap,
    patch_radius as patch_radius,
)
from asperity.air.layer import (
    AirLayer as AirLayer,
    bessel_ratio as bessel_ratio,
    shear_viscosity_ratio as shear_viscosity_ratio,
)
from asperity.air.normal_contact import (
    NormalContact as NormalContact,
    mindlin_length_ratio as mindlin_length_ratio,
    normal_length as normal_length,
)
from asperity.air.transfer import (
    air_vacuum_ratio as air_vacuum_ratio,
    effective_modulation as effective_modulation,
    modulation_phase as modulation_phase,
    transfer_function as transfer_function,
)

__all__ = public_names(globals())
