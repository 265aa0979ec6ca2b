"""Vibro-impact systems in JAX: a hammer on a suspension, a moving cart, a stop, and the contact law between them.

The names below are imported when first asked for; other laws, suspensions, excitations, effects and integrators are in the packages
`contact`, `suspension`, `excitation`, `effects` and `integrate`.
"""

import importlib
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from vibrojax.contact import HuntCrossley
    from vibrojax.excitation import Harmonic
    from vibrojax.integrate import Landing
    from vibrojax.model import Model
    from vibrojax.model_file import read_model, write_model
    from vibrojax.simulation import simulate
    from vibrojax.suspension import Linear

__version__ = "0.1.0"

_ON_DEMAND = {
    "Harmonic": "vibrojax.excitation",
    "HuntCrossley": "vibrojax.contact",
    "Landing": "vibrojax.integrate",
    "Linear": "vibrojax.suspension",
    "Model": "vibrojax.model",
    "read_model": "vibrojax.model_file",
    "simulate": "vibrojax.simulation",
    "write_model": "vibrojax.model_file",
}


def __getattr__(name: str) -> Any:
    """Import a name when it is first asked for: the package itself brings no JAX along."""
    if name not in _ON_DEMAND:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(importlib.import_module(_ON_DEMAND[name]), name)


__all__ = ["Harmonic", "HuntCrossley", "Landing", "Linear", "Model", "read_model", "simulate", "write_model"]


def __dir__() -> list[str]:
    return [*globals(), *__all__]
