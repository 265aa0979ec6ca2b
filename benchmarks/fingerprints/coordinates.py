"""What is drawn over what: from a record to the points of a picture."""

from collections.abc import Callable

import numpy as np

from benchmarks.fingerprints.run import BASE, Run

Points = tuple[np.ndarray, np.ndarray]
_MM = 1e3


def over_velocity(run: Run) -> Points:
    """Missing force over u'."""
    return run.v[run.flight], run.missing_force[run.flight]


def over_displacement(run: Run) -> Points:
    """Missing force over u, where the load cell in front is not touched."""
    free = run.indentation < 0
    return _MM * run.u[free], run.missing_force[free]


def over_time(run: Run) -> Points:
    """Missing force in flight over time."""
    return run.time[run.flight], run.missing_force[run.flight]


def after_impacts(channel: str, *, scale: float, window: tuple[float, float]) -> Callable[[Run], Points]:
    """Misfit of a channel over the time since each touch, ms."""

    def points(run: Run) -> Points:
        since, misfit = _since(run, window), scale * run.misfit(channel)
        return 1e3 * since[np.isfinite(since)], misfit[np.isfinite(since)]

    return points


def missing_force_after_impacts(run: Run) -> Points:
    """Missing force in flight over the time since each touch, ms."""
    since = _since(run, (0.0, 0.1))
    chosen = np.isfinite(since) & run.flight
    return 1e3 * since[chosen], run.missing_force[chosen]


def while_leaving(run: Run) -> Points:
    """Missing force over the distance to the stop, mm, on the way back."""
    chosen = run.flight & (run.v < 0) & (run.indentation > -1.2e-3)
    return -_MM * run.indentation[chosen], run.missing_force[chosen]


def over_indentation(run: Run) -> Points:
    """Missing force over the indentation, mm, in contact."""
    return _MM * run.indentation[run.in_contact], run.missing_force[run.in_contact]


def beyond_gap(run: Run) -> Points:
    """Missing force over u, mm, all samples."""
    return _MM * run.u, run.missing_force


def cart_over_phase(run: Run) -> Points:
    """Misfit of the cart, um, over the phase of its sine, in turns."""
    turns = np.asarray(BASE.frequency_hz * run.time + BASE.base_phase / (2 * np.pi))
    return turns % 1.0, 1e6 * run.misfit("cart_displacement")


def cart_over_time(run: Run) -> Points:
    """Misfit of the cart, um, over time."""
    return run.time, 1e6 * run.misfit("cart_displacement")


def misfit_over_time(channel: str, *, scale: float, until: float) -> Callable[[Run], Points]:
    """Misfit of a channel over time, up to `until` s."""

    def points(run: Run) -> Points:
        chosen = run.time < until
        return run.time[chosen], scale * run.misfit(channel)[chosen]

    return points


def touch_over_time(run: Run) -> Points:
    """Where the hammer is when a contact begins, um beyond the gap as set."""
    after = run.touches
    return run.time[after], 1e6 * 0.5 * (run.indentation[after - 1] + run.indentation[after])


def force_over_force(run: Run) -> Points:
    """What the load cell shows over the force of the nominal model."""
    return run.nominal["impact_force"], run.recorded["impact_force"]


def spectrum(run: Run) -> Points:
    """Amplitude of the misfit of the hammer's displacement, um, over frequency."""
    window = np.hanning(len(run.time))
    amplitude = 2 * np.abs(np.fft.rfft(window * run.misfit("hammer_displacement"))) / window.sum()
    frequency = np.fft.rfftfreq(len(run.time), run.time[1] - run.time[0])
    shown = (frequency > 20) & (frequency < 120)
    return frequency[shown], 1e6 * amplitude[shown]


def over_reading(run: Run) -> Points:
    """Misfit of the hammer's displacement, um, over its value, mm."""
    return _MM * run.nominal["hammer_displacement"], 1e6 * run.misfit("hammer_displacement")


def over_rate(run: Run) -> Points:
    """Misfit of the hammer's displacement, um, over its rate, m/s."""
    return np.gradient(run.nominal["hammer_displacement"], run.time), 1e6 * run.misfit("hammer_displacement")


def _since(run: Run, window: tuple[float, float]) -> np.ndarray:
    """Time since the last touch, s; NaN outside the window."""
    starts = run.time[run.touches]
    index = np.searchsorted(starts, run.time, side="right") - 1
    since = np.where(index >= 0, run.time - starts[np.maximum(index, 0)], np.nan)
    return np.where((since >= window[0]) & (since <= window[1]), since, np.nan)


def until(points: Points, end: float) -> Points:
    """The points before an abscissa."""
    chosen = points[0] < end
    return points[0][chosen], points[1][chosen]
