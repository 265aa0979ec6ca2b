"""The jobs behind the commands: what they refuse to write, and why."""

from types import SimpleNamespace

import pytest

from identification.run import run_fit
from vibrojax.data_files import data_path
from vibrojax.errors import NoConvergenceError


def test_a_fit_that_did_not_converge_says_what_to_do_and_writes_nothing(monkeypatch, tmp_path):
    result = SimpleNamespace(converged=False, warnings=("the iteration stopped after 40 steps",))
    monkeypatch.setattr("identification.run.fit_experiment", lambda *nouns, **options: result)
    with pytest.raises(NoConvergenceError, match=r"stopped after 40 steps; check units, signs and gaps, or ask `vibrojax diagnose`"):
        run_fit(data_path("example"), tmp_path)
    assert not list(tmp_path.iterdir())
