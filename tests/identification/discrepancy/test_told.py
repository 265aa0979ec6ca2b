"""How readers are told the numbers of an effect, and that the files keep them as estimated."""

import dataclasses
import io

import pytest
from rich.console import Console

from identification import diagnose
from identification.discrepancy import assertion
from identification.discrepancy.diagnosis import MISSING, UNLISTED, Asserted, Number
from identification.discrepancy.drift import Drift
from identification.discrepancy.report import diagnosis_summary, write_diagnosis_report
from identification.discrepancy.report.rows import change_rows
from identification.discrepancy.search import EXPLAINED, HELPLESS, Search
from identification.discrepancy.verdict import nearest, percent, sentences
from tests.identification.discrepancy.made_diagnosis import made_diagnosis
from tests.identification.discrepancy.made_search import model, round_of
from tests.identification.made_result import made_result
from tests.identification.report.page_reader import read
from vibrojax.effects import CoulombFriction, MissingStop, QuadraticDrag

STOP = MissingStop(impact_stiffness=3.6e5, impact_exponent=0.8, impact_damping=1e-6, gap_offset=-0.9938645)
PLACE = "0.0061355 ± 0.0000037"
OFFSET = "−0.9938645 ± 0.0000037"


def asserted(gap: float | None) -> Asserted:
    """The stop of a rig whose file has no stop, which is what a gap of 1 m says."""
    numbers = tuple(
        Number(name=p.name, symbol=p.symbol, unit=p.unit, value=getattr(STOP, p.field), stderr=3.7e-6 if p.name == "gap_offset" else None)
        for p in STOP.parameters
    )
    return Asserted(effect=STOP, probability=0.99, parameters=numbers, gap=gap)


@pytest.fixture(scope="module")
def diagnosis():
    made, one = made_diagnosis(made_result(samples=700), MISSING), asserted(1.0)
    own = tuple(dataclasses.replace(n, name=f"missing_stop.{n.name}") for n in one.parameters)
    model = dataclasses.replace(made.nominal.model, effects=(STOP,))
    after = dataclasses.replace(made.augmented, model=model, parameters=(*made.nominal.parameters, *own))
    said = sentences(MISSING, (one,), (), None, made.nominal, after, "")
    return dataclasses.replace(made, effects=(one,), augmented=after, sentences=said)


def test_a_stop_stands_on_the_axis_of_u_where_all_records_have_one_gap():
    *others, place = asserted(1.0).told
    assert others == list(asserted(1.0).parameters[:-1])
    assert (place.symbol, place.unit, place.value, place.stderr) == ("u_stop", "m", pytest.approx(0.0061355), 3.7e-6)


def test_it_stays_beyond_the_gap_where_gaps_differ():
    assert asserted(None).told == asserted(None).parameters


def test_the_gap_is_that_of_all_records_if_they_have_one(motion, allowed):
    found = model(motion, allowed, 1.0)
    none = round_of(motion, found.outcome.equations.cost, {}).scored
    ended = Search(rounds=(), fitted=found, last=none, ended=EXPLAINED)
    for gaps, expected in (((0.0, 1e-3), None), ((1.0, 1.0), 1.0)):
        records = tuple(dataclasses.replace(record, gap=gaps[k % 2]) for k, record in enumerate(motion.prepared.experiment.records))
        experiment = dataclasses.replace(motion.prepared.experiment, records=records)
        whole = dataclasses.replace(found, prepared=dataclasses.replace(found.prepared, experiment=experiment))
        (one,) = assertion.asserted(ended, whole, (), allowed)
        assert one.gap == expected


def test_the_sentence_says_where_the_stop_is(diagnosis):
    assert f"u_stop = {PLACE} m" in diagnosis.sentences[0]
    assert "gap_0" not in diagnosis.sentences[0]


def test_page_and_terminal_say_the_same(diagnosis, tmp_path):
    console = Console(width=200, record=True, file=io.StringIO())
    console.print(diagnosis_summary(diagnosis))
    text = console.export_text()
    assert f"u_stop = {PLACE.replace('−', '-')} m" in text
    page = read(write_diagnosis_report(diagnosis, tmp_path)[0]).text
    assert PLACE in page and "position of the stop" in page
    assert OFFSET not in page
    assert next(row for row in change_rows(diagnosis) if row.symbol == "u_stop").after == PLACE


def test_the_file_keeps_the_offset(diagnosis):
    numbers = diagnosis.document()["effects"][0]["parameters"]
    assert list(numbers) == ["k_i", "n", "lambda_i", "gap_offset"]
    assert numbers["gap_offset"] == {"value": -0.9938645, "stderr": 3.7e-6, "unit": "m"}


def test_what_comes_nearest_is_told_with_its_numbers_and_why_it_is_not_asserted():
    force = Number(name="friction_force", symbol="F_c", unit="N", value=0.8, stderr=0.8)
    friction = Asserted(effect=CoulombFriction(friction_force=0.8), probability=0.5, parameters=(force,))
    said = nearest((friction, asserted(1.0)), ("coulomb_friction",))
    assert "not asserted: dry friction in the suspension (F_c = 0.80 ± 0.80 N) and impacts on a stop" in said
    assert f"u_stop = {PLACE} m" in said
    assert "the strength of dry friction in the suspension differs" in said
    assert ") would together leave next to nothing" in said
    assert "(F_c = 0.80 ± 0.80 N) would leave next to nothing" in nearest((friction,), ("coulomb_friction",))


def test_what_a_search_came_nearest_to_is_told_by_its_model(motion, allowed, monkeypatch):
    both = model(motion, allowed, 1.0, CoulombFriction(friction_force=0.8), QuadraticDrag(drag_coefficient=0.01))
    force = Number(name="coulomb_friction.friction_force", symbol="F_c", unit="N", value=0.8, stderr=0.8)
    monkeypatch.setattr(diagnose, "numbers", lambda fitted, allowed: (force,))
    monkeypatch.setattr(diagnose, "unsteady", lambda fitted, allowed: ("coulomb_friction",))
    start = model(motion, allowed, 5.0)
    last = round_of(motion, start.outcome.equations.cost, {}).scored
    ended = Search(rounds=(), fitted=start, last=last, ended=HELPLESS, nearest=both)
    (said,) = diagnose._nearest(ended, allowed)
    assert "F_c = 0.80 ± 0.80 N" in said and "square of the velocity" in said
    assert "the strength of dry friction in the suspension differs" in said
    assert diagnose._nearest(dataclasses.replace(ended, nearest=None), allowed) == ()


@pytest.mark.parametrize(("share", "told"), [(0.0041, "0.41 %"), (0.99, "99 %"), (0.996, "100 %"), (1.36, "136 %")])
def test_shares_are_told_in_percent(share, told):
    assert percent(share) == told


def test_a_parameter_that_drifts_is_told_in_the_record_where_this_is_surest(diagnosis):
    cart1, cart2 = ((5.1837, 3e-4), (5.1396, 3e-4)), ((5.1900, 2e-3), (5.1400, 2e-3))
    drift = Drift(name="f_n", chance=0.0, gain=2e4, change=0.008, halves={"cart2.csv": cart2, "cart1.csv": cart1})
    *_, last = sentences(UNLISTED, (), (), None, diagnosis.nominal, diagnosis.nominal, "", mimics=drift)
    early, late = "5.18370 ± 0.00030 Hz in the first half of cart1.csv", "5.13960 ± 0.00030 Hz in the second"
    assert last == f"f_n will not hold still in the course of a record: {early}, {late}."
