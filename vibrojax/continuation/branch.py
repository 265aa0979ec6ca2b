"""A branch of periodic orbits, as found: arrays along it, special points, a table, and what it shows in one sentence."""

import enum

import equinox as eqx
import numpy as np
from jaxtyping import Bool, Complex, Float, Int

from vibrojax.continuation.multipliers import is_stable
from vibrojax.continuation.special import SpecialPoint


class End(enum.Enum):
    """Why a branch was followed no further."""

    BOUND = "the parameter reached the end of its range"
    CLOSED = "the branch closed on itself"
    POINTS = "the most points allowed were computed"
    GRAZING = "the orbit grazes the stop, and no orbit of this kind lies beyond"
    BORN = "the period is half as long there: orbits of this branch are born by period doubling"
    LOST = "no further orbit was found at the shortest step"


class Branch(eqx.Module):
    """Periodic orbits of one family along one parameter, in the order in which they were met."""

    name: str = eqx.field(static=True)
    """Of the parameter."""
    label: str = eqx.field(static=True)
    """Symbol and unit of the parameter."""
    cycles: int = eqx.field(static=True)
    """Period in periods of the cart."""
    rigid: bool = eqx.field(static=True)
    """Whether the stop is rigid, so that there is no peak force."""
    parameter: Float[np.ndarray, " points"]
    states: Float[np.ndarray, "points states"]
    """(u, u', ...) at the section, m and m/s."""
    multipliers: Complex[np.ndarray, "points states"]
    touches: Int[np.ndarray, " points"]
    """Impacts in one period."""
    peak_force: Float[np.ndarray, " points"]
    """N; zero for a rigid stop."""
    impact_speed: Float[np.ndarray, " points"]
    """Of the fastest impact, m/s; zero without one."""
    highest: Float[np.ndarray, " points"]
    """Largest u, m."""
    special: tuple[SpecialPoint, ...]
    ends: tuple[End, End] = eqx.field(static=True)
    """Why the branch ends at its first and at its last point."""

    @property
    def stable(self) -> Bool[np.ndarray, " points"]:
        """Whether all multipliers lie inside the unit circle."""
        return is_stable(self.multipliers)

    def columns(self) -> dict[str, np.ndarray]:
        """The branch as columns of a plain table: one row a point."""
        states = {"u_m": self.states[:, 0], "v_m_per_s": self.states[:, 1]}
        own = {f"own_{index}": self.states[:, 2 + index] for index in range(self.states.shape[1] - 2)}
        roots = {}
        for index in range(self.multipliers.shape[1]):
            mu = self.multipliers[:, index]
            roots |= {f"mu{index + 1}_real": np.real(mu), f"mu{index + 1}_imag": np.imag(mu)}
        force = {} if self.rigid else {"peak_force_N": self.peak_force}
        return {
            self.name: self.parameter,
            **states,
            **own,
            "stable": self.stable.astype(int),
            "touches": self.touches,
            "impact_speed_m_per_s": self.impact_speed,
            **force,
            "highest_u_m": self.highest,
            **roots,
        }

    def csv(self) -> str:
        """`columns` as comma-separated text with a header; numbers as exact as they are."""
        columns = self.columns()
        rows = zip(*(column.tolist() for column in columns.values()), strict=True)
        return "\n".join([",".join(columns), *(",".join(repr(value) for value in row) for row in rows)]) + "\n"

    def special_table(self) -> list[dict[str, str | int | float | bool]]:
        """One row a special point: kind, parameter, width of its bracket, largest multiplier, impacts a period."""
        return [
            {
                "kind": place.kind.value,
                self.name: place.parameter,
                "bracket": place.bracket,
                "mu1_real": float(place.orbit.multipliers[0].real),
                "mu1_imag": float(place.orbit.multipliers[0].imag),
                "mu2_real": float(place.orbit.multipliers[1].real),
                "mu2_imag": float(place.orbit.multipliers[1].imag),
                "touches": place.orbit.touches,
                "impact_speed_m_per_s": float(place.orbit.passage.fastest_touch),
                "peak_force_N": float(place.orbit.passage.peak_force),
            }
            for place in self.special
        ]


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
