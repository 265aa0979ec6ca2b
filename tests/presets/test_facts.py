"""Every stated fact is asked, and an answer can be no."""

import tomllib

import pytest

from vibrojax.data_files import data_path
from vibrojax.presets import NAMES, read_preset
from vibrojax.presets.facts import FACTS, BandPlace, band, coexisting
from vibrojax.presets.single_impact import SingleImpact


def test_no_stated_behaviour_is_left_out():
    tables = {read_preset(name).thesis for name in NAMES}
    rows = {row["name"] for table in tables for row in tomllib.loads(data_path("thesis", f"{table}.toml").read_text())["value"]}
    about_motion = {row for row in rows if row.startswith(("observed", "basin", "compared", "no_impact"))}
    asked = {row for fact in FACTS for row in fact.rows}
    assert about_motion - asked == {"observed_gap_0_0_at_3_75"}  # a frequency that is shown, with nothing said about it
    for fact in FACTS:
        assert fact.statement and fact.source


def test_a_band_of_the_compliant_rig_ends_near_that_of_the_rigid_one():
    preset = read_preset("wires")
    found = band("wires", 1e-3, 1)
    ideal = SingleImpact(damping_ratio=0.01, restitution=0.8, gap=1e-3 / preset["base_amplitude"], cycles=1).band_end()
    assert found.end == pytest.approx(ideal * 1.82, rel=5e-3)
    assert 0.95 * found.end < found.largest <= found.end


def test_an_answer_may_be_yes_or_no():
    near = BandPlace(preset="wires", rows=("observed_gap_1_0_at_3_0",), place="largest", gap=1e-3, cycles=1)
    far = BandPlace(preset="wires", rows=("observed_gap_1_0_at_7_0",), place="end", gap=1e-3, cycles=1)
    assert near.ask().reproduced
    assert not far.ask().reproduced


def test_coexistence_is_distinguished_from_either_motion_alone():
    preset = read_preset("wires")
    both = coexisting(preset, 1.75, 2.5)
    assert both.stays_off and 0 < both.late == both.early < both.starts
    out_of_reach = coexisting(preset, 1.75, 40.0)
    assert out_of_reach.stays_off and out_of_reach.early == 0
    assert not coexisting(preset, 1.75, 1.0).stays_off


def test_a_long_transient_is_no_coexistence():
    fact = next(fact for fact in FACTS if fact.preset == "wires" and fact.values == (2.25, 1.5))
    found = coexisting(read_preset("wires"), 2.25, 1.5)
    assert found.late < found.early
    assert not fact.ask().reproduced
