"""What every suspension is.

To add one: write a file with a final subclass of `AbstractSuspension` that gives `name` and `parameters` and implements `acceleration`,
then list it in `vibrojax/suspension/__init__.py`.
"""

import abc

import equinox as eqx

from vibrojax.parameters import Parameter
from vibrojax.shapes import Scalars

DAMPING_RATIO = Parameter(
    name="zeta", field="damping_ratio", symbol="ζ", unit="1", start=0.02, lower=1e-7, upper=2.0, meaning="damping ratio"
)
NATURAL_FREQUENCY = Parameter(
    name="f_n", field="natural_frequency_hz", symbol="f_n", unit="Hz", start=3.0, lower=1e-3, upper=1e4, meaning="natural frequency"
)


class AbstractSuspension(eqx.Module):
    """What holds the hammer in the cart while it is away from the stop."""

    name: eqx.AbstractClassVar[str]
    parameters: eqx.AbstractClassVar[tuple[Parameter, ...]]

    @abc.abstractmethod
    def acceleration(self, u: Scalars, v: Scalars, drive: Scalars) -> Scalars:
        """Relative acceleration u'', m/s^2.

        Arguments:
            u: displacement of the hammer relative to the cart, m.
            v: its velocity, m/s.
            drive: everything else that acts on the hammer, per mass, in the cart's frame: -y'' + (applied - contact force) / m, m/s^2.
        """
