"""Consistency of each gap with the recorded motion, checked before any fit."""

import numpy as np

from identification.experiment import Experiment, ExperimentError
from identification.windows.kinematics import relative_displacement
from vibrojax.contact import AbstractContactLaw, NoContact

_STRIKING = ("drop-test", "cart-excitation")
"""Kinds of record in which the hammer comes from free flight."""
_FAR = 10.0
"""Largest plausible indentation over the hammer's own travel."""
_FAR_M = 0.01
"""The same, m: ten times an error of setting the gap that is already large."""


def check_clearance(experiment: Experiment, law: AbstractContactLaw) -> None:
    """Check every gap against the recorded motion, in held-back records too.

    A displacement with an unknown zero does not identify its gap and is not checked.

    Raises:
        ExperimentError: from first to last sample the hammer is far beyond the stated position of the stop.
    """
    offset = any(sensor.zero is not None for channel, sensor in experiment.sensors.items() if channel.endswith("displacement"))
    if offset or isinstance(law, NoContact):
        return
    for record in experiment.records:
        u = relative_displacement(record)
        if record.kind in _STRIKING and u is not None and u.min() - record.gap > max(_FAR * np.ptp(u), _FAR_M):
            raise ExperimentError(
                f"gap of record {record.file!r} is {record.gap:g} m, and its hammer stays between {u.min():.4g} m and {u.max():.4g} m:"
                " expected that it leaves the stop; check sign and unit of the gap, or, for a sensor with an offset, set its zero"
            )
