"""Sweeps whose points have a closed form, solved in this process."""

import pytest

from asperity.study.solve import SOLVES
from references.closed_form_sweep import ClosedForm


@pytest.fixture
def closed_form(monkeypatch: pytest.MonkeyPatch) -> ClosedForm:
    from asperity.study import job

    solve = ClosedForm()
    monkeypatch.setitem(SOLVES, "periodic", solve)
    monkeypatch.setenv("NPROC", "1")
    job._opened.cache_clear()
    return solve
