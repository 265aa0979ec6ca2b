"""The figures of `benchmarks.convergence`."""

from pathlib import Path

import numpy as np

from benchmarks.convergence_studies import Curve, Diagram
from vibrojax.drawing import BLUE, COLOURS, new_figure, save, style

_MARKERS = "os^Dv"
_SYMBOLS = {"k_i": "$k_i$", "n": "$n$", "λ_i": r"$\lambda_i$", "ζ": r"$\zeta$", "ω_n": r"$\omega_n$"}


def errors(curves: list[Curve], path: Path, quantity: str) -> None:
    """Error against smoothing width on logarithmic axes, with the fitted power laws."""
    with style():
        figure = new_figure(3.8, 5.2, layout="constrained")
        axes = figure.subplots()
        for curve, colour, marker in zip(curves, COLOURS, _MARKERS, strict=False):
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
        save(figure, path)


def bifurcations(diagram: Diagram, path: Path) -> None:
    """The diagram of the switch model, and of each width below it."""
    panels = {"discontinuous law": diagram.reference}
    panels |= {f"ε = {1e6 * width:.0f} µm": points for width, points in sorted(diagram.smoothed.items())}
    with style():
        figure = new_figure(1.25 * len(panels) + 0.5, 5.6, layout="constrained")
        rows = figure.subplots(len(panels), sharex=True, sharey=True)
        for axes, (label, points), colour in zip(rows, panels.items(), ["#000000"] + [BLUE] * len(panels), strict=False):
            x = np.repeat(diagram.frequencies, points.shape[1])
            axes.plot(x, points.ravel(), ".", color=colour, ms=2, mew=0, rasterized=True)
            axes.set_title(label, loc="left", fontsize=9, pad=2)
        rows[-1].set_xlabel("excitation frequency Ω/2π (Hz)")
        figure.supylabel("relative velocity u′ once a cycle (mm/s)", fontsize=9)
        save(figure, path)
