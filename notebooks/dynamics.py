# %% [markdown]
# # A tour of the dynamics
#
# What can a hammer do in front of a stop? Five studies of one rig, each asking for what the one before left open: forces over frequency,
# the same swept up and down, a map of all motions, which start leads where, and the branch that no sweep can see.
#
# $m\ddot u + 2\zeta\omega m\dot u + m\omega^2 u = -m\ddot y - F_i$, $y = A_0 \sin\Omega t$, $F_i = k_i\,\delta^n (1 +
# \lambda_i\,\dot\delta)$ in contact.

# %%
import os

import matplotlib.pyplot as plt
import numpy as np

from vibrojax.cli.environment import prepare_jax

prepare_jax()

from vibrojax.batch import Span
from vibrojax.contact import HuntCrossley
from vibrojax.continuation import ForcedRig, Kind, find_orbit, follow, settle
from vibrojax.drawing import COLOURS
from vibrojax.model import Model
from vibrojax.studies import basins, bifurcation, frequency_response, peterka
from vibrojax.studies.figures import draw_basins, draw_peterka
from vibrojax.suspension import Linear

SMALL = os.environ.get("VIBROJAX_NOTEBOOKS") == "small"
plt.rcParams.update({"font.size": 9.0, "axes.spines.top": False, "axes.spines.right": False, "legend.frameon": False})

F_N, GAP, A0 = 5.0, 4.0e-3, 1.5e-3
MODEL = Model(
    mass=0.5,
    suspension=Linear(damping_ratio=0.03, natural_frequency_hz=F_N),
    law=HuntCrossley(impact_stiffness=1e6, impact_exponent=1.5, impact_damping=1.5),
)

# %% [markdown]
# ## Force over frequency
# The motion reached from rest, for three gaps. With the stop at the hammer the largest force comes near $\Omega = 2\omega$; with a gap
# there is no force at all until the hammer reaches the stop.

# %%
response = frequency_response(MODEL, frequency_hz=np.linspace(3.0, 14.0, 12 if SMALL else 111), gap=[0.0, 2.0e-3, GAP], base_amplitude=A0)
figure, axes = plt.subplots(figsize=(6.2, 3.0), layout="constrained")
for gap, colour in zip(response["gap"].values, COLOURS, strict=False):
    axes.plot(response["frequency_hz"], response["impact_force"].sel(gap=gap), color=colour, label=f"gap {1e3 * gap:g} mm")
axes.set(xlabel="excitation frequency (Hz)", ylabel="largest impact force (N)")
_ = axes.legend()

# %% [markdown]
# ## Up is not down
# The same along the largest gap, each frequency started from where the last one ended. Between the jumps two motions exist: one strikes,
# one does not.

# %%
STEP = 0.3 if SMALL else 0.1
frequencies = np.arange(5.0, 9.5 + STEP / 2, STEP)
sweep = bifurcation(MODEL, parameter="frequency_hz", values=frequencies, base_amplitude=A0, gap=GAP, span=Span(transient=118, recorded=16))
force = sweep["impact_force"].max("cycle")
strikes = (force > 0).values
both = frequencies[strikes[0] != strikes[1]]
print(f"with and without impacts from {both.min():.2f} to {both.max():.2f} Hz")

figure, axes = plt.subplots(figsize=(6.2, 3.0), layout="constrained")
axes.axvspan(both.min(), both.max(), color="#e4e4e4", lw=0, label="two motions")
for direction, colour, marker in (("up", COLOURS[0], "^"), ("down", COLOURS[1], "v")):
    axes.plot(frequencies, force.sel(direction=direction), marker, color=colour, ms=3, label=direction)
axes.set(xlabel="excitation frequency (Hz)", ylabel="largest impact force (N)")
_ = axes.legend()

# %% [markdown]
# ## All motions at once
# Peterka's map: $z = p/q$ is $p$ impacts in $q$ cycles, over frequency and clearance.

# %%
wide = (13, 7) if SMALL else (73, 41)
ratio, clearance = np.linspace(0.6, 4.2, wide[0]), np.linspace(0.0, 4.0, wide[1])
kinds = peterka(MODEL, ratio=ratio, clearance=clearance, base_amplitude=A0, lyapunov_cycles=0 if SMALL else 200)
draw_peterka(kinds)

# %% [markdown]
# ## Which start leads where
# In the middle of the band with two motions: initial states that keep striking, and those that calm down.

# %%
middle = float(both[both.size // 2])
count = 15 if SMALL else 51
plane = basins(
    MODEL,
    u0=np.linspace(-2 * GAP, GAP, count),
    v0=np.linspace(-0.5, 0.3, count),
    frequency_hz=middle,
    gap=GAP,
    base_amplitude=A0,
)
print(f"at {middle:.2f} Hz {100 * plane.attrs['basin_measure']:.0f} % of these states keep striking")
draw_basins(plane)

# %% [markdown]
# ## What no sweep can see
# The branch of the striking motion is followed as a curve. It turns back at a fold, goes on unstable, and meets the motion without
# impacts at a grazing: this unstable branch is what parts the two basins. The fold is where the sweep had to jump.

# %%
striking = np.argwhere(plane["impacting"].values == 1)
i, j = striking[len(striking) // 2]
rig = ForcedRig(MODEL, gap=GAP, base_amplitude=A0, frequency_hz=middle)
state, cycles = settle(rig, np.array([float(plane["u0"][j]), float(plane["v0"][i])]))
orbit = find_orbit(rig, state, cycles=cycles)
branch = follow(orbit, "frequency", (5.0, 9.5))
folds = [place.parameter for place in branch.special if place.kind in (Kind.FOLD, Kind.GRAZING_FOLD)]
for place in branch.special:
    print(f"{place.kind.value:18} at {place.parameter:.4f} Hz")

# %%
figure, axes = plt.subplots(figsize=(6.2, 3.2), layout="constrained")
stable = branch.stable
axes.plot(branch.parameter, np.where(stable, branch.peak_force, np.nan), color="#000000", lw=1.6, label="stable")
axes.plot(branch.parameter, np.where(stable, np.nan, branch.peak_force), "--", color="#000000", lw=1.0, label="unstable")
for direction, colour, marker in (("up", COLOURS[0], "^"), ("down", COLOURS[1], "v")):
    axes.plot(frequencies, force.sel(direction=direction), marker, color=colour, ms=2.5, alpha=0.7, label=f"sweep {direction}")
for place in branch.special:
    axes.plot(place.parameter, float(place.orbit.passage.peak_force), "o", color=COLOURS[2], ms=5)
axes.set(xlabel="excitation frequency (Hz)", ylabel="largest impact force (N)", xlim=(5.0, 9.5))
_ = axes.legend()

# %% [markdown]
# ## What was claimed

# %%
at_rest = response["impact_force"]
assert abs(float(at_rest.sel(gap=0.0).idxmax("frequency_hz")) - 2 * F_N) < 1.2
assert (at_rest.sel(gap=GAP) == 0).any()
assert both.size > 0
assert ((kinds["impacts"] == 1) & (kinds["period"] == 1)).any() and (kinds["kind"] == 0).any()
assert 0.02 < plane.attrs["basin_measure"] < 0.98
assert stable.any() and not stable.all()
last = frequencies[strikes[0]].max()
assert -STEP < max(folds) - last < 2 * STEP, "the upward sweep falls off the branch at its fold"
