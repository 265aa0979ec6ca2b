"""What lowers the misfit where it was fitted, and raises the error where it was not, is no explanation."""

import math

from identification.discrepancy.diagnosis import Side
from identification.discrepancy.explanation import Explanation

_BEYOND_ROUNDING = 1.02
"""Rise of the error that the way it is estimated may bring about."""


def refutation(cause: Explanation, before: Side, after: Side) -> str:
    """Why an explanation that leaves more than noise is dropped: the nominal model predicts unseen records better. Empty where it stands.

    Args:
        cause: with its learned term or its effects.
        before: the nominal model.
        after: with what was found.
    """
    if math.isnan(before.held_out_nrmse) or after.held_out_nrmse <= _BEYOND_ROUNDING * before.held_out_nrmse:
        return ""
    what = f"a learned term, {cause.formula}," if cause.formula else " and ".join(cause.fitted.names)
    return (
        f"{what} would lower the misfit, but raise the error on what was not fitted from {before.held_out_nrmse:.2g} to"
        f" {after.held_out_nrmse:.2g} of the standard deviation, and is left out"
    )
