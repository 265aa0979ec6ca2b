"""Windows of single impacts, short enough to compare many starts."""

import numpy as np

from identification.windows.lanes import Inputs, grouped, initial_states, lane
from identification.windows.prepare import Prepared
from identification.windows.windows import Windows


def impact_windows(prepared: Prepared, count: int) -> tuple[Windows, np.ndarray] | None:
    """Short windows of single impacts of different strength, with their initial states; None if there are none.

    Only records whose cart is at rest or moves harmonically are used.
    """
    found = []
    for index, (motion, cart) in enumerate(zip(prepared.motions, prepared.carts, strict=True)):
        if motion is None or cart is not None or prepared.experiment.records[index].kind in ("forced", "prescribed"):
            continue
        edges = np.flatnonzero(np.diff(np.concatenate([[False], motion.touching, [False]]).astype(int))).tolist()
        whole = [(a, b) for a, b in zip(edges[::2], edges[1::2], strict=True) if a > 0 and b < len(motion.u)]
        found += [(float(motion.inertia[a:b].max()), index, a, b) for a, b in whole]
    if not found:
        return None
    found.sort()
    chosen = [found[i] for i in np.unique(np.linspace(0, len(found) - 1, count).round().astype(int))]
    margin = max(8, int(np.median([b - a for _, _, a, b in chosen])))
    spans = [(index, max(a - margin, 0), b + margin) for _, index, a, b in chosen]
    records = prepared.experiment.records
    longest = max(stop - first for _, first, stop in spans)
    lanes = [lane(i, records[i], first, min(stop, len(records[i].time)) - first, longest, Inputs()) for i, first, stop in spans]
    (group,) = grouped(lanes)
    return group, initial_states(group, prepared.motions)
