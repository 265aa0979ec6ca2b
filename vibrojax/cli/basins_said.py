"""Attractors as a table."""

import json
import math
from typing import Any

from rich.console import Console
from rich.table import Table

_MOST = 12
"""Rows of the table."""
_MEASURES = {
    "basin_entropy": "basin entropy S_b",
    "boundary_basin_entropy": "boundary basin entropy S_bb",
    "uncertainty_exponent": "uncertainty exponent",
    "boundary_dimension": "dimension of the boundary",
}


def say_attractors(console: Console, data: Any) -> None:
    """The attractors and the measures of their basins; nothing for other studies."""
    if "attractors" in data.attrs and "share" not in data:
        console.print(_table(json.loads(data.attrs["attractors"])))
        known = [f"{text} {data.attrs[name]:.3g}" for name, text in _MEASURES.items() if math.isfinite(data.attrs.get(name, math.nan))]
        if known:
            console.print(", ".join(known), soft_wrap=True)


def _table(rows: list[dict[str, Any]]) -> Table:
    """One row an attractor."""
    from vibrojax.studies.finding import bears

    table = Table("attractor", "share (95 %)", "section u (mm), u' (m/s)", "bears at the strobe", "largest disc (mm)", "exponent")
    for one in rows[:_MOST]:
        low, high = one["share_ci95"]
        u, v = one["section"]["u"][0], one["section"]["v"][0]
        place = f"{1e3 * u:.4g}, {v:.4g}" if one["period"] else ""
        room, growth = one.get("integrity"), one["lyapunov"]
        table.add_row(
            one["name"],
            f"{100 * one['share']:.2f} % ({100 * low:.2f} to {100 * high:.2f})",
            place,
            "" if room is None else bears(one) or "outside the ranges",
            "" if room is None else f"{1e3 * room['largest_disc']:.3g}",
            "" if growth is None else f"{growth:.3g}",
        )
    return table
