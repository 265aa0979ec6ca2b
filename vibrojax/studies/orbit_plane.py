"""Every stable periodic orbit over a plane of operating points: found somewhere, and continued from cell to cell by Newton's method."""

from typing import NamedTuple

import numpy as np
from jaxtyping import Float, Int

from vibrojax.batch import Strobes, find_orbits
from vibrojax.batch.orbits import same_orbit
from vibrojax.studies.base import LONGEST

SLOTS = 5
"""Stable orbits that are kept at one cell."""
_TRIES = 2
"""How often one motion is tried at one cell, each time from another neighbour."""
_NEAR_RETURN = 0.1
"""Of A0, and of A0 Omega: a motion that comes back as close as this may be near an orbit."""
_STRAIGHT = 0.1
"""Over the same: neighbours' section points farther apart are not extrapolated."""


class Found(NamedTuple):
    """Orbits at cells of the plane, one entry each."""

    slot: Int[np.ndarray, " orbits"]
    cell: Int[np.ndarray, " orbits"]


class OrbitPlane:
    """The stable orbits that are known at each cell, where cells are the operating points of a plane, row by row.

    Orbits of up to `LONGEST` cycles. A motion is named by its code 1000 p + q, 0 without impacts; two orbits of one code at one cell are
    both kept, and the first of them is continued.

    Arguments:
        strobes: the rigs, one a cell; without effects.
        shape: rows and columns of the plane.
        scale: A0, m, and A0 Omega, m/s, `(2, cells)`.
    """

    def __init__(self, strobes: Strobes, shape: tuple[int, int], scale: Float[np.ndarray, "2 cells"]):
        cells = shape[0] * shape[1]
        self.strobes, self.shape, self.scale = strobes, shape, scale
        self.count = np.zeros(cells, dtype=int)
        self.code = np.full((SLOTS, cells), -1)
        self.state = np.full((SLOTS, 2, cells), np.nan)
        self.force = np.full((SLOTS, cells), np.nan)
        self._tried: dict[int, np.ndarray] = {}

    @property
    def period(self) -> Int[np.ndarray, "slot cells"]:
        """q of each orbit, cycles; meaningless where there is none."""
        return np.where(self.code > 0, self.code % 1000, 1)

    def seek(self, cells: Int[np.ndarray, " starts"], guess: Float[np.ndarray, "2 starts"], period: Int[np.ndarray, " starts"]) -> Found:
        """Orbits near guesses of u, m, and u', m/s, at the strobe; those that are stable and were not known are kept and handed back."""
        there = find_orbits(self.strobes, cells, guess, period, self.scale[:, cells])
        code = np.where(there.impacts > 0, 1000 * there.impacts + there.period, 0)
        chosen = np.flatnonzero(there.found & there.stable & ((there.impacts > 0) | (there.period == 1)))
        slots, places = [np.zeros(0, int)], [np.zeros(0, int)]
        for some in _one_a_cell(cells, chosen):
            known = np.zeros(some.size, bool)
            for slot in range(SLOTS):
                other = self.state[slot][:, cells[some]]
                alike = self.code[slot, cells[some]] == code[some]
                known |= alike & same_orbit(there.strobes[:, :, some], other, self.scale[:, cells[some]])
            new = some[~known & (self.count[cells[some]] < SLOTS)]
            slot, cell = self.count[cells[new]], cells[new]
            self.code[slot, cell] = code[new]
            self.force[slot, cell] = there.peak_force[new]
            self.state[slot, :, cell] = there.state[:, new].T
            self.count[cell] += 1
            slots.append(slot)
            places.append(cell)
        return Found(np.concatenate(slots), np.concatenate(places))

    def near_returns(
        self, cells: Int[np.ndarray, " lanes"], u: Float[np.ndarray, "strobes lanes"], v: Float[np.ndarray, "strobes lanes"]
    ) -> Found:
        """Orbits near motions that almost repeat, wherever these are on their way; each is looked for with the period of its best return.

        Arguments:
            cells: of the motions.
            u: at their last strobes, two or more, m.
            v: the same, m/s.
        """
        scale, cycles = self.scale[:, cells], range(1, min(LONGEST, len(u) - 1) + 1)
        back = [np.maximum(np.abs(u[-1] - u[-1 - q]) / scale[0], np.abs(v[-1] - v[-1 - q]) / scale[1]) for q in cycles]
        distance = np.array(back)
        best = distance.min(axis=0)
        period = 1 + np.argmax(distance <= np.maximum(2.0 * best, 1e-7), axis=0)
        near = np.flatnonzero(best < _NEAR_RETURN)
        return self.seek(cells[near], np.stack([u[-1, near], v[-1, near]]), period[near])

    def spread(self, front: Found) -> None:
        """Continue orbits to the four neighbours of their cells, those found there to theirs, and so on until nothing is new.

        A guess is the line through the orbits of this cell and of the one behind it, or this cell's orbit.
        """
        while front.cell.size:
            tries = [self._beside(front, *way) for way in ((0, 1), (0, -1), (1, 0), (-1, 0))]
            cell, code, line, guess = (np.concatenate(parts, axis=-1) for parts in zip(*tries, strict=True))
            order = np.argsort(~line, kind="stable")
            _, first = np.unique(cell[order] * (1000 * 1000) + code[order], return_index=True)
            chosen = order[first]
            chosen = chosen[self._may_try(cell[chosen], code[chosen])]
            if chosen.size == 0:
                return
            cell, code = cell[chosen], code[chosen]
            front = self.seek(cell, guess[:, chosen] * self.scale[:, cell], np.where(code > 0, code % 1000, 1))

    def _beside(self, front: Found, down: int, right: int) -> tuple[np.ndarray, ...]:
        """Cell, code, whether extrapolated, and guess over `scale`, one neighbour on."""
        rows, columns = self.shape
        row, column = np.divmod(front.cell, columns)
        inside = (0 <= row + down) & (row + down < rows) & (0 <= column + right) & (column + right < columns)
        slot, cell, row, column = front.slot[inside], front.cell[inside], row[inside], column[inside]
        code = self.code[slot, cell]
        here = self.state[slot, :, cell].T / self.scale[:, cell]
        behind = np.clip(row - down, 0, rows - 1) * columns + np.clip(column - right, 0, columns - 1)
        guess, line = here.copy(), np.zeros(cell.size, bool)
        for other in range(SLOTS):
            before = self.state[other][:, behind] / self.scale[:, behind]
            straight = (self.code[other, behind] == code) & (behind != cell) & (np.abs(here - before).max(axis=0) < _STRAIGHT)
            guess, line = np.where(straight, 2.0 * here - before, guess), line | straight
        return cell + down * columns + right, code, line, guess

    def _may_try(self, cell: np.ndarray, code: np.ndarray) -> np.ndarray:
        """Which of the pairs are neither known nor tried too often; these are marked as tried once more."""
        may = ~(self.code[:, cell] == code).any(axis=0)
        for one in np.unique(code):
            times = self._tried.setdefault(int(one), np.zeros(self.count.size, np.uint8))
            may &= (code != one) | (times[cell] < _TRIES)
            times[cell[may & (code == one)]] += 1
        return may


def _one_a_cell(cells: np.ndarray, chosen: np.ndarray) -> list[np.ndarray]:
    """The chosen entries in groups that hold each cell at most once."""
    groups = []
    while chosen.size:
        _, first = np.unique(cells[chosen], return_index=True)
        groups.append(chosen[first])
        chosen = np.delete(chosen, first)
    return groups
