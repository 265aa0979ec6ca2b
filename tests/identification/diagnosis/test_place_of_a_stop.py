"""How the numbers of an effect are stated to readers, and that the files keep them as estimated."""

import dataclasses
import io

import pytest
from rich.console import Console

from identification.diagnosis.diagnosis import MISSING, Asserted
from identification.diagnosis.sentences import sentences
from identification.report import diagnosis_summary, write_diagnosis_report
from identification.report.diagnosis_tables import changes
from identification.result.result import Quantity
from tests.identification.diagnosis.made_diagnosis import made_diagnosis
from tests.identification.made_result import made_result
from tests.identification.report.page_reader import read
from vibrojax.effects import MissingStop

STOP = MissingStop(impact_stiffness=3.6e5, impact_exponent=0.8, impact_damping=1e-6, gap_offset=-0.9938645)
PLACE = "0.0061355 ± 0.0000037"
OFFSET = "−0.9938645 ± 0.0000037"


def asserted(gap: float | None) -> Asserted:
    """The stop of a rig whose file has no stop, which is what a gap of 1 m says."""
    numbers = tuple(
        Quantity(name=p.name, symbol=p.symbol, unit=p.unit, value=getattr(STOP, p.field), stderr=3.7e-6 if p.name == "gap_offset" else None)
        for p in STOP.parameters
    )
    return Asserted(effect=STOP, probability=0.99, parameters=numbers, gap=gap)


@pytest.fixture(scope="module")
def diagnosis():
    made, one = made_diagnosis(made_result(samples=700), MISSING), asserted(1.0)
    own = tuple(dataclasses.replace(n, name=f"missing_stop.{n.name}") for n in one.parameters)
    model = dataclasses.replace(made.nominal.model, effects=(STOP,))
    after = dataclasses.replace(made.augmented, model=model, parameters=(*made.nominal.parameters, *own))
    said = sentences(MISSING, (one,), {}, None, made.nominal, after, "")
    return dataclasses.replace(made, effects=(one,), augmented=after, sentences=said)


def test_a_stop_stands_on_the_axis_of_u_where_all_records_have_one_gap():
    *others, place = asserted(1.0).reported
    assert others == list(asserted(1.0).parameters[:-1])
    assert (place.symbol, place.unit, place.value, place.stderr) == ("u_stop", "m", pytest.approx(0.0061355), 3.7e-6)


def test_it_stays_beyond_the_gap_where_gaps_differ():
    assert asserted(None).reported == asserted(None).parameters


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
    assert next(row[2] for row in changes(diagnosis).rows if row[0] == "u_stop") == PLACE


def test_the_file_keeps_the_offset(diagnosis):
    numbers = diagnosis.document()["effects"][0]["parameters"]
    assert list(numbers) == ["k_i", "n", "lambda_i", "gap_offset"]
    assert numbers["gap_offset"] == {"value": -0.9938645, "stderr": 3.7e-6, "unit": "m"}
