"""The four calls of the package, and what they return."""

import dataclasses
import subprocess
import sys

import jax
import jax.numpy as jnp
import numpy as np
import pytest

import identification
import vibrojax
from identification import front_door
from identification.estimation.simulate import simulate_record
from identification.experiment import ExperimentError
from identification.front_door import Diagnosed, Fit
from identification.guesses.declared_model import nominal_model
from tests.identification.diagnosis.made_diagnosis import made_diagnosis
from tests.identification.made_result import F_N, MODEL, ZETA, made_result
from vibrojax.data_files import data_path
from vibrojax.errors import InputError, NoConvergenceError


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
def test_a_missing_folder_is_refused(call):
    with pytest.raises(ExperimentError, match="nowhere does not exist"):
        getattr(identification, call)("nowhere")


def test_options_that_mean_nothing_are_refused():
    with pytest.raises(InputError, match="draws is 4: expected 50 or more"):
        identification.fit("nowhere", draws=4)
    with pytest.raises(InputError, match="budget_minutes is nan: expected minutes"):
        identification.diagnose("nowhere", budget_minutes=float("nan"))


def test_options_reach_the_fit(monkeypatch):
    asked = {}

    def fit_experiment(experiment, **options):
        asked.update(options, name=experiment.name)
        return made_result(samples=600)

    monkeypatch.setattr(front_door, "fit_experiment", fit_experiment)
    found = identification.fit(str(data_path("example")), law="hertz", effects=["hysteresis"], seed=5)
    assert isinstance(found, Fit)
    assert (asked["law"], asked["effects"], asked["seed"], asked["draws"]) == ("hertz", ("hysteresis",), 5, None)


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
    page = found.report(tmp_path / "page", style="print")
    assert (page.parent / "diagnosis.json").exists()
    assert 'class="print"' in page.read_text(encoding="utf-8")
    with pytest.raises(InputError, match="style is 'grey': expected one of screen, print"):
        found.report(tmp_path / "other", style="grey")
    assert not (tmp_path / "other").exists()


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
    """A hammer that is let go far below the stop swings freely; near it, it strikes."""
    ts = jnp.linspace(0.0, 1.0 / F_N, 501)
    far = vibrojax.simulate(MODEL, ts, gap=1.0, y0=jnp.array([-0.01, 0.0]))
    root, angle = np.sqrt(1.0 - ZETA**2), 2.0 * np.pi * np.sqrt(1.0 - ZETA**2)
    expected = -0.01 * np.exp(-2.0 * np.pi * ZETA) * (np.cos(angle) + ZETA / root * np.sin(angle))
    assert far["relative_displacement"][-1] == pytest.approx(expected, rel=1e-6)
    assert float(far["impact_force"].max()) == 0.0
    near = vibrojax.simulate(MODEL, ts, gap=0.0, y0=jnp.array([-0.01, 0.0]))
    assert float(near["impact_force"].max()) > 10.0


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ({"ts": jnp.linspace(0.1, 0.0, 11)}, "expected increasing times"),
        ({"gap": float("nan")}, "the gap is nan"),
        ({"y0": jnp.zeros(3)}, "expected displacement"),
    ],
)
def test_a_simulation_refuses_what_cannot_be_meant(given, message):
    with pytest.raises(InputError, match=message):
        vibrojax.simulate(MODEL, **{"ts": jnp.linspace(0.0, 0.1, 11), "gap": 0.0} | given)


def test_a_simulation_that_fails_is_no_series():
    with pytest.raises(RuntimeError, match="cannot be integrated"):
        vibrojax.simulate(MODEL, jnp.linspace(0.0, 100.0, 1001), gap=0.0, y0=jnp.array([-0.01, 0.0]))


WRONG_TYPES = """
import jax
jax.config.update("jax_enable_x64", True)
import jax.numpy as jnp, identification, vibrojax
calls = [lambda: identification.fit(None), lambda: identification.diagnose(None), lambda: identification.simulate("model.json", "nowhere"),
         lambda: vibrojax.simulate(None, jnp.arange(3), gap=0.0)]
for call in calls:
    try:
        call()
    except vibrojax.errors.InputError as error:
        print(error)
"""


def test_arguments_of_another_type_are_refused():
    """In a process of its own: here, types are checked before the call."""
    done = subprocess.run([sys.executable, "-c", WRONG_TYPES], capture_output=True, text=True)
    lines = done.stdout.splitlines()
    assert len(lines) == 4, done.stderr
    assert all("of type NoneType: expected one that is loaded, or a path" in line for line in lines[:2])
    assert "of type str: expected a Model" in lines[2]
    assert "expected two times or more, floats" in lines[3]


def test_a_fit_that_did_not_converge_is_not_handed_on(monkeypatch):
    stopped = dataclasses.replace(made_result(samples=600), converged=False)
    monkeypatch.setattr(front_door, "fit_experiment", lambda *nouns, **options: stopped)
    with pytest.raises(NoConvergenceError, match="did not converge"):
        identification.fit(data_path("example"))


def test_a_notebook_shows_a_result_once(monkeypatch):
    monkeypatch.setattr("rich.console._is_jupyter", lambda: True)
    monkeypatch.setenv("FORCE_COLOR", "1")
    found = Fit(made_result(samples=600))
    assert "k_i" in repr(found) and "\x1b" not in repr(found)
    assert "k_i" in found._repr_html_()
