# %% [markdown]
# # A hammer for a drill, under what a fit does not know
#
# A drilling rig shakes an embedded hammer against the bit. Which mass should the hammer have? The answer is a curve: largest force
# against the mass ratio, for several excitation frequencies. But the stop's law comes from a fit, and a fit has errors. The question is
# then: is the best mass still the best for every law that the records leave possible?

# %%
import dataclasses
import os
import tempfile
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np

from vibrojax.cli.environment import prepare_jax

prepare_jax()

from benchmarks.simulator import RecordPlan, Rig, standard_sensors, write_experiment
from identification.estimation.estimate import fit_experiment
from identification.experiment import load_experiment
from identification.report.base import SCREEN
from vibrojax.batch import Span
from vibrojax.drawing import STYLE
from vibrojax.presets import read_preset
from vibrojax.studies import hammer_design

SMALL = os.environ.get("VIBROJAX_NOTEBOOKS") == "small"
plt.rcParams.update(STYLE)

# %% [markdown]
# ## The rig as far as it is known
# Mass and excitation are stated in the thesis, the rest is assumed: the curves below show the method, not that rig.

# %%
preset = read_preset("drilling_hammer")
for name, number in preset.numbers.items():
    print(f"{name:22} {number.value:10.4g} {number.unit:6} {number.origin.value}")

# %% [markdown]
# ## A test of the stop
# The hammer is dropped against the bit twice, with a displacement sensor only: cheap, and not very telling. The records are simulated
# with the preset's numbers, by a simulator that shares no code with the program.

# %%
TRUE = preset.model()
RIG = Rig(
    m=preset["mass"],
    f_n=preset["natural_frequency_hz"],
    zeta=preset["damping_ratio"],
    k_i=preset["impact_stiffness"],
    n=preset["impact_exponent"],
    lambda_i=preset["impact_damping"],
    base_amplitude=preset["base_amplitude"],
)
DROPS = [
    RecordPlan(file=f"drop{i}.csv", kind="drop-test", gap=0.0, true_gap=0.0, samples=4001, release=release)
    for i, release in ((1, -20e-3), (2, -45e-3))
]
NOISY = [dataclasses.replace(sensor, noise=3e-5) for sensor in standard_sensors(force=False, acceleration=False)]
with tempfile.TemporaryDirectory() as folder:
    write_experiment(Path(folder), RIG, tuple(DROPS), tuple(NOISY), np.random.default_rng(3), truth=None)
    experiment = load_experiment(folder)

# %%
result = fit_experiment(experiment)
for p in result.parameters:
    print(f"{p.spec.symbol:4} = {p.value:10.4g} ± {p.stderr or np.nan:8.2g} {p.spec.unit:8} {p.status}")
print("correlation of", ", ".join(result.correlated))
print(np.round(result.correlation, 2))

# %% [markdown]
# ## Laws that the records leave possible
# Draws from the fit's normal distribution, in the coordinates in which it is one (logarithms, but for $n$). Stiffness and exponent move
# together: drawn one by one they would make stops that the records have ruled out.


# %%
def draws(result, count, seed):
    """Models drawn from the fit: value, error and correlation of every identified parameter."""
    known = {p.spec.name: p for p in result.parameters if p.stderr is not None}
    chosen = [known[name].spec for name in result.correlated]
    centre = np.array([spec.to_internal(known[spec.name].value) for spec in chosen])
    sigma = np.array([known[spec.name].stderr / spec.slope(known[spec.name].value) for spec in chosen])
    points = np.random.default_rng(seed).multivariate_normal(centre, result.correlation * np.outer(sigma, sigma), size=count)
    return [result.model.replace({spec.name: spec.to_physical(x) for spec, x in zip(chosen, point, strict=True)}) for point in points]


models = draws(result, 4 if SMALL else 32, seed=5)
depth = np.linspace(0.0, 1.2e-3, 60)
figure, axes = plt.subplots(figsize=(5.2, 2.8), layout="constrained")
for model in models:
    axes.plot(
        1e3 * depth,
        1e-3 * float(model.law.impact_stiffness) * depth ** float(model.law.impact_exponent),
        color=SCREEN.series[0],
        lw=0.6,
        alpha=0.6,
    )
axes.plot(1e3 * depth, 1e-3 * RIG.k_i * depth**RIG.n, "--", color="#000000", label="the true stop")
axes.set(xlabel="indentation δ (mm)", ylabel="elastic force $k_i δ^n$ (kN)")
_ = axes.legend()

# %% [markdown]
# ## Force against the mass
# Spring, damper and stop stay, the mass changes: $r = m/m_0$. Every draw gives a curve; the band holds nine of ten.

# %%
OMEGAS = [4.0, 4.8, 5.6]
ratio = np.linspace(0.6, 1.6, 5 if SMALL else 41)
SETTINGS = dict(mass_ratio=ratio, frequency_hz=OMEGAS, gap=0.0, base_amplitude=preset["base_amplitude"], span=Span(transient=150))
forces = np.stack([hammer_design(model, **SETTINGS)["impact_force"].values for model in models])
true = hammer_design(TRUE, **SETTINGS)["impact_force"].values
low, middle, high = np.quantile(forces, (0.05, 0.5, 0.95), axis=0)

figure, axes = plt.subplots(figsize=(6.6, 3.4), layout="constrained")
for row, (omega, colour) in enumerate(zip(OMEGAS, SCREEN.series, strict=False)):
    axes.fill_between(ratio, 1e-3 * low[row], 1e-3 * high[row], color=colour, alpha=0.25, lw=0)
    axes.plot(ratio, 1e-3 * middle[row], color=colour, label=f"{omega:g} Hz")
    axes.plot(ratio, 1e-3 * true[row], ":", color="#000000", label="the true stop" if row == 0 else None)
axes.set(xlabel="mass ratio r = m/m₀", ylabel="largest impact force F_i (kN)")
_ = axes.legend()

# %% [markdown]
# ## Which mass
# For every draw its own best mass. Where all draws agree, the decision is made; the height of the force is less certain than its place.

# %%
row = OMEGAS.index(4.8)
best = ratio[forces[:, row].argmax(axis=1)]
chosen = float(np.median(best))
loss = 1.0 - forces[:, row, np.argmin(np.abs(ratio - chosen))] / forces[:, row].max(axis=1)
width = (high[row] - low[row]) / middle[row]
print(f"at 4.8 Hz: best mass ratio {chosen:.2f}, over the draws {best.min():.2f} to {best.max():.2f}")
print(f"choosing it costs at most {100 * loss.max():.1f} % of the force that a draw could give")
print(f"the force itself is known to {100 * np.median(width):.1f} % (width of the band)")

# %% [markdown]
# ## What was claimed

# %%
stiffness, exponent = (result.correlated.index(name) for name in ("k_i", "n"))
assert result.converged and result.chi2_reduced < 1.1
assert abs(result.correlation[stiffness, exponent]) > 0.9
assert all(abs(p.value - getattr(RIG, p.spec.name)) < 4 * p.stderr for p in result.parameters if p.stderr is not None)
assert np.all(forces > 0)
assert loss.max() < max(0.05, 2 * np.median(width)), "the mass that is best for the median is good for every draw"
