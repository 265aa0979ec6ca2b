"""The sentence of each study, on data sets made by hand."""

import json

import numpy as np
import xarray as xr

from vibrojax.continuation import Branch, End
from vibrojax.continuation.job import branch_finding
from vibrojax.studies.base import APERIODIC, NO_IMPACT, PERIODIC
from vibrojax.studies.finding import bands, finding


def attrs(**settings):
    return {"settings": json.dumps(settings)}


def test_the_longest_bands_are_named_in_their_order():
    kind = np.array([NO_IMPACT, PERIODIC, PERIODIC, APERIODIC, PERIODIC, PERIODIC, PERIODIC, NO_IMPACT])
    impacts, period = np.array([0, 1, 1, 0, 1, 1, 1, 0]), np.array([0, 1, 1, 0, 2, 2, 2, 0])
    assert bands(np.arange(8.0), kind, impacts, period, "Hz") == (
        "z = 1/1 from 1 to 2 Hz, no period up to 8 cycles at 3 Hz, z = 1/2 from 4 to 6 Hz"
    )
    assert bands(np.arange(2.0), np.array([NO_IMPACT] * 2), np.zeros(2, int), np.zeros(2, int), "Hz") == "no motion with impacts"


def test_a_sweep_names_its_bands_and_jumps():
    shape, f = (2, 5), np.array([7.0, 7.5, 8.0, 8.34, 8.5])
    kind = np.array([[1, 1, 1, 0, 0], [1, 0, 0, 0, 0]])
    data = xr.Dataset(
        {
            "kind": (("direction", "frequency_hz"), kind),
            "period": (("direction", "frequency_hz"), np.where(kind == 1, 2, 0)),
            "impacts": (("direction", "frequency_hz", "cycle"), np.tile([1, 0, 1, 0], (*shape, 1)) * kind[..., None]),
            "jump": (("direction", "frequency_hz"), np.array([[0, 0, 0, 1, 0], [1, 0, 0, 0, 0]])),
        },
        {"direction": ["up", "down"], "frequency_hz": ("frequency_hz", f, {"units": "Hz"})},
        attrs(parameter="frequency_hz"),
    )
    assert finding("bifurcation", data) == ("upwards: z = 1/2 from 7 to 8 Hz, jump at 8.34 Hz; downwards: z = 1/2 at 7 Hz, jump at 7 Hz")


def test_a_response_says_where_the_force_is_largest_for_every_gap():
    dims = ("gap", "frequency_hz")
    data = xr.Dataset(
        {
            "impact_force": (dims, np.array([[1.0, 5.0, 2.0], [0.0, 0.0, 0.0]])),
            "kind": (dims, np.array([[1, 1, 1], [0, 0, 0]])),
            "impacts": (dims, np.array([[1, 1, 1], [0, 0, 0]])),
            "period": (dims, np.array([[1, 1, 1], [0, 0, 0]])),
        },
        {"gap": ("gap", [0.0, 1e-3], {"units": "m"}), "frequency_hz": ("frequency_hz", [3.0, 4.0, 5.0], {"units": "Hz"})},
    )
    assert finding("response", data) == ("gap 0 mm: z = 1/1 from 3 to 5 Hz, largest F_i 5 N at 4 Hz; gap 1 mm: no motion with impacts")


def test_a_section_says_after_how_many_cycles_the_motion_repeats():
    strobes = np.tile([1e-3, 2e-3], 20)
    data = xr.Dataset(
        {
            "displacement": ("strobe", strobes),
            "velocity": ("strobe", strobes),
            "peak_force": ("strobe", np.linspace(0.0, 12.0, 40)),
            "touches": ("strobe", np.ones(40)),
        },
        attrs=attrs(base_amplitude=1e-3, frequency_hz=7.0),
    )
    assert finding("section", data) == "at 7 Hz the motion repeats every 2 cycles, largest F_i 12 N"
    wild = data.assign(displacement=("strobe", np.sin(np.arange(40.0) ** 2)))
    assert "does not repeat within 8 cycles" in finding("section", wild)


def test_chaos_is_counted_along_a_parameter():
    data = xr.Dataset(
        {"exponent": ("frequency_hz", [-0.3, 0.5, np.nan])},
        {"frequency_hz": ("frequency_hz", [3.0, 4.0, 5.0], {"units": "Hz"})},
        attrs(parameter="frequency_hz"),
    )
    assert finding("lyapunov", data) == "chaos at 1 of 3 values, largest exponent 0.5 per cycle at 4 Hz"


def test_draws_of_a_fit_have_an_interval():
    force = np.arange(1.0, 6.0)[:, None, None] * np.array([1.0, 3.0, 2.0])
    data = xr.Dataset(
        {"impact_force": (("quantile", "gap", "frequency_hz"), force)},
        {"gap": ("gap", [1e-3], {"units": "m"}), "frequency_hz": ("frequency_hz", [3.0, 4.0, 5.0], {"units": "Hz"})},
    )
    assert finding("response", data) == "gap 1 mm: largest median F_i 9 N (95 %: 3 to 15 N) at 4 Hz"


def closed(ends: tuple[End, End]) -> Branch:
    """Four stable orbits and two that are not, on a curve that returns to its first point."""
    parameter = np.array([5.0, 6.0, 5.5, 4.5, 4.0, 4.5])
    stable = np.array([True, True, False, False, True, True])
    multipliers = np.where(stable, 0.5, 1.5)[:, None] * np.ones((1, 2), complex)
    ones = np.ones(6)
    return Branch(
        name="frequency",
        label="f (Hz)",
        cycles=2,
        rigid=False,
        parameter=parameter,
        states=np.zeros((6, 2)),
        multipliers=multipliers,
        touches=np.ones(6, dtype=int),
        peak_force=10.0 * parameter,
        impact_speed=ones,
        highest=ones,
        special=(),
        ends=ends,
    )


def test_a_branch_that_closes_is_one_stretch_across_its_first_point():
    found = branch_finding(closed((End.CLOSED, End.CLOSED)))
    assert found == "z = 1/2 stable from 4 to 6 Hz, largest stable F_i 60 N at 6 Hz"
    assert "from 5 to 6 Hz and from 4 to 4.5 Hz" in branch_finding(closed((End.BOUND, End.BOUND)))
