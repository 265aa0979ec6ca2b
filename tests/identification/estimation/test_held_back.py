"""Held-back records under a fit to the others: kept from it, and predicted."""

import dataclasses
import math
import re

import numpy as np
import pytest

from identification.estimation import held_back as module
from identification.estimation.estimate import fit_experiment
from identification.estimation.held_back import filtered_state, held_back_chain, held_back_fits
from identification.report import fit_summary, write_report
from identification.result.files import fit_json
from identification.trajectory.fit import fit
from identification.trajectory.reading_error import ReadingError
from identification.trajectory.start import problem_of
from tests.identification.conftest import cropped


@pytest.fixture(scope="module")
def parted(example):
    """Half a second of the drop test and of two cart records, the last held back."""
    short = cropped(example, 2000, (0, 1, 2))
    return dataclasses.replace(short, records=(*short.records[:2], dataclasses.replace(short.records[2], held_back=True)))


def without_channels(parted, lost):
    """The experiment with channels missing in the record held back."""
    last = parted.records[2]
    return dataclasses.replace(
        parted,
        records=(*parted.records[:2], dataclasses.replace(last, channels={n: v for n, v in last.channels.items() if n not in lost})),
    )


@pytest.fixture(scope="module")
def fitted(parted):
    return fit_experiment(parted)


@pytest.fixture(scope="module")
def chain(parted):
    return fit(problem_of(parted))


def test_what_is_held_back_cannot_change_the_fit(parted, fitted):
    """The same numbers to the last digit with the held-back record turned upside down."""
    last = parted.records[2]
    turned = dataclasses.replace(last, channels={name: -values for name, values in last.channels.items()})
    again = fit_experiment(dataclasses.replace(parted, records=(*parted.records[:2], turned)))
    assert [p.value for p in again.parameters] == [p.value for p in fitted.parameters]
    assert again.held_back[0].chi2_reduced["hammer_displacement"] > 100 * fitted.held_back[0].chi2_reduced["hammer_displacement"]


def test_a_held_back_record_of_the_same_rig_is_predicted_to_its_noise(fitted, parted):
    (predicted,) = fitted.held_back
    assert predicted.file == parted.records[2].file
    assert all(chi2 == pytest.approx(1.0, abs=0.15) for chi2 in predicted.chi2_reduced.values())
    gap = next(nuisance for nuisance in predicted.nuisances if nuisance.name == "gap_error")
    assert gap.stderr is not None
    assert abs(gap.value - -7e-6) < 5 * gap.stderr + 2e-6


def test_forecasts_of_the_same_rig_are_as_good_as_the_noise_allows(fitted):
    """A state that the past tells is known to less than the noise, and the free motion is no worse than the noise either."""
    (predicted,) = fitted.held_back
    assert [one.periods for one in predicted.horizons] == [0.25, 1.0, 4.0, None][: len(predicted.horizons) - 1] + [None]
    floor = predicted.noise["hammer_displacement"] / np.std(predicted.measured["hammer_displacement"])
    for one in predicted.horizons:
        assert 0.8 * floor < one.nrmse["hammer_displacement"] < 3.0 * floor
    assert fit_json(fitted)["held_back"][0]["horizons"][0]["periods"] == 0.25


def test_the_past_of_a_whole_record_tells_its_last_state(chain):
    """Where no reading follows, what is filtered is what is smoothed."""
    last = chain.problem.chains.of_record(0)
    end = chain.problem.chains.knots[0].stop - 1
    np.testing.assert_allclose(filtered_state(chain, 0, last.stop - last.start), chain.at.states[end], atol=1e-6)


def test_wrong_parameters_predict_it_worse_and_less_likely(chain, parted):
    shared = chain.at.shared.copy()
    shared[chain.problem.unknowns.index("lambda_i")] += math.log(2.0)
    wrong = dataclasses.replace(chain, at=dataclasses.replace(chain.at, shared=shared))
    worse, right = (held_back_chain(one, parted).solution.deviance for one in (wrong, chain))
    assert worse > right + 1000.0
    (predicted,) = held_back_fits(held_back_chain(wrong, parted))
    assert predicted.chi2_reduced["impact_force"] > 5.0


@pytest.fixture(scope="module")
def pushed(chain):
    """The fit with a random force, and an error of its own in each channel."""
    force = dataclasses.replace(chain.variances.force, std=0.01 * chain.problem.scales.force)
    readings = tuple(ReadingError(innovation=2.0 + place) for place in range(len(chain.problem.chains.channels)))
    return dataclasses.replace(chain, variances=dataclasses.replace(chain.variances, force=force, readings=readings))


@pytest.mark.parametrize("lost", [(), ("impact_force",), ("hammer_acceleration",)])
@pytest.mark.parametrize("converged", [True, False])
def test_records_held_back_begin_with_the_variances_of_the_fit(pushed, parted, monkeypatch, lost, converged):
    """From a large force on they may end in another mode of the likelihood; it is tried where the fit does not converge otherwise."""
    begun, ends = [], []

    def fit(problem, begin, *, both=True, progress):
        begun.append((problem.chains.channels, begin))
        ends.append(both)
        return dataclasses.replace(pushed, converged=converged)

    monkeypatch.setattr(module, "fit", fit)
    held_back_chain(pushed, without_channels(parted, lost))
    assert ends == ([False] if converged else [False, True])
    channels, begin = begun[0]
    assert not set(lost) & set(channels)
    assert begin.force == pushed.variances.force
    assert begin.readings == tuple(pushed.variances.readings[pushed.problem.chains.channels.index(one)] for one in channels)


def test_records_held_back_may_have_a_force_where_the_fit_has_none(chain, parted, monkeypatch):
    begun = []

    def fit(problem, begin, *, both=True, progress):
        begun.append((begin, both))
        return chain

    monkeypatch.setattr(module, "fit", fit)
    held_back_chain(chain, parted)
    assert begun == [(None, True)]


def test_a_held_back_record_may_lack_a_channel_of_the_fit(pushed, parted):
    found = held_back_chain(pushed, without_channels(parted, ("impact_force",)))
    assert found is not None and len(found.variances.readings) == len(found.problem.chains.channels)


def test_nothing_held_back_is_nothing_predicted(parted, chain):
    assert held_back_chain(chain, parted.fitting) is None
    assert held_back_fits(None) == ()


def test_reports_separate_fitted_from_predicted(fitted, tmp_path):
    document = fit_json(fitted)
    assert [record["file"] for record in document["held_back"]] == ["cart2.csv.gz"]
    assert [record["file"] for record in document["records"]] == ["drop.csv.gz", "cart1.csv.gz"]
    assert set(document["provenance"]["sha256"]) == {"experiment.toml", "drop.csv.gz", "cart1.csv.gz", "cart2.csv.gz"}
    assert "not fitted, predicted:" in [str(block) for block in fit_summary(fitted).renderables]
    write_report(fitted, tmp_path, provenance=document["provenance"])
    page = (tmp_path / "report.html").read_text()
    assert re.findall(r"Held back, and predicted only: ([^<]+)\.<", page) == ["cart2.csv.gz"]
