"""A tight reference for both simulators: DOP853 at 1e-11 from touch to release, window by window."""

import numpy as np

from benchmarks.fit.windows import Point, Windows
from benchmarks.oracle import Rig, hunt_crossley, motion


def reference_residuals(windows: Windows, values: dict[str, float], at: Point) -> np.ndarray:
    """(samples of all windows, channels), (measured - model) / sigma; `values` are the parameters at the point, SI, with the mass `m`."""
    return np.concatenate([_window(windows, values, at, lane) for lane in range(len(windows.record))])


def _window(windows: Windows, values: dict[str, float], at: Point, lane: int) -> np.ndarray:
    begin = windows.offsets[lane]
    part = slice(begin, begin + windows.counts[lane])
    amplitude, phase, gap_error = at.nuisances[windows.record[lane]]
    rig = Rig(
        mass=values["m"],
        zeta=values["zeta"],
        f_n=values["f_n"],
        gap=float(windows.gap[lane] + gap_error),
        base_amplitude=float(amplitude),
        base_phase=float(phase),
        frequency_hz=float(windows.frequency_hz[lane]),
        force=hunt_crossley(values["k_i"], values["n"], values["lambda_i"]),
    )
    ts = windows.time[part]
    found = motion(rig, ts, tuple(at.states[lane]))
    delta = np.maximum(found.u - rig.gap, 0.0)
    force = values["k_i"] * delta ** values["n"] * np.maximum(1.0 + values["lambda_i"] * found.v, 0.0)
    y = amplitude * np.sin(2 * np.pi * rig.frequency_hz * ts + phase)
    omega_n = 2 * np.pi * rig.f_n
    channels = {
        "hammer_displacement": found.u + y,
        "cart_displacement": y,
        "hammer_acceleration": -2 * rig.zeta * omega_n * found.v - omega_n**2 * found.u - force / rig.mass,
        "impact_force": force,
    }
    predicted = np.stack([channels[name] for name in windows.channels], axis=1)
    return (windows.measured[part] - predicted) * windows.weight[part]
