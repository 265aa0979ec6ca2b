"""Where a misfit that was put in is said to be."""

import dataclasses

import numpy as np
import pytest

from identification.diagnosis.locate.locate import locate
from vibrojax.effects import CoulombFriction, GapStep

CHANNELS = ("hammer_displacement", "cart_displacement", "hammer_acceleration", "impact_force")


def located(motion, at, **options):
    return locate(motion.prepared, motion.estimate, at, **options)


def test_dry_friction_goes_with_the_velocity_in_free_flight(motion, friction):
    found = located(motion, motion.shown(force=friction(0.1)))
    assert (found.phase, found.coordinate) == ("free flight", "velocity")
    assert found.profiles[0].explained > 0.8
    assert found.record is None and found.time is None
    slow = np.argsort(np.abs(found.profiles[0].center))[:6]
    assert np.all(found.profiles[0].mean[slow] * found.profiles[0].center[slow] < 0)


def test_a_spring_goes_with_the_displacement(motion):
    found = located(motion, motion.shown(force=-2e6 * motion.at.u**3))
    assert found.coordinate == "displacement"
    assert "displacement" in found.sentence


def test_a_load_cell_that_saturates_has_the_misfit_to_itself(motion):
    ceiling = 0.4 * motion.at.push.max()
    found = located(motion, motion.shown(readings={"impact_force": np.minimum(ceiling - motion.at.push, 0.0)}))
    assert (found.channel, found.phase, found.coordinate) == ("impact_force", "contact", "indentation")
    assert found.channels["impact_force"] > 0.95
    assert "of it in the load cell" in found.sentence
    assert found.profiles[0].quantity == "impact_force"


def test_a_stop_that_holds_back_shows_while_the_hammer_leaves(motion):
    gaps = np.array([r.gap for r in motion.prepared.experiment.records]) + motion.estimate.nuisances[:, 2]
    outside = motion.at.u - gaps[motion.at.record, None]
    found = located(motion, motion.shown(force=0.3 * ((outside < 0) & (outside > -3e-4) & (motion.at.v < 0))))
    assert found.phase == "separation"
    assert "leaves the stop" in found.sentence


def test_an_independent_spectral_line_is_given_by_its_frequency(motion):
    found = located(motion, motion.shown(force=0.1 * np.sin(2 * np.pi * 29.0 * motion.at.ts)))
    assert found.coordinate == "time"
    tone = float(found.sentence.split("steady tone of ")[1].split(" Hz")[0])
    assert tone == pytest.approx(29.0, abs=0.5)


def test_a_cart_that_moves_otherwise_goes_with_the_excitation_phase(motion):
    records = motion.prepared.experiment.records
    frequency = np.array([r.excitation_frequency or 0.0 for r in records])[motion.at.record, None]
    phase = 2 * np.pi * frequency * motion.at.ts + motion.estimate.nuisances[motion.at.record, 1, None]
    found = located(motion, motion.shown(readings={"cart_displacement": 3e-5 * np.sin(2 * phase) * (frequency > 0)}))
    assert (found.channel, found.coordinate, found.phase) == ("cart_displacement", "excitation phase", "all")
    assert found.records[records[0].file] == pytest.approx(0.0, abs=0.02)


def late(motion, instant):
    """Misfit of the contacts of one record from an instant on."""
    chosen = (motion.at.record == 2)[:, None] & (motion.at.ts > instant)
    return motion.shown(force=2.0 * chosen * motion.at.in_contact)


def test_an_onset_in_one_record_is_given_by_its_time(motion):
    file = motion.prepared.experiment.records[2].file
    found = located(motion, late(motion, 0.4))
    assert found.record == file
    assert found.time == pytest.approx(0.4, abs=0.15)
    assert found.coordinate == "time" and found.interval[0] == found.time
    assert f"of {file}; before it the record agrees" in found.sentence


def test_a_named_effect_says_when_and_where_it_acts(motion):
    file = motion.prepared.experiment.records[2].file
    step = GapStep(gap_jump=1e-4, instant=0.37, in_file=file)
    found = located(motion, late(motion, 0.4), named=step)
    assert (found.record, found.time, found.interval[0]) == (file, 0.37, 0.37)
    everywhere = located(motion, late(motion, 0.4), named=CoulombFriction(friction_force=0.1))
    assert (everywhere.record, everywhere.time) == (None, None)


def test_a_weak_effect_goes_along_the_coordinate_of_its_own_force(motion, friction):
    """The residuals alone would say another one, or none."""
    weak = motion.shown(force=friction(5e-4))
    assert located(motion, weak).coordinate != "velocity"
    found = located(motion, weak, named=CoulombFriction(friction_force=5e-4), acting=friction(5e-4))
    assert found.coordinate == found.profiles[0].coordinate == "velocity"


def test_a_constant_force_goes_along_the_coordinate_of_the_residuals(motion):
    """Every coordinate predicts a constant."""
    constant = np.full_like(motion.at.u, 0.02)
    shown = motion.shown(force=constant)
    assert located(motion, shown, acting=constant).coordinate == located(motion, shown).coordinate


def test_shares_and_maps_are_complete(motion, friction):
    at = motion.shown(force=friction(0.1))
    finite = at.finite.copy()
    finite[[0, 20]] = False
    found = located(motion, dataclasses.replace(at, finite=finite))
    files = [r.file for r in motion.prepared.experiment.records]
    assert sum(found.records.values()) == pytest.approx(1.0) and list(found.records) == files
    assert sum(found.channels.values()) == pytest.approx(1.0) and set(found.channels) == set(CHANNELS)
    assert {m.shape for m in found.maps.values()} == {(24, 24)} and list(found.maps) == files
    assert all(np.isfinite(p.mean).all() and np.isfinite(p.stderr).all() for p in found.profiles)
    assert found.coordinate == found.profiles[0].coordinate


def test_noise_alone_does_not_break_it(motion):
    found = located(motion, motion.shown())
    assert max(p.explained for p in found.profiles) < 0.5
    assert found.sentence.endswith(".")


def test_many_records_are_distinguished(motion, friction):
    """As many as a drop test has heights: bins of all records together are more than a byte counts."""
    experiment, times = motion.prepared.experiment, 8
    records = tuple(dataclasses.replace(r, file=f"{k}-{r.file}") for k in range(times) for r in experiment.records)
    prepared = dataclasses.replace(
        motion.prepared, experiment=dataclasses.replace(experiment, records=records), motions=motion.prepared.motions * times
    )
    estimate = dataclasses.replace(motion.estimate, nuisances=np.tile(motion.estimate.nuisances, (times, 1)))
    at = motion.shown(force=friction(0.1))
    late = dataclasses.replace(at, record=at.record + (times - 1) * len(experiment.records))
    found = locate(prepared, estimate, late)
    assert (found.phase, found.coordinate) == ("free flight", "velocity")


def test_no_line_is_searched_for_where_sampling_is_coarse(motion, friction):
    slow, experiment = 1e3, motion.prepared.experiment
    records = tuple(dataclasses.replace(record, time=slow * record.time) for record in experiment.records)
    prepared = dataclasses.replace(motion.prepared, experiment=dataclasses.replace(experiment, records=records))
    at = motion.shown(force=friction(0.1))
    found = locate(prepared, motion.estimate, dataclasses.replace(at, ts=slow * at.ts))
    assert found.phase == "free flight" and "steady tone" not in found.sentence
