"""Thesis figure 3.3: reproduced, and identified back."""

import pytest

from benchmarks.figure_3_3 import SPEEDS, draw, thesis_set, write_experiment
from identification.estimation.estimate import fit_experiment
from identification.experiment import load_experiment


def test_impacts_agree_with_the_oracle(tmp_path):
    """Displacement and force of the program's model depart from SciPy's DOP853 by less than 2e-6 of their peaks at every speed."""
    rows = draw(thesis_set(), tmp_path / "figure.png")
    assert [row[0] for row in rows] == list(SPEEDS)
    assert max(row[-1] for row in rows) < 2e-6
    assert (tmp_path / "figure.png").stat().st_size > 10_000


@pytest.mark.parametrize("seed", [1])
def test_parameters_are_identified_back(tmp_path, seed):
    """From noisy drop records made by the oracle: within three standard errors and 0.5 %."""
    truth = thesis_set()
    write_experiment(tmp_path, truth, seed)
    result = fit_experiment(load_experiment(tmp_path))
    assert 0.9 < result.chi2_reduced < 1.1
    for parameter in result.parameters:
        true = truth[parameter.spec.name]
        assert abs(parameter.value - true) < 3 * parameter.stderr
        assert parameter.value == pytest.approx(true, rel=0.005)
