"""What the experiment file says about the rig itself."""

from dataclasses import dataclass


@dataclass(frozen=True, kw_only=True)
class Suspension:
    """How the hammer hangs on the cart.

    Attributes:
        kind: "linear" (spring and damper), "pendulum" (wires, full geometry), "pivot" (bearing, any angle) or "free" (neither of them).
        length: of the pendulum, or radius at which the displacement of a pivot is measured, m, above 0; None for the other kinds.
    """

    kind: str
    length: float | None = None


@dataclass(frozen=True, kw_only=True)
class Load:
    """Constant forces on the hammer that the operator knows; positive towards the stop.

    Attributes:
        incline: angle of the rail to the horizontal, rad; positive where the stop lies downhill.
        constant_force: N.
    """

    incline: float = 0.0
    constant_force: float = 0.0


@dataclass(frozen=True, kw_only=True)
class Prior:
    """Normal prior of a parameter: mean and standard deviation in the parameter's own unit."""

    mean: float
    std: float


@dataclass(frozen=True, kw_only=True)
class ParameterOption:
    """What the operator wants of one parameter of the fit; numbers are in the parameter's own unit.

    Attributes:
        start: first guess; None leaves the choice to the fit.
        fixed: True keeps the parameter at `start`.
        bounds: lowest and highest value of the fit; None for the usual range.
        prior: what is known of it beside these records; None for nothing.
        varies: True gives every record a value of its own, about a common mean; how much they differ is estimated.
    """

    start: float | None = None
    fixed: bool = False
    bounds: tuple[float, float] | None = None
    prior: Prior | None = None
    varies: bool = False
