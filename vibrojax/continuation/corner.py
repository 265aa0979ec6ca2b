"""Past a grazing at which a branch has a corner."""

import dataclasses

import numpy as np

from vibrojax.continuation.arclength import Curve, Point
from vibrojax.errors import NoConvergenceError

_REACHES = 10.0 ** np.arange(-7.0, -1.5, 0.5)
_NEAR = 20.0


def around_corner(curve: Curve, last: Point) -> Point | None:
    """The first point of the other piece of a branch that breaks off at a grazing; None where there is none.

    With a rigid stop, or a force that jumps or bends at the touch, the map has another slope on either side of a grazing, and the two
    pieces of a branch may both lie on the same side of it in the parameter: steps along the tangent then find nothing. Here the slope is
    taken a little beyond the grazing, where the motion has one impact more or fewer, and the piece that belongs to it is looked for from
    there, in both senses.

    Source: ours; that the two pieces meet in a corner is the border collision of H. E. Nusse, E. Ott, J. A. Yorke, Border-collision
    bifurcations: an explanation for observed bifurcation phenomena, Phys. Rev. E 49 (1994) 1073-1076.
    """
    touches = int(last.passage.touches)
    for reach in _REACHES:
        try:
            tangent, beyond = curve.tangent_at(last.z + reach * last.tangent)
        except NoConvergenceError:
            continue
        if beyond == touches:
            continue
        for sense in (1.0, -1.0):
            try:
                new = curve.corrected(last.z + sense * reach * tangent, tangent)
            except NoConvergenceError:
                continue
            offset = new.z - last.z
            if abs(int(new.passage.touches) - touches) == 1 and 0.0 < np.linalg.norm(offset) < _NEAR * reach:
                return dataclasses.replace(new, tangent=new.tangent * (1.0 if new.tangent @ offset >= 0 else -1.0))
    return None
