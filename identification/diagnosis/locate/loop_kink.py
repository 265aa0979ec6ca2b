"""Kink of the contact law in the recorded force-indentation loops, reported where the verdict asserts no cause."""

import numpy as np

from identification.diagnosis.diagnosis import LoopKink
from identification.diagnosis.score.force_loops import SeenLoops
from identification.diagnosis.score.scored import Scored

_DEEP = 0.5
"""Smallest depth of a kink over the deepest indentation: a law with an earlier kink is another law
altogether, and one that stiffens gradually may show a kink at greater depth.
"""


def loop_kink(scored: Scored) -> LoopKink | None:
    """Kink of the contact law: depth beyond which the loops are stiffer than the law fitted to them; None where the loops show none.

    A `deep_stop` would begin there. The kink must be deep, and some records must stay short of it, which identify the law in front.
    """
    effect = next((one.members[0] for one in scored.found if one.members[0].probe.kink), None)
    shown = None if effect is None else SeenLoops(scored).shown(effect)
    if effect is None or shown is None:
        return None
    loops, files = shown.with_kink, [record.file for record in scored.fitted.prepared.experiment.records]
    touched, record = np.unique(loops.record, return_inverse=True)
    found = LoopKink(
        depth=loops.values[f"{effect.name}.{effect.probe.kink}"],
        files=tuple(files[index] for index in touched),
        record=record,
        contact=loops.contact,
        indentation=loops.indentation,
        force=loops.force,
        without_kink=shown.without_kink.modelled,
        with_kink=loops.modelled,
    )
    is_deep = found.depth >= _DEEP * float(found.indentation.max())
    return found if is_deep and 0 < len(found.deeper) < len(found.files) else None
