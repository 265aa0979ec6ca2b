import dataclasses

import numpy as np
import pytest

from benchmarks.fit.ours import our_residuals
from benchmarks.fit.peer import VARIANTS, Problem, peer_fit
from benchmarks.fit.reference import reference_residuals
from benchmarks.simulator import draw_plan, draw_rig, standard_sensors, write_experiment
from identification.experiment import load_experiment
from identification.trajectory.start import problem_of


@pytest.fixture(scope="module")
def problem(tmp_path_factory):
    folder = tmp_path_factory.mktemp("peer")
    rng = np.random.default_rng(11)
    rig = draw_rig(rng, "stiff")
    write_experiment(folder, rig, draw_plan(rng, "stiff", rig.f_n, samples=(1201, 801)), standard_sensors(), rng, truth=None)
    chain = problem_of(load_experiment(folder))
    shared = [np.log(rig.fitted[name]) if logarithmic else rig.fitted[name] for name, logarithmic in chain.unknowns.shared]
    return Problem(dataclasses.replace(chain, start=dataclasses.replace(chain.start, shared=np.array(shared))), substeps=2)


def test_simulator_agrees_with_dop853(problem):
    start = problem.start
    exact = reference_residuals(problem.windows, problem.values(start), start)
    coarse, fine = (np.abs(problem.data_residuals(start, substeps=substeps) - exact).max() for substeps in (2, 16))
    assert coarse < 0.1
    assert fine < 1e-3


def test_the_program_simulates_the_same(problem):
    """Its integrator, window by window."""
    start = problem.start
    exact = reference_residuals(problem.windows, problem.values(start), start)
    assert np.abs(our_residuals(problem.chain, problem.windows, start) - exact).max() < 0.1


def test_windows_hold_every_sample_once_and_begin_in_flight(problem):
    windows, records = problem.windows, problem.chain.experiment.records
    assert windows.counts.sum() == sum(len(record.time) for record in records)
    for index, motion in enumerate(problem.chain.motions):
        first, counts = windows.first[windows.record == index], windows.counts[windows.record == index]
        np.testing.assert_array_equal(first, np.concatenate([[0], np.cumsum(counts)[:-1]]))
        assert not motion.touching[first[1:]].any()


def test_sparsity_covers_every_derivative(problem):
    vector = problem.pack(problem.start)
    pattern = problem.sparsity().toarray() > 0
    for column in range(len(vector)):
        moved = vector.copy()
        moved[column] += 1e-7
        changed = problem(moved) != problem(vector)
        assert not (changed & ~pattern[:, column]).any()


def test_vector_of_unknowns_can_be_taken_apart_and_put_together(problem):
    vector = problem.pack(problem.start) + 1e-4
    np.testing.assert_array_equal(problem.pack(problem.unpack(vector)), vector)


def test_peer_reaches_the_noise(problem):
    found = peer_fit(problem, problem.start, VARIANTS["scipy_fd_sparse"])
    size = problem.size(found.at)
    assert 2 * found.cost / (size["residuals"] - size["unknowns"]) == pytest.approx(1.0, abs=0.05)
