"""Which integrator a fit uses: that of the exact contact, or Diffrax on the smoothed one."""

from typing import Annotated

import typer

from vibrojax.errors import InputError

LANDING, SMOOTHED = "landing", "smoothed"
WIDTH = 1e-6
"""Width of the smoothed contact switch where none is given, m."""


def _known(name: str) -> str:
    if name not in (LANDING, SMOOTHED):
        raise typer.BadParameter(f"{name!r} is no integrator")
    return name


Integrator = Annotated[
    str,
    typer.Option(
        metavar=f"{LANDING}|{SMOOTHED}",
        help="Integrator of the fit: steps that land on every touch and release, or Diffrax on a smoothed contact law.",
        callback=_known,
    ),
]
Smoothing = Annotated[
    float | None,
    typer.Option(
        metavar="METRES", help=f"Width of the smoothed contact, m. Left out: {WIDTH:g}; with --integrator {SMOOTHED}.", show_default=False
    ),
]


def contact_width(integrator: str, smoothing: float | None) -> float | None:
    """Width of the contact switch, m; None for the exact contact.

    Raises:
        InputError: a width with an integrator that has none, or one that is no length.

    Example:
        >>> contact_width("smoothed", None)
        1e-06
    """
    if integrator == SMOOTHED:
        width = WIDTH if smoothing is None else smoothing
        if not 0.0 < width < float("inf"):
            raise InputError(f"--smoothing is {width:g} m: expected a length above 0, such as {WIDTH:g}")
        return width
    if smoothing is not None:
        raise InputError(f"--smoothing {smoothing:g} is given for the {integrator} integrator: expected --integrator {SMOOTHED} beside it")
    return None
