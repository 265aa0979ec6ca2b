"""Parameter identification from records of the rig: `load_experiment`, `fit`, `diagnose`, `simulate`."""

import importlib
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from identification.experiment import load_experiment
    from identification.front_door import diagnose, fit, simulate

_ON_DEMAND = {name: "identification.front_door" for name in ("diagnose", "fit", "simulate")} | {
    "load_experiment": "identification.experiment"
}
"""Imported when first asked for: reading records needs no JAX."""


def __getattr__(name: str) -> Any:
    """Import a function when it is first asked for."""
    if name not in _ON_DEMAND:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(importlib.import_module(_ON_DEMAND[name]), name)


__all__ = ["diagnose", "fit", "load_experiment", "simulate"]


def __dir__() -> list[str]:
    return [*globals(), *__all__]
