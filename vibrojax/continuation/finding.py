"""What a branch shows, in one sentence for the terminal and the caption."""

import numpy as np

from vibrojax.continuation.branch import Branch, End


def finding(branch: Branch) -> str:
    """Where its orbits are stable, where they change, and where the impact is strongest on the stable ones."""
    x, unit = branch.parameter, branch.label.rpartition(" ")[2].strip("()")
    stable, touches = branch.stable, branch.touches
    kinds = np.where(stable, touches, -1)
    if End.CLOSED in branch.ends and (changes := np.flatnonzero(kinds[1:] != kinds[:-1])).size:  # a stretch across the first point
        x, kinds, touches, stable = (np.roll(part, -1 - changes[0]) for part in (x, kinds, touches, stable))
    starts = [0, *(1 + np.flatnonzero(kinds[1:] != kinds[:-1])), len(kinds)]
    stretches: dict[str, list[str]] = {}
    for a, b in zip(starts[:-1], starts[1:], strict=True):
        if stable[a]:
            name = f"z = {touches[a]}/{branch.cycles}" if touches[a] else "no impact"
            low, high = float(x[a:b].min()), float(x[a:b].max())
            stretches.setdefault(name, []).append(f"from {low:.4g} to {high:.4g} {unit}")
    words = [f"{name} stable {' and '.join(parts)}" for name, parts in sorted(stretches.items(), reverse=True)] or ["nowhere stable"]
    places = [f"{place.kind.value} at {place.parameter:.4g} {unit}" for place in branch.special]
    sentence = ", ".join([*words, *places])
    strength, symbol = (branch.impact_speed, "impact speed {:.3g} m/s") if branch.rigid else (branch.peak_force, "F_i {:.3g} N")
    if branch.stable.any() and strength[branch.stable].max() > 0:
        top = int(np.argmax(np.where(branch.stable, strength, -np.inf)))
        sentence += f", largest stable {symbol.format(strength[top])} at {branch.parameter[top]:.4g} {unit}"
    return sentence
