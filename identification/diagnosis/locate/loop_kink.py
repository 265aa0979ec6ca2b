"""Where the contact law bends, for a verdict that asserts no cause: what the records show without integrating a motion."""

import numpy as np

from identification.diagnosis.diagnosis import Bend
from identification.diagnosis.score.force_loops import SeenLoops
from identification.diagnosis.score.scored import Scored

_DEEP = 0.5
"""Of the deepest indentation: a law that bends before is another law all over. One that only gets steeper may bend behind it."""


def bend(scored: Scored) -> Bend | None:
    """The depth from which on the loops are harder than the law that describes them up to there; None where they show none.

    There a `deep_stop` would begin. It must be deep, and some records stay clear of it, which tell the law in front.
    """
    probe = next((one.members[0] for one in scored.found if one.members[0].in_loops), None)
    shown = None if probe is None else SeenLoops(scored).shown(probe)
    if probe is None or shown is None:
        return None
    loops, files = shown.bent, [record.file for record in scored.fitted.prepared.experiment.records]
    touched, record = np.unique(loops.record, return_inverse=True)
    found = Bend(
        depth=loops.values[f"{probe.name}.{probe.place}"],
        files=tuple(files[index] for index in touched),
        record=record,
        contact=loops.contact,
        indentation=loops.indentation,
        force=loops.force,
        straight=shown.straight.modelled,
        bent=loops.modelled,
    )
    is_deep = found.depth >= _DEEP * float(found.indentation.max())
    return found if is_deep and 0 < len(found.deeper) < len(found.files) else None
