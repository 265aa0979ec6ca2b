"""What a branch shows, in one sentence for the terminal and the caption."""

import numpy as np

from vibrojax.continuation.branch import Branch


def finding(branch: Branch) -> str:
    """Where its orbits are stable, where they change, and where the impact is strongest on the stable ones."""
    x, unit = branch.parameter, branch.label.rpartition(" ")[2].strip("()")
    stable = branch.stable
    edges = np.flatnonzero(np.diff(np.concatenate([[False], stable, [False]]).astype(int)))
    stretches = [sorted((float(x[a]), float(x[b - 1]))) for a, b in zip(edges[::2], edges[1::2], strict=True)]
    words = " and ".join(f"from {low:.4g} to {high:.4g} {unit}" for low, high in sorted(stretches)) or "nowhere"
    impacts = sorted(set(branch.touches.tolist()))
    named = "no impact" if impacts == [0] else " and ".join(f"z = {count}/{branch.cycles}" for count in impacts if count)
    places = [f"{place.kind.value} at {place.parameter:.4g} {unit}" for place in branch.special]
    sentence = ", ".join([f"{named}: stable {words}", *places])
    strength, symbol = (branch.impact_speed, "impact speed {:.3g} m/s") if branch.rigid else (branch.peak_force, "F_i {:.3g} N")
    if stable.any() and strength[stable].max() > 0:
        top = int(np.argmax(np.where(stable, strength, -np.inf)))
        sentence += f", largest stable {symbol.format(strength[top])} at {x[top]:.4g} {unit}"
    return sentence
