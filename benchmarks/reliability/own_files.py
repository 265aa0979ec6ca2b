"""A sound file of each kind that the program or its user writes, and that it reads back."""

import json
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.reliability.recorded_files import csv

RUN = "from vibrojax.cli.main import main; main()"
_EVERY_KEY = """schema = 1
[experiment]
name = "rig-B, March"
[hammer]
mass = 0.4
estimate_mass = true
[rig]
incline = "5 deg"
constant_force = "0.2 N"
[suspension]
kind = "pendulum"
length = 0.09
[contact]
law = "hunt-crossley"
[parameters.k_i]
start = 1e6
bounds = [1e4, 1e8]
varies = true
[parameters.n]
prior = { mean = 1.5, std = 0.05 }
[parameters.lambda_i]
start = 0.3
fixed = true
[sensors.hammer_displacement]
unit = "m"
sign = -1
noise = 1e-6
range = [-0.01, 0.01]
zero = 1e-4
[sensors.impact_force]
unit = "kN"
[[record]]
file = "run.csv"
kind = "free-decay"
gap = 1.0
columns = { time = "time", hammer_displacement = "hammer", impact_force = "force" }
units = { impact_force = "N" }
drop_bad_time = true
crop = [0.01, 0.25]
lowpass = 200.0
decimate = 2
detrend = { hammer_displacement = "linear" }
time_unit = "s"
[[record]]
file = "other.csv"
kind = "cart-excitation"
gap = 0.001
base = "sine"
excitation_frequency = 6.25
columns = { hammer_displacement = "hammer", impact_force = "force" }
held_back = true
resample = 900.0
base_amplitude = 0.002
base_phase = 0.1
initial_displacement = -0.003
initial_velocity = 0.0
duration = 2.0
sampling_frequency = 4000.0
"""


def experiment(path: Path) -> None:
    """A free decay, of which a contact is estimated from a start."""
    csv(path.parent / "run.csv")
    path.write_text(
        'schema = 1\n[experiment]\nname = "rig"\n[hammer]\nmass = 0.4\n[suspension]\nkind = "linear"\n'
        '[sensors.hammer_displacement]\nunit = "m"\nnoise = 1e-6\n[parameters.k_i]\nstart = 1e6\n'
        '[[record]]\nfile = "run.csv"\nkind = "free-decay"\ngap = 1.0\ncolumns = { hammer_displacement = "hammer" }\n'
    )


def every_key(path: Path) -> None:
    """An experiment file with nearly every key that the format knows."""
    for name in ("run.csv", "other.csv"):
        csv(path.parent / name)
    path.write_text(_EVERY_KEY)


def reference(path: Path) -> None:
    """A table of reference values."""
    row = '[[value]]\nname = "k_i"\nsymbol = "k_i"\nvalue = 1.9e6\nunit = "N/m^n"\nsource = "figure 1"\nstderr = 3.0\n'
    path.write_text(f'schema = 1\ntitle = "known"\n{row}')


def model(path: Path) -> None:
    """With a listed effect and a free form."""
    from vibrojax.contact import HuntCrossley
    from vibrojax.effects import CoulombFriction
    from vibrojax.effects.free_form import FreeForm
    from vibrojax.model import Model
    from vibrojax.model_file import write_model
    from vibrojax.suspension import Linear

    effects = (CoulombFriction(0.2), FreeForm(coordinate="velocity", knots=(-0.2, 0.0, 0.2), c1=0.1, c3=-0.1))
    write_model(Model(mass=0.5, suspension=Linear(0.02, 4.0), law=HuntCrossley(1e6, 1.5, 0.3), effects=effects), path)


def fit(path: Path) -> None:
    """What studies read of a fit, with its model."""
    model(path.parent / "model.json")
    values = {"k_i": 1e6, "n": 1.5, "lambda_i": 0.3, "zeta": 0.02, "f_n": 4.0}
    parameters = {name: {"value": value, "stderr": 0.01 * value} for name, value in values.items()}
    matrix = np.eye(len(values)).tolist()
    path.write_text(json.dumps({"schema": 1, "parameters": parameters, "correlation": {"names": list(values), "matrix": matrix}}, indent=1))


def fitted(path: Path) -> None:
    """`result.nc` of a fit of one short record."""
    _commanded(path, "fit")


def diagnosed(path: Path) -> None:
    """`result.nc` of a diagnosis of the same record."""
    _commanded(path, "diagnose", "--only", "coulomb_friction")


def _commanded(path: Path, *command: str) -> None:
    experiment(path.parent / "experiment.toml")
    arguments = [*command, "experiment.toml", "--out", "results", "--quiet"]
    subprocess.run([sys.executable, "-c", RUN, *arguments], cwd=path.parent, check=True, capture_output=True)
    for name in ("result.nc", "fit.json", "diagnosis.json"):
        if (path.parent / "results" / name).exists():
            (path.parent / "results" / name).replace(path.parent / name)


def store_job() -> Any:
    """A map of four tiles."""
    from benchmarks.resume import jobs

    job = jobs()["peterka"]
    axes = {name: values[:: len(values) // 4][:4] for name, values in job.axes.items()}
    return type(job)(study=job.study, model=job.model, axes=axes, settings=job.settings, points=4)


def store(path: Path) -> None:
    """A finished store of that study."""
    from vibrojax.studies.run import make

    make(store_job(), store=path)
