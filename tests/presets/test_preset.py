"""What a preset says about itself: origins, and nothing stated that is not."""

import tomllib

import jax.numpy as jnp
import numpy as np
import pytest

from vibrojax.contact import KelvinVoigtClipped
from vibrojax.data_files import data_path
from vibrojax.errors import InputError
from vibrojax.excitation import Unforced, at_rest
from vibrojax.integrate import Landing
from vibrojax.model_file import read_model, write_model
from vibrojax.presets import NAMES, Origin, read_preset
from vibrojax.presets.preset import clipped_dashpot
from vibrojax.suspension import Free
from vibrojax.system import System


def stated(preset) -> list[tuple[float, str]]:
    rows = tomllib.loads(data_path("thesis", f"{preset.thesis}.toml").read_text())["value"]
    return [(row["value"], row["unit"]) for row in rows]


@pytest.mark.parametrize("name", NAMES)
def test_what_is_called_stated_is_stated(name):
    preset = read_preset(name)
    to_si = {"mm": 1e-3, "kN": 1e3}
    known = [value * to_si.get(unit, 1.0) for value, unit in stated(preset)]
    for number in preset.numbers.values():
        if number.origin is Origin.STATED:
            assert np.isclose(number.value, known).any()
        assert number.why and number.unit
    if name != "drilling_hammer":
        assert all(np.isclose(gap, known).any() for gap in preset.gaps)


@pytest.mark.parametrize("name", NAMES)
def test_the_model_can_be_written_and_read(name, tmp_path):
    preset = read_preset(name)
    write_model(preset.model(), tmp_path / "model.json")
    assert read_model(tmp_path / "model.json").values() == preset.model().values()


def test_the_file_names_the_couplings_of_its_own_configuration():
    assert {name: read_preset(name).title.count(name[-3:]) for name in NAMES if name.startswith("beam")} == {
        "beam_170": 1,
        "beam_150": 1,
        "beam_135": 1,
    }


def test_an_unknown_preset_is_refused():
    with pytest.raises(InputError, match="unknown preset 'beam': expected one of wires, beam_170"):
        read_preset("beam")


def test_the_dashpot_gives_its_restitution():
    law = KelvinVoigtClipped(1e6, clipped_dashpot(0.75, 1e6, 2.0))
    system = System(2.0, Free(), law, 0.0, at_rest(), Unforced())
    flight = Landing(contact_steps=400.0, flight_step=1e-3)(system, jnp.array([0.0, 0.1]), jnp.array([-1e-3, 0.3]))
    assert float(-flight.v[-1] / 0.3) == pytest.approx(0.75, rel=1e-4)
