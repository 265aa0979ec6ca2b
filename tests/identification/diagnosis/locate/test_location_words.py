"""What is said of where a misfit sits, by how many records share it."""

import dataclasses

import pytest

from identification.diagnosis.diagnosis import MISSING
from identification.diagnosis.locate.location_words import sentence
from tests.identification.diagnosis.made_diagnosis import made_diagnosis
from tests.identification.made_result import made_result


@pytest.mark.parametrize(
    ("shares", "words"),
    [
        ([0.25] * 4, "in all records"),
        ([0.09] * 11 + [0.01 / 4] * 4, "in 11 of 15 records"),
        ([0.3, 0.14] + [0.07] * 8, "in r0"),
        ([0.09] * 11 + [0.001] * 9, "in 11 of 20 records"),
    ],
)
def test_records_are_named_where_some_stand_out_and_counted_where_they_are_many(shares, words):
    location = made_diagnosis(made_result(), MISSING).location
    assert location is not None
    spread = dataclasses.replace(location, record=None, records={f"r{index}": share for index, share in enumerate(shares)})
    said = sentence(spread, "force", None, driven=True, before_is_quiet=False)
    assert words in said
    assert "in  " not in said
