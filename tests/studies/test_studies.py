import dataclasses
import json
import sys

import numpy as np
import pytest
import xarray as xr

from tests.batch.rigs import AMPLITUDE, GAP, model
from vibrojax.batch import Responses, Span, grid, integrate
from vibrojax.continuation import ForcedRig, find_orbit, settle
from vibrojax.effects import ForceClipping, GainError, SecondMode, StopCompliance
from vibrojax.errors import InputError
from vibrojax.integrate.base import NOT_FINITE
from vibrojax.studies import basins, bifurcation, frequency_response, hammer_design, lyapunov, peterka, section
from vibrojax.studies.base import APERIODIC, FAILED, NO_IMPACT, PERIODIC, classify
from vibrojax.studies.bifurcation import jumps
from vibrojax.studies.write import write_study
from vibrojax.suspension import Free

LIGHT = 9.81 * 0.5


def check_drawn(name: str, data: xr.Dataset, folder) -> None:
    """Files are written, the data set comes back with its units, and the provenance can be read."""
    files = write_study(name, data, folder)
    assert [file.suffix for file in files[:5]] == [".nc", ".png", ".pdf", ".svg", ".md"] and files[1].stat().st_size > 5000
    with xr.open_dataset(files[0], engine="scipy") as back:
        for variable in data.data_vars:
            assert back[variable].attrs["units"] == data[variable].attrs["units"]
            np.testing.assert_allclose(back[variable].values, data[variable].values)
    assert json.loads(data.attrs["model"])["law"]["name"] == "hunt-crossley"
    assert data.attrs["engine"] == "exact-flight"


def test_frequency_response(tmp_path):
    data = frequency_response(model(), frequency_hz=np.linspace(5.0, 8.0, 13), gap=np.array([0.0, GAP]), base_amplitude=AMPLITUDE)
    assert data["impact_force"].dims == ("gap", "frequency_hz")
    np.testing.assert_allclose(data["force_over_weight"], data["impact_force"] / LIGHT)
    single = integrate(model(), grid({"frequency_hz": [6.25]}, gap=GAP, base_amplitude=AMPLITUDE))
    np.testing.assert_allclose(data["impact_force"].sel(gap=GAP, frequency_hz=6.25), single.peak_force.max(), rtol=1e-6)
    peak = data["impact_force"].sel(gap=0.0).idxmax().item()
    assert 7.0 < peak < 7.75  # twice f_n, less what the gap and the damping take
    check_drawn("response", data, tmp_path)


def test_peterka_map(tmp_path):
    data = peterka(model(), ratio=np.array([1.4, 2.5, 3.2]), clearance=np.array([0.2, 1.0]), base_amplitude=AMPLITUDE, lyapunov_cycles=50)
    first, subharmonic = data.sel(ratio=1.4), data.sel(ratio=3.2)
    assert (first["impacts"] == 1).all() and (first["period"] == 1).all()
    assert (subharmonic["impacts"] == 1).all() and (subharmonic["period"] == 2).all()
    np.testing.assert_array_equal(np.isfinite(data["lyapunov"]), data["kind"] == APERIODIC)
    with pytest.raises(InputError, match="base_amplitude is 0: expected a number above 0"):
        peterka(model(), ratio=[1.0], clearance=[1.0], base_amplitude=0.0)
    with pytest.raises(InputError, match="a Peterka map needs a natural frequency: the suspension 'free' has none"):
        peterka(model(suspension=Free()), ratio=[1.0], clearance=[1.0], base_amplitude=AMPLITUDE)
    check_drawn("peterka", data, tmp_path)


def test_bifurcation_diagram_finds_the_jump_of_a_gap_that_is_too_wide(tmp_path):
    """Closed to start with, the gap opens until the hammer no longer reaches the stop; on the way back it stays at rest for longer."""
    gaps = np.linspace(2e-3, 8e-3, 13)
    data = bifurcation(model(), parameter="gap", values=gaps, base_amplitude=AMPLITUDE, frequency_hz=7.0)
    kinds = data["kind"].values
    steady = AMPLITUDE * 49.0 / abs(16.0 - 49.0 + 2j * 0.02 * 28.0)
    assert (kinds[0, gaps < 2.9e-3] == PERIODIC).all()
    assert (kinds[1, gaps > steady] == NO_IMPACT).all()
    assert data["jump"].sel(direction="up").sum() >= 1
    with pytest.raises(InputError, match="expected at least 3 that increase"):
        bifurcation(model(), parameter="gap", values=np.array([1.0, 0.5, 0.1]), base_amplitude=AMPLITUDE, frequency_hz=7.0)
    check_drawn("bifurcation", data, tmp_path)


@pytest.mark.parametrize("twice", ["gap", "base_amplitude"])
def test_what_is_swept_is_not_also_fixed(twice):
    with pytest.raises(InputError, match=f"{twice} is given both as what is swept and as a fixed value"):
        bifurcation(model(), parameter=twice, values=[1e-3, 2e-3, 3e-3], base_amplitude=1e-3, **{"frequency_hz": 6.0, "gap": 1e-3})


def test_a_steep_branch_is_no_jump():
    x = np.linspace(-3.0, 3.0, 40)
    steep, calm = np.tanh(4.0 * x), np.full((2, 40), PERIODIC)
    assert jumps(np.stack([steep, steep]), calm).sum() == 0
    broken = np.where(x > 1.0, steep + 0.5, steep)
    assert np.argwhere(jumps(np.stack([broken, broken]), calm)).tolist() == [[0, 27], [1, 26]]
    assert jumps(np.stack([broken, broken]), np.full((2, 40), APERIODIC)).sum() == 0


@pytest.mark.parametrize("left", [0.0, np.nan])
def test_a_value_that_could_not_be_integrated_is_no_jump_and_hides_none(left):
    line, kinds = np.linspace(1.0, 2.0, 20), np.full((2, 20), PERIODIC)
    kinds[:, 8] = FAILED
    assert jumps(np.stack([np.where(kinds[0] == FAILED, left, line)] * 2), kinds).sum() == 0
    broken = np.where(line > 1.8, line + 0.5, line)
    assert np.argwhere(jumps(np.stack([np.where(kinds[0] == FAILED, left, broken)] * 2), kinds)).tolist() == [[0, 16], [1, 15]]


def test_a_sweep_goes_on_from_where_the_value_that_failed_began(monkeypatch):
    """Of three gaps the second fails; the third starts from where the first ended."""
    starts = []

    def failing(model, points, *, start, **options):
        found = integrate(model, points, start=start, **options)
        starts.append(start)
        if len(starts) != 2:
            return found
        lost = found.state._replace(u=np.nan * found.state.u, v=np.nan * found.state.v)
        return dataclasses.replace(found, result=np.full_like(found.result, NOT_FINITE), state=lost)

    monkeypatch.setattr(sys.modules["vibrojax.studies.bifurcation"], "integrate", failing)
    span = Span(transient=10, recorded=4, closed=None)
    data = bifurcation(model(), parameter="gap", values=[2e-3, 3e-3, 4e-3], base_amplitude=AMPLITUDE, frequency_hz=7.0, span=span)
    np.testing.assert_array_equal(starts[1].u, starts[2].u)
    assert np.isfinite(data["displacement"].values[0, 2]).all()
    assert (data["result"].values[:, 1] == NOT_FINITE).all()


def test_lyapunov_exponent_of_a_linear_rig_is_its_damping(tmp_path):
    """Without contact every disturbance decays with exp(-zeta omega t); with it, z = 1/2 at 13 Hz attracts and chaos at 15.5 Hz repels."""
    frequencies = np.array([5.0, 8.0])
    quiet = dict(values=frequencies, base_amplitude=AMPLITUDE, cycles=100)
    data = lyapunov(model(), parameter="frequency_hz", gap=1.0, **quiet)
    decay = -0.02 * 2 * np.pi * 4.0 / frequencies
    np.testing.assert_allclose(data["exponent"], decay, rtol=0.02)
    np.testing.assert_allclose(data["exponent"] + data["second_exponent"], 2.0 * decay, rtol=1e-5)  # Liouville: the area shrinks
    check_drawn("lyapunov", data, tmp_path)
    struck = lyapunov(model(), parameter="frequency_hz", gap=2.4e-3, **quiet | dict(values=np.array([13.0, 15.5])))
    assert struck["exponent"].values[0] < -0.05 < 0.1 < struck["exponent"].values[1]


def test_basins_of_a_stop_beyond_the_steady_motion(tmp_path):
    """At 7 Hz the hammer swings 2.97 mm without touching a stop at 4 mm, if it starts on that motion; a hard start keeps it impacting."""
    on_orbit = -AMPLITUDE * 49.0 / 33.0 * 2 * np.pi * 7.0
    plane = dict(u0=np.array([-2e-3, 0.0, 2e-3]), v0=np.array([on_orbit, 0.0, 0.3]))
    data = basins(model(), **plane, frequency_hz=7.0, gap=4e-3, base_amplitude=AMPLITUDE)
    assert data["impacting"].sel(u0=0.0, v0=on_orbit) == 0
    assert data["impacting"].sel(u0=0.0, v0=0.3) == 1
    assert 0.0 < data.attrs["basin_measure"] == float((data["impacting"] == 1).mean()) < 1.0
    check_drawn("basins", data, tmp_path)


def test_section_and_histories_belong_together(tmp_path):
    data = section(model(), frequency_hz=5.2, gap=GAP, base_amplitude=AMPLITUDE, strobes=20, transient=200, cycles=3, samples=200)
    strobes = data["u"].sel(time=np.arange(4) / 5.2, method="nearest").values
    np.testing.assert_allclose(strobes[0], data["displacement"].values[-1])
    np.testing.assert_allclose(strobes, data["displacement"].values[-1], atol=2e-5 * AMPLITUDE)
    assert (data["impact_force"].values[data["u"].values < GAP] == 0).all()
    assert data["impact_force"].max() > 0
    check_drawn("section", data, tmp_path)


def test_hammer_design_keeps_spring_and_damper(tmp_path):
    data = hammer_design(model(), mass_ratio=[0.5, 1.0, 2.0], frequency_hz=[5.0, 6.0], gap=GAP, base_amplitude=AMPLITUDE)
    heavy = integrate(
        model(), grid({"frequency_hz": [6.0]}, m=1.0, f_n=4.0 / 2**0.5, zeta=0.02 / 2**0.5, gap=GAP, base_amplitude=AMPLITUDE)
    )
    np.testing.assert_allclose(data["impact_force"].sel(mass_ratio=2.0, frequency_hz=6.0), heavy.peak_force.max(), rtol=1e-6)
    check_drawn("design", data, tmp_path)
    with pytest.raises(InputError, match="'free' has no stiffness that could stay; use linear or pendulum"):
        hammer_design(model(suspension=Free()), mass_ratio=[1.0], frequency_hz=[5.0], gap=GAP, base_amplitude=AMPLITUDE)


def test_kinds_are_distinguished():
    u = np.array([[1.0, 2.0] * 8, [1.0] * 16, list(np.random.default_rng(0).normal(size=16)), [0.5] * 16])
    hits = np.array([[1, 0] * 8, [2] * 16, [1] * 16, [0] * 16])
    nothing, zero = np.zeros_like(u), np.zeros(4)
    state = integrate(model(), grid({"frequency_hz": [5.0]}, gap=GAP, base_amplitude=AMPLITUDE), span=Span(transient=0)).state
    found = Responses(
        coords={}, u=u, v=u, impacts=hits, peak_force=hits * 1.0, impact_speed=nothing, u_max=zero,
        closed=zero, cycles=zero, result=np.zeros(4, int), state=state, engine="none", seconds=0.0,
    )  # fmt: skip
    kind = classify(found, 1.0, np.array(1.0))
    assert kind.kind.tolist() == [PERIODIC, PERIODIC, APERIODIC, NO_IMPACT]
    assert kind.impacts.tolist() == [1, 2, 0, 0]
    assert kind.period.tolist() == [2, 1, 0, 1]


@pytest.mark.parametrize("gap", [1e-3, 0.1], ids=["impacts", "flight"])
def test_the_exponent_of_an_orbit_is_the_logarithm_of_its_largest_multiplier(gap):
    """Also where an effect has states of its own, of which the rig feels the memory."""
    rig = dataclasses.replace(model(), effects=(SecondMode(mode_mass=0.1, mode_frequency_hz=20.0, mode_damping_ratio=0.005),))
    forced = ForcedRig(rig, gap=gap, base_amplitude=AMPLITUDE, frequency_hz=6.0)
    state, cycles = settle(forced, np.zeros(4))
    largest = abs(find_orbit(forced, state, cycles=cycles).multipliers[0])
    data = lyapunov(rig, parameter="frequency_hz", values=[6.0], base_amplitude=AMPLITUDE, gap=gap)
    assert data["exponent"].item() == pytest.approx(np.log(largest) / cycles, rel=0.02, abs=2e-3)


@pytest.mark.parametrize("fault", [GainError(factor=2.0, of_channel="impact_force"), ForceClipping(ceiling=5.0)])
def test_a_section_shows_the_rig_and_not_its_recorder(fault):
    options = dict(frequency_hz=5.0, gap=0.0, base_amplitude=AMPLITUDE, strobes=4, transient=40)
    bare, recorded = section(model(), **options), section(dataclasses.replace(model(), effects=(fault,)), **options)
    np.testing.assert_array_equal(recorded["impact_force"], bare["impact_force"])


def test_a_section_steps_as_finely_as_a_ringing_stop_asks_for():
    sprung = StopCompliance(stop_stiffness=1e6, stop_frequency_hz=700.0, stop_damping_ratio=0.05)
    data = section(
        dataclasses.replace(model(), effects=(sprung,)),
        frequency_hz=2.5,
        gap=0.0,
        base_amplitude=AMPLITUDE,
        strobes=4,
        transient=40,
    )
    assert np.isfinite(data["impact_force"]).all()


def test_a_data_set_says_what_its_kinds_are():
    data = frequency_response(model(), frequency_hz=[5.0], gap=[0.0], base_amplitude=AMPLITUDE)
    assert data["kind"].attrs["long_name"] == "kind of motion: 0 no impact, 1 periodic impacts, 2 aperiodic impacts, 3 not integrated"
