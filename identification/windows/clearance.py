"""Whether the hammer is ever clear of the stop: a slip in a gap is told before anything is fitted."""

import numpy as np

from identification.experiment import Experiment, ExperimentError
from identification.windows.kinematics import relative_displacement
from identification.windows.layout import GAP_PRIOR_STD
from vibrojax.contact import AbstractContactLaw, NoContact

_STRIKING = ("drop-test", "cart-excitation")
"""Kinds in which the hammer comes from free flight."""
_FAR = 10.0
"""Times its own travel, and times what a gap is known to (`GAP_PRIOR_STD`), that no hammer gets into a stop."""


def check_clearance(experiment: Experiment, law: AbstractContactLaw) -> None:
    """Compare every gap with the motion that was recorded, in records that are held back too.

    A displacement whose zero is to be estimated says nothing of its gap.

    Raises:
        ExperimentError: from first to last sample the hammer is far beyond where the stop is said to be.
    """
    offset = any(sensor.zero is not None for channel, sensor in experiment.sensors.items() if channel.endswith("displacement"))
    if offset or isinstance(law, NoContact):
        return
    for record in experiment.records:
        u = relative_displacement(record)
        if record.kind in _STRIKING and u is not None and u.min() - record.gap > _FAR * max(np.ptp(u), GAP_PRIOR_STD):
            raise ExperimentError(
                f"gap of record {record.file!r} is {record.gap:g} m, and its hammer stays between {u.min():.4g} m and {u.max():.4g} m:"
                " expected that it leaves the stop; check sign and unit of the gap, or, for a sensor with an offset, set its zero"
            )
