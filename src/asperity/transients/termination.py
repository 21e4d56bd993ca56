"""Why an integration ends before its programme does."""

from __future__ import annotations

from dataclasses import dataclass

_SENTENCES = {
    "loss of contact": (
        "contact was lost at t = {time:.9g} s: the programme takes the normal load to zero, and "
        "friction is defined under a positive load only; lower the modulation or raise the load"
    ),
    "runaway": (
        "the slider ran away at t = {time:.9g} s: without inertia nothing bounds its velocity "
        "where the spring is softer than the critical stiffness; switch inertia on, give a "
        "radiation damping, or stiffen the spring"
    ),
    "reversal": (
        "the interface force vanished at t = {time:.9g} s and slip would reverse, for which this "
        "law is not defined; take one that is, such as 'regularised'"
    ),
    "rest": (
        "the slider came to rest at t = {time:.9g} s, where its velocity has no logarithm: "
        "inertia without elastic asperities takes it as a state; take a law that is smooth at "
        "rest, such as 'regularised', or leave inertia out"
    ),
    "no accurate step": (
        "no step however short was accurate at t = {time:.9g} s; the equations of motion change "
        "abruptly there or have no solution beyond"
    ),
    "too many steps": (
        "the integration gave up at t = {time:.9g} s: {detail} to the end of this part of the "
        "programme; shorten the programme, or raise most_steps and wait"
    ),
}


@dataclass(frozen=True)
class Termination:
    """End of an integration before that of its programme.

    Attributes
    ----------
    kind : str
        "loss of contact", "runaway", "reversal", "rest", "no accurate step" or
        "too many steps".
    time : float
        Seconds.
    detail : str
        What the sentence adds.
    """

    kind: str
    time: float
    detail: str = ""

    def __str__(self) -> str:
        return _SENTENCES[self.kind].format(time=self.time, detail=self.detail)
