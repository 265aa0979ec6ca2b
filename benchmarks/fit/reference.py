"""A tight reference for both simulators: DOP853 at 1e-11 from touch to release, window by window."""

import numpy as np

from benchmarks.oracle import Rig, hunt_crossley, motion
from identification.windows.layout import Estimate
from identification.windows.prepare import Prepared


def reference_residuals(prepared: Prepared, estimate: Estimate) -> np.ndarray:
    """(samples of all windows, channels), (measured - model) / sigma."""
    (group,) = prepared.groups
    values = prepared.layout.physical(estimate.shared)
    parts = [_window(prepared, values, estimate, lane) for lane in range(len(group.record))]
    return np.concatenate(parts)


def _window(prepared: Prepared, values: dict[str, float], estimate: Estimate, lane: int) -> np.ndarray:
    (group,) = prepared.groups
    samples = int(group.lengths[lane])
    amplitude, phase, gap_error = estimate.nuisances[group.record[lane]]
    mass = float(values.get("m", prepared.model.mass))
    rig = Rig(
        mass=mass,
        zeta=values["zeta"],
        f_n=values["f_n"],
        gap=float(group.gap[lane] + gap_error),
        base_amplitude=float(amplitude),
        base_phase=float(phase),
        frequency_hz=float(group.frequency_hz[lane]),
        force=hunt_crossley(values["k_i"], values["n"], values["lambda_i"]),
    )
    ts = group.ts[lane, :samples]
    found = motion(rig, ts, tuple(estimate.states[lane]))
    delta = np.maximum(found.u - rig.gap, 0.0)
    force = values["k_i"] * delta ** values["n"] * np.maximum(1.0 + values["lambda_i"] * found.v, 0.0)
    y = amplitude * np.sin(2 * np.pi * rig.frequency_hz * ts + phase)
    omega_n = 2 * np.pi * rig.f_n
    channels = {
        "hammer_displacement": found.u + y,
        "cart_displacement": y,
        "hammer_acceleration": -2 * rig.zeta * omega_n * found.v - omega_n**2 * found.u - force / mass,
        "impact_force": force,
    }
    predicted = np.stack([channels[name] for name in group.channels], axis=1)
    return (group.measured[lane, :samples] - predicted) * group.weight[lane, :samples]
