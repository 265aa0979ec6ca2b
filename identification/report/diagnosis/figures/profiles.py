"""What is missing against the coordinates that might decide it: the best one large, the others small."""

from collections.abc import Iterator

import numpy as np
from matplotlib.axes import Axes

from identification.diagnosis.diagnosis import Diagnosis, Location, Profile
from identification.report.diagnosis.model_force import model_force
from identification.report.diagnosis.words import axis, quantity, quantity_unit
from identification.report.figures.base import Picture
from identification.report.page_style import PageStyle
from identification.wording.numbers import joined
from vibrojax.drawing import few_ticks, new_figure

_OTHERS = 6
_IN_PHASE: dict[str, dict[str, str]] = {
    "free flight": {"displacement": "u", "velocity": "v", "indentation": "indentation"},
    "all": {"displacement": "u", "velocity": "v", "indentation": "indentation"},
    "separation": {"indentation": "indentation"},
}
"""By phase of the motion the coordinates, as `Force` has them, against which its mean in flight can be set beside the profile."""
_LITTLE = 0.15
"""Share of the misfit below which the mean explains little."""
_UNEVEN = " That is little: its size, more than its mean, follows this coordinate."

_SOMETHING = 0.005
"""Share from which on a coordinate is worth a picture."""
_FEWEST = 5
"""Samples in a bin for the model's force to be drawn there."""


def best_profile(diagnosis: Diagnosis, style: PageStyle) -> Iterator[Picture]:
    """One picture: what is missing against its best coordinate, with the force that the augmented model puts in its place."""
    where = diagnosis.location
    if where is None or not where.profiles:
        return
    best = where.profiles[0]
    if best.coordinate == "time" and where.interval is None and not best.explained >= _SOMETHING:
        return
    figure = new_figure(3.3)
    axes = figure.subplots(gridspec_kw={"left": 0.115, "right": 0.985, "bottom": 0.14, "top": 0.96})
    factor = axis(best.coordinate, best.unit).factor
    if where.interval is not None and best.coordinate == where.coordinate:
        low, high = factor * np.clip(where.interval, best.center.min(), best.center.max())
        axes.axvspan(low, high, color=style.contact, linewidth=0, label="where most of it is")
    _draw(axes, best, style, marks=True)
    model = _model_line(diagnosis, best)
    if model is not None:
        axes.plot(factor * best.center, model, color=style.augmented.colour, linewidth=1.4, label="what the augmented model adds")
    axes.set_ylabel(_label(best))
    few_ticks(axes, x=8, y=6)
    axes.margins(x=0.02)
    axes.legend(loc="best")
    sign = " Above zero it pushes the hammer towards the stop." if best.quantity == "force" else ""
    yield Picture(
        name="missing",
        section="location",
        record=None,
        caption=f"What the nominal model leaves out, against {best.coordinate}: mean in each bin with a band of ±2 standard errors."
        f" {_share(best)} of the excess misfit follows this line.{sign}{_UNEVEN if best.explained < _LITTLE else ''}{_nothing(where)}",
        alt=f"{quantity(best.quantity).capitalize()} against {best.coordinate}, from {_ends(best)}.",
        figure=figure,
    )


def other_profiles(diagnosis: Diagnosis, style: PageStyle) -> Iterator[Picture]:
    """One picture: the same against the other coordinates."""
    where = diagnosis.location
    others = [one for one in where.profiles[1:] if one.explained >= _SOMETHING][:_OTHERS] if where is not None else []
    if not others:
        return
    columns = min(len(others), 2)
    rows = -(-len(others) // columns)
    height = 0.3 + rows * 1.75
    figure = new_figure(height)
    places = {"left": 0.115, "right": 0.985, "bottom": 0.45 / height, "top": 1 - 0.25 / height, "hspace": 0.62, "wspace": 0.27}
    grid = figure.subplots(rows, columns, squeeze=False, gridspec_kw=places)
    for panel, profile in zip(grid.ravel(), others, strict=False):
        _draw(panel, profile, style, marks=False)
        panel.set_title(f"explains {_share(profile)}", loc="left", pad=3, fontsize=8)
        panel.set_ylabel("F (N)" if profile.quantity == "force" else "r (σ)")
        panel.margins(x=0.02)
        few_ticks(panel, x=5, y=4)
    for panel in grid.ravel()[len(others) :]:
        panel.set_axis_off()
    yield Picture(
        name="missing-others",
        section="location",
        record=None,
        caption="The same against other coordinates, with bands of ±2 standard errors and the share of the excess misfit that follows."
        " A coordinate that does not decide what is missing shows a flat line, or the shadow of one that does.",
        alt="What is missing against " + ", ".join(f"{p.coordinate} (explains {_share(p)})" for p in others) + ".",
        figure=figure,
    )


def _draw(axes: Axes, profile: Profile, style: PageStyle, *, marks: bool) -> None:
    look = axis(profile.coordinate, profile.unit)
    x = look.factor * profile.center
    axes.axhline(0.0, color="black", linewidth=0.6)
    axes.fill_between(x, profile.mean - 2 * profile.stderr, profile.mean + 2 * profile.stderr, color=style.nominal_band, linewidth=0)
    mark = {"marker": "o", "markersize": 3.0} if marks else {}
    axes.plot(x, profile.mean, color=style.nominal.colour, linewidth=1.0, label="missing from the nominal model", **mark)
    axes.set_xlabel(look.label)


def _model_line(diagnosis: Diagnosis, profile: Profile) -> np.ndarray | None:
    """Mean of what the augmented model pushes with beyond the nominal one, in the profile's bins; NaN in bins without flight."""
    phase = diagnosis.location.phase if diagnosis.location is not None else ""
    coordinates = _IN_PHASE.get(phase, {})
    if profile.quantity != "force" or profile.coordinate not in coordinates or len(profile.center) < 2:
        return None
    force = model_force(diagnosis)
    if force is None:
        return None
    shown = force.v < 0 if phase == "separation" else np.ones(len(force.v), bool)
    across, difference = getattr(force, coordinates[profile.coordinate])[shown], force.difference[shown]
    middles = 0.5 * (profile.center[1:] + profile.center[:-1])
    ends = (1.5 * profile.center[0] - 0.5 * profile.center[1], 1.5 * profile.center[-1] - 0.5 * profile.center[-2])
    edges = np.concatenate([ends[:1], middles, ends[1:]])
    counts = np.histogram(across, edges)[0]
    sums = np.histogram(across, edges, weights=difference)[0]
    return np.where(counts >= _FEWEST, sums / np.maximum(counts, 1), np.nan)


def _nothing(where: Location) -> str:
    """The coordinates that explain nothing."""
    names = [one.coordinate for one in where.profiles[1:] if not one.explained >= _SOMETHING]
    return f" Nothing of it follows {joined(names)} alone." if names else ""


def _label(profile: Profile) -> str:
    return f"{quantity(profile.quantity)} ({quantity_unit(profile.quantity)})"


def _share(profile: Profile) -> str:
    return f"{100 * min(max(profile.explained, 0.0), 1.0):.0f} %" if np.isfinite(profile.explained) else "an unknown share"


def _ends(profile: Profile) -> str:
    usable = profile.mean[np.isfinite(profile.mean)]
    return f"{usable.min():.3g} to {usable.max():.3g}" if len(usable) else "nowhere"
