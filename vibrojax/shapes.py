"""Shapes in words that the models share."""

from jaxtyping import Array, Float

Scalars = Float[Array, "..."]
"""An array of any shape, one number a lane."""
Number = float | Float[Array, "..."]
"""An argument that broadcasts against `Scalars`."""
Value = float | Float[Array, "*batch"]
"""A parameter held by a model: a number, or one number a lane when many models are carried side by side; all arrays of one model have the
same lanes."""
