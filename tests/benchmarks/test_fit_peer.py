import dataclasses

import numpy as np
import pytest

from benchmarks.fit.peer import VARIANTS, Problem, peer_fit
from benchmarks.fit.reference import reference_residuals
from benchmarks.simulator import draw_plan, draw_rig, standard_sensors, write_experiment
from identification.experiment import load_experiment
from identification.windows.prepare import prepare


@pytest.fixture(scope="module")
def problem(tmp_path_factory):
    folder = tmp_path_factory.mktemp("peer")
    rng = np.random.default_rng(11)
    rig = draw_rig(rng, "stiff")
    write_experiment(folder, rig, draw_plan(rng, "stiff", rig.f_n, samples=(1201, 801)), standard_sensors(), rng, truth=None)
    prepared = prepare(load_experiment(folder))
    start = dataclasses.replace(prepared.start, shared=prepared.layout.internal(rig.fitted))
    return Problem(dataclasses.replace(prepared, start=start), substeps=2)


def test_simulator_agrees_with_dop853(problem):
    start = problem.prepared.start
    exact = reference_residuals(problem.prepared, start)
    coarse, fine = (np.abs(problem.data_residuals(start, substeps=substeps) - exact).max() for substeps in (2, 16))
    assert coarse < 0.1
    assert fine < 1e-3


def test_sparsity_covers_every_derivative(problem):
    vector = problem.pack(problem.prepared.start)
    pattern = problem.sparsity().toarray() > 0
    for column in range(len(vector)):
        moved = vector.copy()
        moved[column] += 1e-7
        changed = problem(moved) != problem(vector)
        assert not (changed & ~pattern[:, column]).any()


def test_vector_of_unknowns_can_be_taken_apart_and_put_together(problem):
    vector = problem.pack(problem.prepared.start) + 1e-4
    np.testing.assert_array_equal(problem.pack(problem.unpack(vector)), vector)


def test_peer_reaches_the_noise(problem):
    found = peer_fit(problem, problem.prepared.start, VARIANTS["scipy_fd_sparse"])
    size = problem.size(found.estimate)
    assert 2 * found.cost / (size["residuals"] - size["unknowns"]) == pytest.approx(1.0, abs=0.05)
