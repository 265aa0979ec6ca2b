# %% [markdown]
# # A real recording, diagnosed
#
# The Silverbox is an electronic mass on a spring that hardens, recorded and published by others (T. Wigren, J. Schoukens, ECC 2013).
# Volts stand for metres and newtons. We pretend not to know about the spring, fit a linear oscillator, and ask what it leaves out.
#
# The recording is not part of this project. `vibrojax datasets` tells where it is to be had; `VIBROJAX_RECORDINGS` names the folder that
# holds it, else `shared/recordings` beside a checkout. Without it this notebook says so and does nothing else.

# %%
import dataclasses
import os
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np

import vibrojax
from vibrojax.cli.environment import prepare_jax

prepare_jax()

from identification.diagnosis.diagnose import diagnose_experiment
from identification.experiment import load_experiment
from identification.recipes.load import load_recipe, recipe_experiment
from identification.report.base import SCREEN
from vibrojax.drawing import STYLE

SMALL = os.environ.get("VIBROJAX_NOTEBOOKS") == "small"
plt.rcParams.update(STYLE)
BESIDE = Path(vibrojax.__file__).resolve().parents[2] / "shared" / "recordings"
RECORDINGS = Path(os.environ.get("VIBROJAX_RECORDINGS", BESIDE))
HERE = (RECORDINGS / "silverbox").is_dir()
if not HERE:
    print(
        "Skipped: the Silverbox recording is not here. Get it as `vibrojax datasets silverbox` says; set VIBROJAX_RECORDINGS to its folder."
    )

# %% [markdown]
# ## The records
# Stretches of the multisine are fitted. Held back is the loudest part of the arrow, whose amplitude exceeds all that is fitted.

# %%
FITTED, LENGTH = (1, 1024) if SMALL else (2, 3072)
AMONG = ("cubic_stiffness", "quadratic_drag") if SMALL else None  # what may be named; None: every listed effect


def part(record, begin, count):
    """So many samples of a record."""
    chosen = slice(begin, begin + count)
    return dataclasses.replace(
        record, time=record.time[chosen], channels={name: values[chosen] for name, values in record.channels.items()}
    )


experiment = None
if HERE:
    with recipe_experiment(load_recipe("silverbox"), RECORDINGS) as folder:
        whole = load_experiment(folder)
    multisine, arrow = whole.records[:FITTED], whole.records[-1]
    loud = part(arrow, len(arrow.time) - 2 * LENGTH, LENGTH)
    experiment = dataclasses.replace(whole, records=(*(part(record, 0, LENGTH) for record in multisine), loud))
    for record in experiment.records:
        x = record.channels["hammer_displacement"]
        print(f"{record.file:18} {len(record.time)} samples, up to {np.abs(x).max():.3f} V{', held back' if record.held_back else ''}")

# %% [markdown]
# ## First the failure, then the cause

# %%
if experiment:
    diagnosis = diagnose_experiment(experiment, among=AMONG, budget_minutes=60.0)
    before, after = diagnosis.nominal, diagnosis.augmented
    print(f"linear oscillator: χ²/N = {before.chi2_reduced:.1f}, error on the held-back record {100 * before.held_out_nrmse:.1f} %")
    print(f"verdict: {diagnosis.verdict}")
    print(diagnosis.location.sentence)
    for one in diagnosis.effects:
        print(f"{one.effect.name}:", ", ".join(f"{p.symbol} = {p.value:.4g} ± {p.stderr or np.nan:.1g} {p.unit}" for p in one.parameters))
    print(f"with it: χ²/N = {after.chi2_reduced:.2f}, error on the held-back record {100 * after.held_out_nrmse:.1f} %")

# %% [markdown]
# ## What was missing
# As a free form over the coordinate that explains it best.

# %%
if experiment:
    profile = diagnosis.location.profiles[0]
    figure, axes = plt.subplots(figsize=(6.2, 2.8), layout="constrained")
    axes.errorbar(profile.center, profile.mean, profile.stderr, fmt="o", ms=4, color=SCREEN.nominal, lw=1)
    axes.axhline(0.0, color="#606060", lw=0.8)
    volts = {"m": "V", "m/s": "V/s"}  # this oscillator's
    quantity = "missing force (V)" if profile.quantity == "force" else f"error of {profile.quantity} (σ)"
    axes.set(xlabel=f"{profile.coordinate} ({volts.get(profile.unit, profile.unit)})", ylabel=quantity)

# %% [markdown]
# ## On what no fit has seen

# %%
if experiment:
    figure, axes = plt.subplots(figsize=(7.2, 2.8), layout="constrained")
    for side, colour, name in ((before, SCREEN.model, "linear oscillator"), (after, SCREEN.nominal, "with what was found")):
        record = side.held_back[0]
        residual = record.measured["hammer_displacement"] - record.predicted["hammer_displacement"]
        axes.plot(record.time - record.time[0], 1e3 * residual, color=colour, lw=0.7, label=name)
    axes.set(xlabel="time (s)", ylabel="measured − predicted (mV)")
    axes.legend(ncols=2)

# %% [markdown]
# ## What was claimed

# %%
if experiment:
    assert diagnosis.verdict not in ("adequate", "restless")
    assert after.held_out_nrmse <= before.held_out_nrmse
