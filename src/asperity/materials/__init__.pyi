# Public names of the package, each with its module; `asperity._lazy` imports them when used.

from asperity.materials.bibliography import (
    available_citations as available_citations,
    citation as citation,
    cited_works as cited_works,
)
from asperity.materials.material import (
    Material as Material,
    Number as Number,
    available as available,
    load as load,
    load_from as load_from,
)
