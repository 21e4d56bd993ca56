"""Roles of channels: time, load W, shear force F, velocity, displacement, friction.

Laboratories name the same quantity in a dozen ways. A role is matched by the words of the name and
by the kind of its unit; where two channels fit, nothing is chosen and the answer names both.
"""

from __future__ import annotations

import re
import unicodedata
from collections.abc import Iterable, Mapping
from dataclasses import dataclass

from asperity.errors import Argument, InputError, closest, listed
from asperity.units import KINDS


@dataclass(frozen=True)
class Role:
    """Names and units of the channels of a role.

    Attributes
    ----------
    also : frozenset of str
        Other names of the role itself.
    whole : frozenset of str
        Whole names, lower case without separators.
    words : frozenset of str
        Words; a name of the role has one of them.
    weak : frozenset of str
        Whole names that count only where nothing else fits.
    without : frozenset of str
        Words that rule the name out.
    kinds : frozenset of str
        Allowed kinds of the unit; an unknown unit is allowed, too.
    """

    also: frozenset[str]
    whole: frozenset[str]
    words: frozenset[str]
    kinds: frozenset[str]
    weak: frozenset[str] = frozenset()
    without: frozenset[str] = frozenset()


def _role(also: str, **words: str) -> Role:
    """A role by its fields as texts: names with commas, and words with blanks between them."""
    names = frozenset(filter(None, also.split(",")))
    return Role(names, **{field: frozenset(text.split()) for field, text in words.items()})


_MOTION = (
    "disp displ displacement velocity speed rate strain position stiffness geschwindigkeit weg "
    "verschiebung vitesse deplacement velocita spostamento velocidad desplazamiento"
)

#: The roles, in the letters of the field and in the words of some languages, without accents.
ROLES: Mapping[str, Role] = {
    "time": _role(
        "",
        whole="t time xvalue",
        words="time timestamp elapsed zeit zeitstempel messzeit temps tempo tiempo tijd",
        without="delay constant konstante",
        kinds="time",
    ),
    "W": _role(
        "load,normal load,normal force,normal stress",
        whole="w fn ns n fz load sigma sigman signorm normalkraft normalspannung normallast "
        "auflast auflagekraft anpresskraft σ σn",
        words="nor norm normal normale normala normalstress normalforce normalload normalkraft "
        "normalspannung normallast auflast sigman fn",
        weak="load loadcell pressure axialforce axialload axialstress last belastung charge carico "
        "carga",
        without=_MOTION + " shear shr tangential coefficient koeffizient",
        kinds="force pressure",
    ),
    "F": _role(
        "force,shear,shear force,shear stress",
        whole="f ft fs fx ss tau τ frictionforce frictionalforce reibkraft reibungskraft "
        "scherkraft schubkraft schubspannung scherspannung tangentialkraft querkraft "
        "forcedefrottement efforttranchant forzadiattrito fuerzaderozamiento fuerzadefriccion",
        words="shear shr shearstress shearforce ft tangential tangentiel tangentielle tangenziale "
        "tangencial lateral laterale traction tau τ reibkraft reibungskraft scherkraft schubkraft "
        "schubspannung scherspannung tangentialkraft cisaillement taglio cizalla cortante",
        weak="force kraft effort forza fuerza friction frottement attrito rozamiento friccion "
        "reibung",
        without=_MOTION + " nor norm normal normale coefficient coeff coef angle koeffizient "
        "coefficiente coeficiente",
        kinds="force pressure",
    ),
    "velocity": _role(
        "V,speed",
        whole="v vel vlp speed sliprate",
        words="velocity vel speed geschwindigkeit gleitgeschwindigkeit vitesse velocita velocidad",
        without="angular",
        kinds="velocity",
    ),
    "displacement": _role(
        "slip,position",
        whole="x u d s slip lvdt weg gleitweg loadpoint lp lpd",
        words="disp displ displacement slip position stroke weg gleitweg verschiebung deplacement "
        "spostamento desplazamiento",
        without="rate velocity vel speed geschwindigkeit",
        kinds="length",
    ),
    "friction": _role(
        "mu,friction coefficient",
        whole="mu μ cof friction frict reibwert reibzahl reibungszahl reibungskoeffizient "
        "reibkoeffizient",
        words="mu μ cof friction frict reibwert reibzahl reibungszahl reibungskoeffizient "
        "reibkoeffizient frottement attrito rozamiento friccion reibung",
        without="force stress load kraft forza fuerza spannung",
        kinds="dimensionless",
    ),
}

# The load point, as in "LPdisp", is a word for itself.
_WORD = re.compile(r"LP(?![A-Z])|[A-Z]+(?![a-z])|[A-Z]?[a-z]+|[Α-Ωα-ω]+|\d+")


def words(name: str) -> list[str]:
    """Words of a recorded name in lower case and without accents.

    ``"Normal_stress"`` and ``"NormalStress"`` agree.
    """
    if not name.isascii():
        # The micro sign becomes the Greek letter; accents become separate marks and are dropped.
        apart = unicodedata.normalize("NFKD", name)
        name = "".join(c for c in apart if not unicodedata.combining(c))
    return [w.lower() for w in _WORD.findall(name)]


def role_of(name: str) -> str | None:
    """The role of a name, such as W for ``"load"``; None without a role."""
    for role, spec in ROLES.items():
        if name == role or name in spec.also or name.lower() == role.lower():
            return role
    return None


def candidates(role: str, kinds: Mapping[str, str | None]) -> list[str]:
    """Names that can be `role`, judged by their words and by the kinds of their units."""
    spec = ROLES[role]
    fitting = [
        name
        for name, kind in kinds.items()
        if (kind is None or kind in spec.kinds)
        and not any(word in spec.without for word in words(name))
    ]
    strong = [n for n in fitting if _says(n, spec)]
    return strong or [n for n in fitting if "".join(words(n)) in spec.weak]


def _says(name: str, spec: Role) -> bool:
    spoken = words(name)
    # Two words or more say what the whole name "friction force" says, as in "Friction force Fx".
    runs = ("".join(spoken[:end]) for end in range(2, len(spoken) + 1))
    whole = "".join(spoken) in spec.whole or any(run in spec.whole for run in runs)
    return whole or any(w in spec.words for w in spoken)


def recorded_as(name: str, headings: Mapping[str, str]) -> str | None:
    """Name of the one channel of a name or heading; blanks, dots at the ends and case may differ.

    None where there is no such channel, or several. The headings are by the names of the channels.
    """
    if name in headings:
        return name
    same = [key for key, heading in headings.items() if heading == name]
    for alike in (_bare, lambda text: _bare(text).casefold()):
        if len(same) == 1:
            break
        same = [key for key in headings if alike(key) == alike(name)]
    return same[0] if len(same) == 1 else None


def free_name(name: str, taken: Mapping[str, object]) -> str:
    """A name that is not taken: the name itself, or with a number behind it."""
    number, free = 2, name
    while free in taken:
        free, number = f"{name} ({number})", number + 1
    return free


def _bare(name: str) -> str:
    """A name without blanks, and without dots and underscores at its ends."""
    return name.replace(" ", "").strip("._")


def find_channel(
    name: str,
    kinds: Mapping[str, str | None],
    chosen: Mapping[str, str],
    headings: Mapping[str, str],
) -> str:
    """Name of the one channel that `name` can mean.

    Parameters
    ----------
    name : str
        Recorded name or heading, as of `recorded_as`, or role.
    kinds : mapping
        Kind of each channel, None where the unit is unknown.
    chosen : mapping
        Channels whose role the user has chosen.
    headings : mapping
        Heading of each channel.

    Raises
    ------
    InputError
        If no channel fits or several do.
    """
    if name in chosen:
        return chosen[name]
    role = role_of(name)
    if role is not None and role in chosen:
        return chosen[role]
    same = recorded_as(name, headings)
    if same is not None and _may_be(role, kinds[same]):
        return same
    fitting = candidates(role, kinds) if role else []
    if len(fitting) == 1:
        return fitting[0]
    field = Argument("Trace.channel", role or name)
    if fitting:
        got = f"several, {' or '.join(map(repr, fitting))}"
        advice = f"choose when reading, like {Argument('columns', role or name, fitting[0])}"
        raise InputError(field, "name one channel", got, advice)
    if role is None or not kinds:
        advice = closest(name, kinds) if kinds else "the recording has no column besides time"
        raise InputError(field, "name a channel", f"none like '{name}'", advice)
    for other, kind in kinds.items():
        if kind is not None and candidates(role, {other: None}):
            unit = Argument("units", other, "kgf" if kind == "mass" else "...")
            rule, got = f"be {nouns(ROLES[role].kinds)}", f"'{other}', {nouns([kind])}"
            advice = f"say what its unit is, like {unit}, or choose another column"
            raise InputError(field, rule, got, advice)
    got = f"no column named like {_TITLES[role]}"
    raise InputError(field, "name a channel", got, _missing(role, kinds))


_TITLES = {
    "time": "a time",
    "W": "a normal load",
    "F": "a shear force",
    "velocity": "a velocity",
    "displacement": "a displacement",
    "friction": "a friction coefficient",
}


def nouns(kinds: Iterable[str]) -> str:
    """Kinds of quantities in words, as "a force or a pressure"."""
    return " or ".join(KINDS[kind].noun for kind in sorted(kinds))


def kinds_of(role: str) -> frozenset[str]:
    """Kinds of the units of a role; a ratio may stand for a load or a force."""
    return ROLES[role].kinds | ({"dimensionless"} if role in ("W", "F") else set())


def _may_be(role: str | None, kind: str | None) -> bool:
    """Whether a unit of `kind` does not contradict a role; a ratio may stand for a force."""
    return role is None or kind in {None, "dimensionless"} | ROLES[role].kinds


def _missing(role: str, kinds: Mapping[str, str | None]) -> str:
    """Advice if no column has a name of `role`."""
    others = {n for r in ROLES if r != role for n in candidates(r, kinds)}
    possible = (n for n in {*kinds} - others if _may_be(role, kinds[n]))
    # Columns with a unit of the role first.
    free = sorted(possible, key=lambda name: (kinds[name] not in ROLES[role].kinds, name))
    like = Argument("columns", role, *free[:1])
    ways = [f"choose one of {listed(free)}, like {like}"] if free else []
    if role == "W":
        ways.append(f"give a constant one, like {Argument('channels', 'load', '1200 N')}")
    if role in ("W", "F"):
        # Of two columns without a unit the first stands for the load or the force; more of them may
        # be anything.
        plain = [name for name in free or kinds if _may_be("friction", kinds[name])]
        of_column = Argument("columns", "friction", plain[-1] if 0 < len(plain) < 3 else "mu")
        ways.append(f"name the column of F/W, like {of_column}")
    return ", or ".join(ways) or closest(role, kinds)
