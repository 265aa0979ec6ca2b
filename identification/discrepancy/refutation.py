"""What lowers the misfit where it was fitted, and raises the error where it was not, is no explanation."""

from identification.discrepancy.diagnosis import Side
from identification.discrepancy.explanation import Explanation


def refutation(cause: Explanation, before: Side, after: Side) -> str:
    """Why an explanation that leaves more than noise is dropped: the nominal model predicts unseen records better. Empty where it stands.

    Args:
        cause: with its learned term or its effects.
        before: the nominal model.
        after: with what was found.
    """
    if not after.held_out_nrmse > before.held_out_nrmse:
        return ""
    what = f"a learned term, {cause.formula}," if cause.formula else " and ".join(cause.fitted.names)
    return (
        f"{what} would lower the misfit, but raise the error on what was not fitted from {before.held_out_nrmse:.2g} to"
        f" {after.held_out_nrmse:.2g} of the standard deviation, and is left out"
    )
