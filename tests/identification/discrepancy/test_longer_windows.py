"""When a search on short windows is followed by one on longer windows."""

import pytest

from identification import diagnose
from identification.diagnose import diagnose_experiment
from identification.discrepancy.diagnosis import ADEQUATE
from identification.discrepancy.search import BUDGET, EXPLAINED, HELPLESS, Search
from tests.identification.discrepancy.made_diagnosis import made_diagnosis
from tests.identification.discrepancy.made_search import model, round_of
from tests.identification.made_result import made_result


def test_a_search_on_longer_windows_that_the_budget_ended_is_not_believed(motion, allowed, monkeypatch):
    scored = round_of(motion, 0.5 * allowed.samples.astype(float), {}).scored
    grounds = {name: diagnose._Ground(fitted=model(motion, allowed, 1.0), allowed=allowed, sound=False) for name in ("first", "longer")}
    monkeypatch.setattr(diagnose, "_ground", lambda *of: grounds["first"])
    monkeypatch.setattr(diagnose, "_longer", lambda *of: grounds["longer"])
    monkeypatch.setattr(diagnose, "apart", lambda fitted: 618.0)
    ends = {id(grounds["first"].fitted): EXPLAINED, id(grounds["longer"].fitted): BUDGET}
    monkeypatch.setattr(diagnose, "steady_search", lambda start, *of: Search(rounds=(), fitted=start, last=scored, ended=ends[id(start)]))
    concluded = []
    made = made_diagnosis(made_result(samples=700), ADEQUATE)
    monkeypatch.setattr(diagnose, "_concluded", lambda experiment, ground, found, course: concluded.append((ground, found)) or made)
    diagnose_experiment(motion.prepared.experiment)
    ((ground, found),) = concluded
    assert ground is grounds["first"]
    assert (found.ended, found.cut_short) == (EXPLAINED, True)


@pytest.mark.parametrize(
    ("sound", "ended", "torn", "windows"),
    [
        (False, EXPLAINED, 618.0, "longer"),
        (False, EXPLAINED, 52.0, "first"),  # they meet
        (False, HELPLESS, 618.0, "first"),  # there is a misfit to speak of already
        (True, EXPLAINED, 618.0, "first"),  # they are long already
    ],
)
def test_short_windows_that_fit_but_do_not_meet_are_given_up_for_longer_ones(motion, allowed, monkeypatch, sound, ended, torn, windows):
    made = made_diagnosis(made_result(samples=700), ADEQUATE)
    scored = round_of(motion, 0.5 * allowed.samples.astype(float), {}).scored
    grounds = {name: diagnose._Ground(fitted=model(motion, allowed, 1.0), allowed=allowed, sound=sound) for name in ("first", "longer")}
    monkeypatch.setattr(diagnose, "_ground", lambda *of: grounds["first"])
    monkeypatch.setattr(diagnose, "_longer", lambda *of: grounds["longer"])
    monkeypatch.setattr(diagnose, "apart", lambda fitted: torn)
    monkeypatch.setattr(diagnose, "steady_search", lambda start, *of: Search(rounds=(), fitted=start, last=scored, ended=ended))
    concluded = []
    monkeypatch.setattr(diagnose, "_concluded", lambda experiment, ground, found, course: concluded.append((ground, found)) or made)
    diagnose_experiment(motion.prepared.experiment)
    ((ground, found),) = concluded
    assert ground is grounds[windows]
    assert found.fitted is ground.fitted
