# %% [markdown]
# # First fit: from records to parameters
#
# A hammer on a suspension in a moving cart strikes a stop. Four records of such a rig come with the program: one drop test and three
# with the cart driven as a sine. We want the law of the stop, $F_i = k_i\,\delta^n (1 + \lambda_i\,\dot\delta)$, and the damping ratio
# $\zeta$ and natural frequency $f_n$ of the suspension, with errors that deserve the name.
#
# The records are simulated, by a simulator that shares no code with the program, so the truth is known.

# %%
import dataclasses
import os

import matplotlib.pyplot as plt
import numpy as np
from rich.console import Console

from vibrojax.cli.environment import prepare_jax

prepare_jax()

from identification.estimation.estimate import fit_experiment
from identification.estimation.simulate import simulate_record
from identification.experiment import load_experiment
from identification.report import fit_summary
from identification.report.base import SCREEN
from vibrojax.data_files import data_path
from vibrojax.drawing import STYLE

SMALL = os.environ.get("VIBROJAX_NOTEBOOKS") == "small"
plt.rcParams.update(STYLE)
TRUTH = {"k_i": 3.0e6, "n": 1.5, "lambda_i": 0.35, "zeta": 0.012, "f_n": 5.2}

# %% [markdown]
# ## Read
# An experiment is a folder with `experiment.toml` and one table a record. Everything is converted to SI; whatever is odd is stated.

# %%
experiment = load_experiment(data_path("example"))
if SMALL:
    experiment = dataclasses.replace(experiment, records=experiment.records[:2])
for record in experiment.records:
    noise = ", ".join(f"{name} {sigma:.3g}" for name, sigma in record.noise.items())
    print(f"{record.file:14} {record.kind:16} {len(record.time):6d} samples; noise: {noise}")

# %% [markdown]
# ## First the failure
# Why not simply simulate each record from its first sample with a first guess, and compare? Because errors grow from impact to impact:
# with every parameter 10 % off, a good guess by any standard, the simulated record is soon out of step with the measured one, and a fit
# that starts there follows slopes that lead elsewhere.

# %%
result = fit_experiment(experiment)
driven = experiment.records[1]
off = simulate_record(result.model.replace({name: 1.1 * value for name, value in TRUTH.items()}), driven)
error_off = np.std(off["hammer_displacement"] - driven.channels["hammer_displacement"]) / np.std(driven.channels["hammer_displacement"])
print(f"10 % off, one long simulation: error {100 * error_off:.0f} % of the motion")

# %% [markdown]
# ## Then the cure
# The fit makes a chain of short segments of each record, too short for an error to grow. It begins at the measured motion with a large
# random force on the hammer, which makes up for wrong parameters, and takes the force away as the likelihood allows.

# %%
Console(width=120).print(fit_summary(result))

# %% [markdown]
# A stretch of a driven record beside the motion of the model alone, and all its impacts as loops of force against indentation.

# %%
figure, axes = plt.subplots(1, 2, figsize=(8.4, 3.2), layout="constrained", width_ratios=(1.6, 1))
fitted = result.records[1]
view = slice(0, 2400)
axes[0].plot(fitted.time[view], 1e3 * fitted.measured["hammer_displacement"][view], ".", ms=2.5, color=SCREEN.measured, label="measured")
axes[0].plot(fitted.time[view], 1e3 * fitted.predicted["hammer_displacement"][view], color=SCREEN.model, label="fitted")
axes[0].set(xlabel="time (s)", ylabel="hammer displacement x (mm)")
axes[0].legend()
depth = 1e6 * (fitted.relative_displacement - fitted.gap)
touching = depth > 0
axes[1].plot(depth[touching], fitted.measured["impact_force"][touching], "o", ms=3, color=SCREEN.measured, label="measured")
axes[1].plot(depth[touching], fitted.predicted["impact_force"][touching], ".", ms=2, color=SCREEN.model, label="fitted")
axes[1].set(xlabel="indentation δ (µm)", ylabel="impact force F_i (N)")
_ = axes[1].legend()

# %% [markdown]
# ## What was claimed
# Every number above, checked.

# %%
assert result.converged
assert 0.98 < result.chi2_reduced < 1.02
assert error_off > 0.5
for parameter in result.parameters:
    assert abs(parameter.value - TRUTH[parameter.spec.name]) < 3 * parameter.stderr, parameter.spec.name
assert result.discretisation < 0.1
