"""Peak forces, impulses, contact times and approach speeds of the studies against SciPy, which shares no code with them."""

import numpy as np
import pytest

from benchmarks.peak_forces import LARGEST, RATIOS, compared, strikes
from vibrojax.presets import NAMES, read_preset
from vibrojax.studies import section


@pytest.mark.parametrize(("name", "frequency"), [("wires", 3.64), ("drilling_hammer", 4.8)])
def test_every_impact_of_a_section_is_that_of_scipy(name, frequency):
    """On both engines; a contact of the wires lasts 1 ms, two samples of the history."""
    preset = read_preset(name)
    span = dict(transient=100, strobes=8, samples=100)
    found = section(preset.model(), frequency_hz=frequency, gap=0.0, base_amplitude=preset["base_amplitude"], **span)
    truth = strikes(preset, frequency, 0.0, (float(found["displacement"][-1]), float(found["velocity"][-1])), cycles=4)
    for part in ("approach_speed", "peak_force", "impulse", "duration"):
        np.testing.assert_allclose(found[f"impact_{part}"], [getattr(one, part) for one in truth], rtol=LARGEST)
    largest = max(one.peak_force for one in truth)
    np.testing.assert_allclose([found["peak_force"].max(), found["impact_force"].max()], largest, rtol=LARGEST)


@pytest.mark.thorough
@pytest.mark.parametrize("ratio", RATIOS)
@pytest.mark.parametrize("name", NAMES)
def test_every_study_of_every_preset_has_the_peak_force_of_scipy(name, ratio):
    off = compared(name, ratio).off
    assert len(off) >= 9
    assert max(map(abs, off.values())) < LARGEST, off
