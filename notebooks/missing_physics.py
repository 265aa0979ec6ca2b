# %% [markdown]
# # The missing physics, found
#
# A rig has something that its model leaves out. The fit fails, in the quiet way: it converges, and its numbers are wrong. Then
# `diagnose` says where the misfit sits, names its cause, adds it, and shows the error fall on a record that no fit has seen.
#
# The rig is simulated by code that shares nothing with the program. What it conceals is drawn here and looked at only at the end.

# %%
import dataclasses
import tempfile
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np

from vibrojax.cli.environment import prepare_jax

prepare_jax()

from benchmarks.simulator import Order, draw_case, write_case
from identification.diagnosis.diagnose import diagnose_experiment
from identification.experiment import load_experiment
from identification.report.base import SCREEN
from vibrojax.drawing import STYLE

plt.rcParams.update(STYLE)

# %% [markdown]
# ## The records
# A drop test and driven records of a random rig, with noise. The last one is held back.

# %%
rng = np.random.default_rng(7)
order = Order(kind="stiff", effects=(("coulomb_friction", 1.0),), driven=2, samples=(2001, 3001))
case = draw_case(rng, order)
with tempfile.TemporaryDirectory() as folder:
    write_case(Path(folder) / "rig", case, rng)
    experiment = load_experiment(Path(folder) / "rig")
*fitted, last = experiment.records
experiment = dataclasses.replace(experiment, records=(*fitted, dataclasses.replace(last, held_back=True)))
for record in experiment.records:
    print(f"{record.file:10} {record.kind:16} {len(record.time)} samples{', held back' if record.held_back else ''}")

# %%
diagnosis = diagnose_experiment(experiment, budget_minutes=60.0)
before, after = diagnosis.nominal, diagnosis.augmented


def unseen(side):
    """Mean square residual over the noise variance on the held-back record, all channels alike; noise alone gives 1."""
    return float(np.mean(list(side.held_back[0].chi2_reduced.values())))


# %% [markdown]
# ## First the failure
# The nominal model has a spring, a viscous damper and the stop. Its fit leaves more than noise, and its damping ratio is more than half as
# large again as the true one: a parameter that may move swallows what the model lacks.


# %%
def table(side):
    """Estimates beside the truth."""
    truth = case.rig.fitted
    for p in side.parameters:
        true = f"true {truth[p.name]:10.5g}" if p.name in truth else ""
        error = f"± {p.stderr:8.2g}" if p.stderr is not None else "no error  "
        print(f"{p.symbol:5} = {p.value:10.5g} {error} {p.unit:8} {true}")


print(f"nominal model: χ²/N = {before.chi2_reduced:.2f}, on the held-back record {unseen(before):.2f}")
table(before)

# %% [markdown]
# ## Where
# What is missing, as a free form over the coordinate that explains it best: piecewise linear, each point a knot with its error, estimated
# beside all parameters and the sizes of all errors.

# %%
location = diagnosis.location
print(location.sentence)
profile = location.profiles[0]
figure, axes = plt.subplots(figsize=(6.2, 2.8), layout="constrained")
axes.errorbar(profile.center, profile.mean, profile.stderr, fmt="o", ms=4, color=SCREEN.nominal, ecolor=SCREEN.nominal, lw=1)
axes.axhline(0.0, color="#606060", lw=0.8)
quantity = "missing force (N)" if profile.quantity == "force" else f"error of {profile.quantity} (σ)"
_ = axes.set(xlabel=f"{profile.coordinate} ({profile.unit})", ylabel=quantity)

# %% [markdown]
# ## What
# All listed effects were scored along the motion; the best were weighed with the sizes of force and reading errors estimated anew, and the
# very best fitted. By their evidence:

# %%
print(f"verdict: {diagnosis.verdict}")
for one in diagnosis.effects:
    numbers = ", ".join(f"{p.symbol} = {p.value:.4g} ± {p.stderr:.1g} {p.unit}" for p in one.parameters if p.stderr is not None)
    print(f"  {one.effect.name}, probability {one.probability:.3f}: {numbers}")
print(f"as good with these records: {', '.join(diagnosis.ambiguous_with) or 'no other'}\n")
tried = sorted((one for one in diagnosis.considered if one.bic is not None), key=lambda one: one.bic)
for one in tried[:6]:
    print(f"{one.name:24} 2 ln L gains {one.drop:10.1f}   BIC above the best by {one.bic:10.1f}")

# %% [markdown]
# ## Then the cure
# The same records, the effect added and everything fitted again. The parameters return to what they are.

# %%
print(f"with the effect: χ²/N = {after.chi2_reduced:.2f}, on the held-back record {unseen(after):.2f}")
table(after)

# %% [markdown]
# ## On the record that no fit has seen
# Residuals of the hammer's acceleration on the held-back record, before and after, in standard deviations of the sensor.

# %%
CHANNEL = "hammer_acceleration"
figure, rows = plt.subplots(3, 1, figsize=(7.2, 4.6), sharex=True, layout="constrained", height_ratios=(1.3, 1, 1))
old, new = before.held_back[0], after.held_back[0]
rows[0].plot(old.time, old.measured[CHANNEL], color=SCREEN.measured, lw=0.8, label="measured")
rows[0].set_ylabel("x'' (m/s²)")
rows[0].legend(loc="upper right")
reach = 1.1 * np.nanmax(np.abs(old.measured[CHANNEL] - old.predicted[CHANNEL])) / old.noise[CHANNEL]
for axes, record, colour, name in ((rows[1], old, SCREEN.model, "before"), (rows[2], new, SCREEN.nominal, "after")):
    residual = (record.measured[CHANNEL] - record.predicted[CHANNEL]) / record.noise[CHANNEL]
    axes.axhspan(-2, 2, color="#e4e4e4", lw=0)
    axes.plot(record.time, residual, color=colour, lw=0.7)
    axes.set(ylabel=f"{name} (σ)", ylim=(-reach, reach))
_ = rows[2].set_xlabel("time (s)")

# %% [markdown]
# ## What was concealed

# %%
concealed = case.order.effects[0][0]
true_force = case.hidden.motion["friction_force"]
found = {p.name: p for one in diagnosis.effects for p in one.parameters}
print(f"{concealed}: {true_force:.4g} N; found {found['friction_force'].value:.4g} ± {found['friction_force'].stderr:.1g} N")

# %% [markdown]
# ## What was claimed

# %%
zeta_before, zeta_after = (next(p for p in side.parameters if p.name == "zeta") for side in (before, after))
assert diagnosis.verdict == "missing"
assert concealed in [one.effect.name for one in diagnosis.effects]
assert before.chi2_reduced > 1.2 and after.chi2_reduced < 1.05
assert zeta_before.value - case.rig.zeta > max(0.4 * case.rig.zeta, 8 * zeta_before.stderr)
assert abs(zeta_after.value - case.rig.zeta) < 4 * zeta_after.stderr
assert unseen(before) > 1.2 and unseen(after) < 1.1
assert abs(found["friction_force"].value - true_force) < 4 * found["friction_force"].stderr
