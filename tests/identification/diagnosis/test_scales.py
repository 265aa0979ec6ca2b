"""Scales from which candidates take their sizes: spectral lines, and what sets the size of the motion."""

import dataclasses

import numpy as np
import pytest

from identification.diagnosis.scales import _is_known, _strongest
from identification.experiment import Load, Suspension


def test_a_tone_is_the_strongest_line_whatever_its_phase_in_each_record():
    rng, dt = np.random.default_rng(0), 0.01
    series = []
    for count, phase in ((3000, 0.3), (2000, 2.0)):
        time = dt * np.arange(count)
        series.append((rng.standard_normal(count) + 0.3 * np.sin(2.0 * np.pi * 3.21 * time + phase), dt))
    assert _strongest(series)[0] == pytest.approx(3.21, abs=0.25 / 30.0)


def test_records_at_other_rates_count_up_to_their_own_band():
    rng = np.random.default_rng(1)
    fast = rng.standard_normal(4000) + 0.3 * np.sin(2.0 * np.pi * 60.0 * 0.005 * np.arange(4000))
    assert _strongest([(fast, 0.005), (rng.standard_normal(500), 0.02)])[0] == pytest.approx(60.0, abs=0.1)


@pytest.mark.parametrize(
    "changes", [{"suspension": Suspension(kind="pendulum", length=0.5)}, {"load": Load(incline=0.1)}, {"load": Load(constant_force=1.0)}]
)
def test_a_length_or_a_load_sets_the_size_of_the_motion(small, changes):
    records = tuple(dataclasses.replace(record, base_amplitude=None) for record in small.records)
    bare = dataclasses.replace(small, records=records, load=Load(), suspension=Suspension(kind="linear"))
    assert not _is_known(bare)
    assert _is_known(dataclasses.replace(bare, **changes))
