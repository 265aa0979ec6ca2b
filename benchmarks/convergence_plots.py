"""The figures of `benchmarks.convergence`."""

from pathlib import Path
from typing import Any

import matplotlib
import numpy as np
from matplotlib.figure import Figure

from benchmarks.convergence_studies import Curve, Diagram

_COLOURS = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#000000")
_MARKERS = "os^Dv"
"""Okabe and Ito's colours, told apart by every common form of colour vision."""
_SYMBOLS = {"k_i": "$k_i$", "n": "$n$", "λ_i": r"$\lambda_i$", "ζ": r"$\zeta$", "ω_n": r"$\omega_n$"}
_STYLE: dict[Any, Any] = {
    "font.size": 9,
    "axes.grid": True,
    "grid.alpha": 0.25,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "legend.frameon": False,
}


def errors(curves: list[Curve], path: Path, quantity: str) -> None:
    """Error against smoothing width on logarithmic axes, with the fitted power laws."""
    with matplotlib.rc_context(_STYLE):
        figure = Figure(figsize=(5.2, 3.8), layout="constrained")
        axes = figure.subplots()
        for curve, colour, marker in zip(curves, _COLOURS, _MARKERS, strict=False):
            axes.loglog(
                curve.widths,
                curve.errors,
                marker,
                color=colour,
                ms=4,
                mfc="none",
                label=f"{_SYMBOLS.get(curve.label, curve.label)}: slope {curve.slope:.2f}",
            )
            if curve.fit_widths:
                ends = np.array(curve.fit_widths)
                axes.loglog(ends, curve.factor * ends**curve.slope, "-", color=colour, lw=1)
        lowest = min(curve.errors.min() for curve in curves)
        axes.set(xlabel="smoothing width ε (m)", ylabel=quantity, ylim=(lowest / 3, 1e3 * max(curve.errors.max() for curve in curves)))
        axes.legend(loc="upper left")
        figure.savefig(path, dpi=200)


def bifurcations(diagram: Diagram, path: Path) -> None:
    """The diagram of the switch model, and of each width below it."""
    panels = {"discontinuous law": diagram.reference}
    panels |= {f"ε = {1e6 * width:.0f} µm": points for width, points in sorted(diagram.smoothed.items())}
    with matplotlib.rc_context(_STYLE):
        figure = Figure(figsize=(5.6, 1.25 * len(panels) + 0.5), layout="constrained")
        rows = figure.subplots(len(panels), sharex=True, sharey=True)
        for axes, (label, points), colour in zip(rows, panels.items(), ["#000000"] + [_COLOURS[0]] * len(panels), strict=False):
            x = np.repeat(diagram.frequencies, points.shape[1])
            axes.plot(x, points.ravel(), ".", color=colour, ms=2, mew=0, rasterized=True)
            axes.set_title(label, loc="left", fontsize=9, pad=2)
        rows[-1].set_xlabel("excitation frequency Ω/2π (Hz)")
        figure.supylabel("relative velocity u′ once a cycle (mm/s)", fontsize=9)
        figure.savefig(path, dpi=200)
