"""Effects added on request, whether or not the records give evidence of them."""

from collections.abc import Callable, Sequence

import numpy as np

from identification.diagnosis.augment import augmented
from identification.diagnosis.look import known_effects, look, weighed_anew
from identification.result.evidence import chance
from identification.result.result import Added
from identification.trajectory.fit import Fitted, polished
from identification.wording.numbers import joined
from vibrojax.effects.formula import Formula
from vibrojax.errors import InputError


def with_effects(
    nominal: Fitted, names: Sequence[str], *, terms: Sequence[Formula] = (), progress: Callable[[str], None]
) -> tuple[Fitted, Added]:
    """The fitted model with effects, added in the order of `names`, each fitted anew with everything else, and what they gain.

    Names are those of listed effects or of `terms`, forces of the user. Of the candidates of an effect (frequencies, channels, records,
    first values), that with the largest expected gain is the start.

    Raises:
        InputError: an effect has nothing to act on in these records.
    """
    found, possibilities, places = nominal, 1, []
    for name in names:
        progress(f"choosing where {name} begins")
        seen = look(found, [name], terms)
        if not seen.listed:
            channels = joined(list(found.problem.chains.channels))
            raise InputError(f"{name} has nothing to act on in these records, which hold {channels}: leave it out")
        best = seen.listed[0].candidate
        places.append(best.channel or best.members[0].record or "")
        possibilities *= known_effects(terms)[name].probe.tried(seen.scales, len(seen.listed))
        progress(f"fitting the model with {name}")
        found = polished(augmented(seen, best, weighed_anew(seen, best).strengths, progress=progress))
    gain = 0.5 * (nominal.deviance - found.deviance)
    numbers = max(_unknowns(found) - _unknowns(nominal), 1)
    return found, Added(
        names=tuple(names),
        places=tuple(places),
        gain=gain,
        chance=chance(2.0 * gain, numbers, possibilities),
        bic=-2.0 * gain + numbers * float(np.log(max(found.local.samples, 1))),
        held_back=None,
    )


def _unknowns(fitted: Fitted) -> int:
    return int(fitted.problem.border.shared.sum() + fitted.problem.border.own.sum())
