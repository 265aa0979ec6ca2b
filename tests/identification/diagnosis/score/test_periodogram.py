"""Lines in what is missing, on rigs of any speed."""

import dataclasses

import numpy as np
import pytest

from identification.diagnosis.score.periodogram import periodogram


@pytest.fixture(params=[1.0, 1000.0])
def hurried(request, motion):
    """Windows and fitted motion whose clock goes so much faster, and the factor."""
    faster = request.param
    records = tuple(
        dataclasses.replace(
            r, time=r.time / faster, excitation_frequency=faster * r.excitation_frequency if r.excitation_frequency else None
        )
        for r in motion.prepared.experiment.records
    )
    experiment = dataclasses.replace(motion.prepared.experiment, records=records)
    return dataclasses.replace(motion.prepared, experiment=experiment), dataclasses.replace(motion.at, ts=motion.at.ts / faster), faster


def strongest(prepared, at, values: np.ndarray) -> float:
    """Frequency of the strongest line, Hz."""
    frequencies, power = periodogram(prepared, at, values, np.ones_like(values), lowest=1.5, apart=0.06)
    return float(frequencies[np.argmax(power)])


def test_a_line_is_found_where_it_is(hurried):
    prepared, at, faster = hurried
    assert strongest(prepared, at, np.sin(2 * np.pi * 41.7 * faster * at.ts)) == pytest.approx(41.7 * faster, abs=0.2 * faster)


def test_what_follows_the_drive_of_its_record_is_no_line(hurried):
    prepared, at, faster = hurried
    drives = np.array([record.excitation_frequency or 0.0 for record in prepared.experiment.records])[at.record, None]
    both = np.sin(2 * np.pi * 3.0 * drives * at.ts) + 0.6 * np.sin(2 * np.pi * 41.7 * faster * at.ts)
    assert strongest(prepared, at, both) == pytest.approx(41.7 * faster, abs=0.2 * faster)


def test_too_few_periods_say_nothing(hurried):
    prepared, at, faster = hurried
    frequencies, power = periodogram(
        prepared, at, np.sin(2 * np.pi * 4.0 * faster * at.ts), np.ones_like(at.ts), lowest=1.5, apart=0.06, fewest=6.0
    )
    assert not power[frequencies < 6.0 / 0.75 * faster].any()
    assert power[frequencies > 8.1 * faster].any()
