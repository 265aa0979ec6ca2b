"""Effects added on request, whether or not the records give evidence of them."""

from collections.abc import Callable, Sequence

from identification.diagnosis.score.scored import score_all
from identification.diagnosis.search.alternatives import started
from identification.diagnosis.search.among import among_effects
from identification.diagnosis.search.attempts import Progress, attempt, by_least_squares, to_the_end
from identification.likelihood.fitted import Fitted
from vibrojax.errors import InputError, NoConvergenceError


def extension(names: Sequence[str]) -> Callable[[Fitted, Progress], Fitted] | None:
    """From the fitted nominal model to one with these effects, fitted; None without a name.

    Raises:
        InputError: an unknown name, or a single text in place of several names.
    """
    if not names:
        return None
    known = among_effects(only=names)
    return lambda model, progress: with_effects(model, known, progress)


def with_effects(model: Fitted, names: Sequence[str], progress: Progress = lambda stage: None) -> Fitted:
    """The fitted model with effects, added one after another in the order of `names`, each refitted with all other parameters.

    Of the candidates of an effect (frequencies, channels, records), that with the largest expected gain is the start.

    Raises:
        InputError: these records hold nothing that an effect could act on, such as a load cell for one that clips.
        NoConvergenceError: the model cannot be fitted with the effects.
    """
    for name in names:
        progress(f"fitting {name} beside {model.title}")
        scored = score_all(model, (name,))
        if not scored.found:
            raise InputError(f"{name} cannot act in these records: expected the channels and motion that it needs; leave it out")
        best = max(scored.found, key=lambda one: one.gain)
        found = attempt(started(best, scored), model.variances, rounds=3)
        if found is not None and not found.converged:
            found = by_least_squares(found, progress)
        if found is None:
            raise NoConvergenceError(f"the model cannot be fitted with {name}: leave it out, or fit fewer effects")
        model = found
    progress(f"fitting {model.title} to the end")
    found = to_the_end(model)
    if found is None:
        raise NoConvergenceError(f"the model with {model.title} diverges on windows of ordinary length: leave an effect out")
    return found
