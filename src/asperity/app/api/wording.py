"""Sentences of the library about recordings, with the page's fields in place of arguments."""

from __future__ import annotations

import re

#: What begins a sentence, and what the page calls it.
_SUBJECTS = {
    "measure.window": "Window",
    "measure.detrend": "Drift",
    "measure.load": "Normal load",
    "measure.force": "Shear force",
    "measure.steps": "Velocity steps",
    "measure.holds": "Holds",
    "measure.frequency": "Frequency",
    "measure.trace": "The recording",
    "lock_in.detrend": "Drift",
    "lock_in.harmonics": "Harmonics",
    "lock_in.frequency": "Frequency",
    "lock_in.load and force": "Normal load and shear force",
    "lock_in.load": "Normal load",
    "lock_in.time": "Time column",
    "read.rate": "Sampling rate",
    "read.group": "Group",
    "read.format": "The format",
    "read.delimiter": "Delimiter",
    "read.decimal": "Decimal mark",
    "read.columns": "Role",
    "read.units": "Unit",
    "stress_to_force.area": "Area",
    "recording.path": "The recording",
    "slice.start and slice.end": "Window",
}
_ROLES = {
    "time": "Time column", "W": "Normal load", "F": "Shear force", "velocity": "Velocity",
    "displacement": "Displacement", "friction": "Friction",
}  # fmt: skip


def in_page_words(sentence: str) -> str:
    """A sentence of the library with fields of the page in place of arguments."""
    for name, field in _SUBJECTS.items():
        if sentence.startswith(f"{name} "):
            sentence = field + sentence[len(name) :]
            break
    sentence = re.sub(
        r"^Trace\.channel must name (a|one) channel, got '(\w+)'",
        lambda found: (
            f"{_role(found[2])} must be {found[1]} channel, got "
            f"{'none' if found[1] == 'a' else 'several'} with that role"
        ),
        sentence,
    )
    sentence = re.sub(r"^columns\['(\w+)'\]", lambda found: _role(found[1]), sentence)
    sentence = re.sub(r"^units\['([^']*)'\]", r"Unit of \1", sentence)
    sentence = re.sub(r"^Trace\.channel\b", "Role", sentence)
    sentence = re.sub(
        r"columns=\{'(\w+)': (?:'([^']*)'|(\d+))\}",
        lambda found: f"{_role(found[1])}: {found[2] or found[3]}",
        sentence,
    )
    sentence = re.sub(r"units=\{'([^']*)': '([^']*)'\}", r"Unit of \1: \2", sentence)
    sentence = re.sub(r"units=\{'([^']*)': \.\.\.\}", r"Unit of \1", sentence)
    return re.sub(r"\brate='([^']*)'", r"Sampling rate: \1", sentence)


def _role(name: str) -> str:
    return _ROLES.get(name, f"Role {name}")
