"""The four calls of the package, and what they return."""

import subprocess
import sys

import jax
import jax.numpy as jnp
import numpy as np
import pytest

import identification
import vibrojax
from identification import front_door
from identification.experiment import ExperimentError
from identification.front_door import Diagnosed, Fit
from identification.windows.declared_model import nominal_model
from identification.windows.simulate import simulate_record
from tests.identification.diagnosis.made_diagnosis import made_diagnosis
from tests.identification.made_result import F_N, MODEL, ZETA, made_result
from vibrojax.data_files import data_path
from vibrojax.errors import InputError


def test_every_name_is_there_and_no_other():
    assert all(callable(getattr(identification, name)) for name in identification.__all__)
    with pytest.raises(AttributeError, match="no attribute 'refit'"):
        _ = identification.refit


def test_records_are_read_without_jax():
    command = f"import sys, identification; identification.load_experiment({str(data_path('example'))!r}); sys.exit('jax' in sys.modules)"
    assert subprocess.run([sys.executable, "-c", command]).returncode == 0


@pytest.mark.parametrize("call", ["fit", "diagnose"])
def test_single_precision_is_refused_before_anything_is_read(call):
    with jax.enable_x64(False), pytest.raises(InputError, match="expected float64; call jax.config.update"):
        getattr(identification, call)("nowhere")


@pytest.mark.parametrize("call", ["fit", "diagnose"])
def test_a_folder_that_is_not_there_is_told(call):
    with pytest.raises(ExperimentError, match="nowhere does not exist"):
        getattr(identification, call)("nowhere")


def test_options_reach_the_fit(monkeypatch):
    asked = {}

    def fit_experiment(experiment, **options):
        asked.update(options, name=experiment.name)
        return made_result(samples=600)

    monkeypatch.setattr(front_door, "fit_experiment", fit_experiment)
    found = identification.fit(str(data_path("example")), law="hertz", starts=3, seed=5)
    assert isinstance(found, Fit)
    assert (asked["law"], asked["starts"], asked["seed"]) == ("hertz", 3, 5)


def test_a_fit_shows_its_tables_and_hands_on_its_numbers(tmp_path):
    found = Fit(made_result(samples=600))
    estimate = found.parameters["k_i"]
    assert "k_i" in repr(found)
    assert found._repr_html_().startswith("<pre")
    data = found.to_xarray()
    assert float(data.estimate.sel(parameter="k_i")) == estimate.value
    assert {"stderr", "record1_time"} <= set(data.variables)
    page = found.report(tmp_path / "new" / "folder")
    assert page.read_text(encoding="utf-8").startswith("<!DOCTYPE html>")
    assert {"fit.json", "model.json", "result.nc"} <= {path.name for path in page.parent.iterdir()}


def test_a_diagnosis_shows_its_verdict(tmp_path):
    found = Diagnosed(made_diagnosis(made_result(samples=600), "missing"))
    assert found.verdict == "missing"
    assert found.effects == tuple(one.effect.name for one in found.diagnosis.effects)
    assert found.diagnosis.sentences[0][:40] in " ".join(repr(found).split())
    assert found._repr_html_().startswith("<pre")
    assert len(found.to_xarray()) > 0
    assert (found.report(tmp_path / "page").parent / "diagnosis.json").exists()


def test_a_simulation_has_every_channel_over_time(small):
    model = nominal_model(small, None)
    found = identification.simulate(model, small)
    assert list(found) == [record.stem for record in small.records]
    expected = simulate_record(model, small.records[1])
    drive = found[small.records[1].stem]
    np.testing.assert_array_equal(drive.time, expected["time"])
    assert set(drive) == set(expected) - {"time"}
    np.testing.assert_array_equal(drive["impact_force"], expected["impact_force"])


def test_a_model_runs_without_an_experiment():
    """A hammer that is let go below the stop comes back to within its damping, and never touches it."""
    ts = jnp.linspace(0.0, 1.0 / F_N, 501)
    far = vibrojax.simulate(MODEL, ts, gap=1.0, y0=jnp.array([-0.01, 0.0]))
    root = np.sqrt(1.0 - ZETA**2)
    period = 2.0 * np.pi / root
    assert far["relative_displacement"][-1] == pytest.approx(-0.01 * np.exp(-ZETA * period * root) * np.cos(2.0 * np.pi * root), rel=1e-2)
    assert float(far["impact_force"].max()) == 0.0
    near = vibrojax.simulate(MODEL, ts, gap=0.0, y0=jnp.array([-0.01, 0.0]))
    assert float(near["impact_force"].max()) > 10.0
