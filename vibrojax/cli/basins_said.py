"""What `vibrojax basins` asks for and prints."""

import json
import math
from collections.abc import Mapping
from typing import Any

from rich.console import Console
from rich.table import Table

from vibrojax.errors import InputError

_OPTIONS = {"base_amplitude": "--base-amplitude", "gap": "--gap", "frequency_hz": "--frequency"}
_SPELLED = {"frequency": "frequency_hz", "amplitude": "base_amplitude"}
_MOST = 12
"""Rows of the table."""
_MEASURES = {
    "basin_entropy": "basin entropy S_b",
    "boundary_basin_entropy": "boundary basin entropy S_bb",
    "uncertainty_exponent": "uncertainty exponent",
    "boundary_dimension": "dimension of the boundary",
}


def named(along: str | None) -> tuple[str | None, str]:
    """Parameter and range of `--along`; none where it is left out.

    Raises:
        InputError: it is not `NAME=A:B:N`.

    Example:
        >>> named("frequency=3:9:300")
        ('frequency_hz', '3:9:300')
    """
    if along is None:
        return None, ""
    name, equals, text = along.partition("=")
    if not (name and equals and text):
        raise InputError(f"--along is {along!r}: expected NAME=A:B:N; write, for example, --along gap=1e-3:2e-3:10")
    return _SPELLED.get(name, name), text


def check_point(given: Mapping[str, float | None], along: str | None, *, fit: bool) -> dict[str, Any]:
    """Settings of the operating point, all but the one that the basins are followed along.

    Raises:
        InputError: one is missing, or given although it varies, or draws of a fit are to be followed.
    """
    if along is not None and fit:
        raise InputError("--along is given with --fit: expected one model, since attractors are matched along it; name its --model")
    if along is not None and given.get(along) is not None:
        raise InputError(f"{_OPTIONS[along]} is given beside --along {along}: expected one of the two; leave {_OPTIONS[along]} out")
    if missing := [name for name, value in given.items() if value is None and name != along]:
        option = _OPTIONS[missing[0]]
        raise InputError(f"{option} is missing: expected {' and '.join(_OPTIONS.values())}, but for what --along follows; add {option}")
    return {name: value for name, value in given.items() if value is not None}


def say_finding(console: Console, data: Any) -> None:
    """The attractors as a table, the measures of their basins, and the sentence; nothing for other studies."""
    if "attractors" in data.attrs and "share" not in data:
        console.print(_table(json.loads(data.attrs["attractors"])))
        known = [f"{text} {data.attrs[name]:.3g}" for name, text in _MEASURES.items() if math.isfinite(data.attrs.get(name, math.nan))]
        if known:
            console.print(", ".join(known), soft_wrap=True)
    if "finding" in data.attrs:
        console.print(data.attrs["finding"], soft_wrap=True, markup=False)


def _table(rows: list[dict[str, Any]]) -> Table:
    """One row an attractor."""
    from vibrojax.studies.basin_finding import bears

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
