"""An experiment whose hammer feels one force more, made by SciPy's DOP853 from the equations of `tests.effects.rig`."""

from collections.abc import Callable
from pathlib import Path

import numpy as np

from tests.effects.rig import FREQUENCY, GAP, M, Reference, sine

NOISE = {"hammer_displacement": (5e-6, "m"), "cart_displacement": (5e-6, "m"), "impact_force": (0.05, "N")}
"""Standard deviation and unit by channel."""


def write_made_rig(folder: Path, extra: Callable[[float, float, float, np.ndarray], float], *, seconds: float = 0.5) -> None:
    """A drop test and a driven record, with `extra(t, u, u', z)` in N on the hammer."""
    rng, ts = np.random.default_rng(1), np.arange(0.0, seconds, 5e-4)
    lines = ["schema = 1", "[experiment]", 'name = "made rig"', "[hammer]", f"mass = {M}", "[suspension]", 'kind = "linear"']
    for channel, (noise, unit) in NOISE.items():
        lines += [f"[sensors.{channel}]", f'unit = "{unit}"', f"noise = {noise}"]
    folder.mkdir()
    for name, driven in (("drop", False), ("cart", True)):
        gap = GAP if driven else 0.0
        rig = Reference(extra=extra, cart=None if driven else lambda t, z: (0.0, 0.0), gap=lambda t, z, gap=gap: (gap, 0.0))
        u, force, _, _ = rig(ts)
        y = sine(ts)[0] if driven else np.zeros(len(ts))
        found = {"hammer_displacement": u + y, "cart_displacement": y, "impact_force": force}
        noisy = {channel: values + NOISE[channel][0] * rng.standard_normal(len(ts)) for channel, values in found.items()}
        np.savez(folder / f"{name}.npz", time=ts, **noisy)
        lines += ["[[record]]", f'file = "{name}.npz"', f'kind = "{"cart-excitation" if driven else "drop-test"}"', f"gap = {gap}"]
        lines += [f"excitation_frequency = {FREQUENCY}"] if driven else []
    (folder / "experiment.toml").write_text("\n".join(lines) + "\n", encoding="utf-8")
