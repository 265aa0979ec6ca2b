# %% [markdown]
# # From the smoothed law to the discontinuous one
#
# A gradient wants a smooth right-hand side; the stop's is not. The program offers both: the contact switch spread over a width
# $\varepsilon$ (`Smoothed`), and the discontinuous law with the switch model (`Switch`: sub-spaces, the hyper-surface $\delta = 0$, a
# narrow band $\eta$). Does the first tend to the second, how fast, and what does a width do that is too large?

# %%
import os

import matplotlib.pyplot as plt
import numpy as np

from vibrojax.cli.environment import prepare_jax

prepare_jax()

import jax
import jax.numpy as jnp

from benchmarks.convergence_studies import LAWS, Size, bifurcations, rig, trajectories
from identification.report.base import SCREEN
from vibrojax.contact import HuntCrossley, smoothed_force
from vibrojax.drawing import STYLE
from vibrojax.integrate import Smoothed, Switch

SMALL = os.environ.get("VIBROJAX_NOTEBOOKS") == "small"
plt.rcParams.update(STYLE)


def quietly(items, _):
    """No progress bar."""
    return items


# %% [markdown]
# ## The switch
# $F_\varepsilon = H_\varepsilon(\delta)\,F(R_\varepsilon(\delta), \dot\delta)$: $H_\varepsilon$ is a switch of width $\varepsilon$ and
# $R_\varepsilon$ its integral, so that flight further than $\varepsilon/2$ from the stop is exactly free. Here at touch, for a law whose
# force jumps.

# %%
law = LAWS["Kelvin–Voigt, force jumps"]
delta = jnp.linspace(-80e-6, 80e-6, 401)
rate = jnp.full_like(delta, 0.1)
figure, axes = plt.subplots(figsize=(6.2, 2.8), layout="constrained")
for width, colour in ((1e-4, SCREEN.series[1]), (3e-5, SCREEN.series[0]), (0.0, "#000000")):
    force = smoothed_force(law, delta, rate, rate, width)
    axes.plot(1e6 * delta, force, color=colour, label=f"ε = {1e6 * width:.0f} µm" if width else "discontinuous")
axes.set(xlabel="indentation δ (µm)", ylabel="force at dδ/dt = 0.1 m/s (N)")
_ = axes.legend()

# %% [markdown]
# ## One trajectory
# One second and six impacts of a driven hammer. A width of a millimetre, many times the indentation, moves it by a thousandth of its
# range; a tenth of that width by less than a millionth. Nothing in this picture warns of a width.

# %%
driven = rig(HuntCrossley(1e6, 1.5, 0.3))
ts, still = jnp.linspace(0.0, 1.0, 401), jnp.zeros(2)
truth = jax.jit(lambda system: Switch()(system, ts, still).u)(driven)
run = jax.jit(lambda system, width: Smoothed(width, rtol=1e-11, atol=1e-14)(system, ts, still).u)
figure, axes = plt.subplots(figsize=(6.2, 2.8), layout="constrained")
axes.plot(ts, 1e3 * truth, color="#000000", label="switch model")
for width, colour in ((1e-3, SCREEN.series[1]), (1e-4, SCREEN.series[0])):
    axes.plot(ts, 1e3 * run(driven, width), "--", color=colour, label=f"ε = {1e3 * width:g} mm")
axes.axhline(1.0, color="#606060", lw=0.6)
axes.set(xlabel="time (s)", ylabel="relative displacement u (mm)")
_ = axes.legend(ncols=3)

# %% [markdown]
# ## How fast
# The largest error of $u$ against $\varepsilon$. A restitution would not show it: a free impact is left exactly right at any width, only
# its duration changes, by an error of order $\varepsilon^{n+2}$. For a law whose force jumps at touch that is $\varepsilon^2$.

# %%
widths = np.geomspace(1e-5, 1e-3, 7) if SMALL else np.geomspace(3e-6, 1e-3, 11)
chosen = ["Hunt–Crossley, n = 1.5"] if SMALL else ["Hunt–Crossley, n = 1.5", "Hunt–Crossley, n = 2.5", "Kelvin–Voigt, force jumps"]
curves = trajectories({name: LAWS[name] for name in chosen}, widths, quietly)
figure, axes = plt.subplots(figsize=(6.2, 3.4), layout="constrained")
for curve, colour, marker in zip(curves, SCREEN.series, "os^", strict=False):
    axes.loglog(1e6 * curve.widths, curve.errors, marker, color=colour, ms=4, label=f"{curve.label}: slope {curve.slope:.2f}")
    ends = np.array(curve.fit_widths)
    axes.loglog(1e6 * ends, curve.factor * ends**curve.slope, color=colour)
axes.set(xlabel="smoothing width ε (µm)", ylabel="largest error of u over its range")
_ = axes.legend()
slopes = {curve.label: curve.slope for curve in curves}

# %% [markdown]
# ## One trajectory is not enough
# A bifurcation diagram across a grazing, of a stop so stiff that the largest indentation is about 14 µm. A width that looks harmless on
# one trajectory moves the chaotic band and draws branches that are not there (Elmegård and others found the same for an impacting beam,
# arXiv
# 1308.3647). Only widths below the indentation are safe.

# %%
if not SMALL:
    diagram = bifurcations(Size(frequencies=36, transient=5, kept=1, block=20, widths=(3e-4, 1e-4, 1e-5)), quietly)
    panels = {"discontinuous law": diagram.reference}
    panels |= {f"ε = {1e6 * width:.0f} µm": points for width, points in sorted(diagram.smoothed.items())}
    figure, rows = plt.subplots(len(panels), 1, figsize=(6.2, 5.2), sharex=True, sharey=True, layout="constrained")
    for axes, (name, points) in zip(rows, panels.items(), strict=True):
        x = np.repeat(diagram.frequencies, points.shape[1])
        axes.plot(x, points.ravel(), ".", color="#000000" if name[0] == "d" else SCREEN.series[0], ms=2, mew=0, rasterized=True)
        axes.set_title(name, loc="left", fontsize=8)
    rows[-1].set_xlabel("excitation frequency (Hz)")
    figure.supylabel("velocity u' once a cycle (mm/s)", fontsize=9)
    wrong = {row["smoothing"]: row["wrong_period"] for row in diagram.summary()["widths"]}
    for width, count in wrong.items():
        print(f"ε = {1e6 * width:4.0f} µm: another period than the discontinuous law at {count} of {len(diagram.frequencies)} frequencies")

# %% [markdown]
# ## What was claimed

# %%
error = {width: float(jnp.abs(run(driven, width) - truth).max() / jnp.ptp(truth)) for width in (1e-3, 1e-4)}
assert 5e-4 < error[1e-3] < 2e-3 and error[1e-4] < 1e-6
assert abs(slopes["Hunt–Crossley, n = 1.5"] - 3.5) < 0.3
if not SMALL:
    assert abs(slopes["Hunt–Crossley, n = 2.5"] - 4.5) < 0.4
    assert abs(slopes["Kelvin–Voigt, force jumps"] - 2.0) < 0.3
    assert wrong[3e-4] > wrong[1e-5], "wide smoothing invents or loses motions"
