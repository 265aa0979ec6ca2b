"""What is fitted of experiments with more samples than are fitted."""

import dataclasses

import pytest

from identification.experiment.experiment import Preparation
from identification.guesses.fitted_part import in_part


def test_an_experiment_of_usual_size_is_fitted_whole(small):
    part, said = in_part(small)
    assert said == () and all(one is other for one, other in zip(part.records, small.records, strict=True))


def test_long_records_are_fitted_from_their_beginning_and_a_part_that_was_chosen_whole(small):
    first, second = small.records
    chosen = dataclasses.replace(second, preparation=Preparation(crop=(0.0, 1.0)))
    part, said = in_part(dataclasses.replace(small, records=(first, chosen)), 0.7 * (len(first.time) + len(second.time)))
    assert said == ()
    assert part.records[1] is chosen
    cut = part.records[0]
    assert len(cut.time) < len(first.time) and cut.time[0] == first.time[0]
    assert {len(values) for values in cut.channels.values()} == {len(cut.time)}
    assert "are fitted" in cut.notices[-1]


@pytest.mark.parametrize("most", [100.0, 150.0])
def test_of_many_records_some_of_each_kind_are_fitted(small, most):
    drop, cart = small.records
    many = [dataclasses.replace((drop, cart)[number % 2], file=f"record{number:03d}.csv") for number in range(300)]
    without = {name: values for name, values in drop.channels.items() if name != "impact_force"}
    many[6] = dataclasses.replace(drop, file="odd.csv", channels=without)
    many[9] = dataclasses.replace(cart, file="cropped.csv", preparation=Preparation(crop=(0.0, 1.0)))
    many[12] = dataclasses.replace(drop, file="held.csv", held_back=True)
    part, said = in_part(dataclasses.replace(small, records=tuple(many)), most * 2000.0)
    fitted = [record for record in part.records if not record.held_back]
    assert most <= len(fitted) <= most + 2
    assert said == (f"{len(fitted)} of 299 records are fitted, spread evenly over each kind",)
    assert {"odd.csv", "cropped.csv", "held.csv"} < {record.file for record in part.records}
    assert abs(sum(record.kind == drop.kind for record in fitted) - 0.5 * most) <= 1
