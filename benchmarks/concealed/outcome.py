"""What one method said about one case, and whether that is right."""

import dataclasses
from collections.abc import Mapping

PROGRAM = "program"
ADEQUATE, MISSING, UNLISTED, FAILURE = "adequate", "missing", "unlisted", "failure"


@dataclasses.dataclass(frozen=True, kw_only=True)
class Outcome:
    """A verdict beside the truth."""

    truth: tuple[str, ...]
    """Names of what is concealed."""
    verdict: str
    """One of "adequate", "missing", "unlisted", or "failure" where the method gave none."""
    effects: tuple[str, ...] = ()
    """Listed effects that are claimed, the most probable first."""
    ambiguous_with: tuple[str, ...] = ()

    @property
    def claim(self) -> str:
        """The verdict, or the first name where effects are claimed."""
        return self.effects[0] if self.verdict == MISSING and self.effects else self.verdict

    @property
    def detected(self) -> bool:
        """Something is said to be missing."""
        return self.verdict in (MISSING, UNLISTED)

    @property
    def named(self) -> bool:
        """The first name is the truth."""
        return self.claim in self.truth

    @property
    def named_alone(self) -> bool:
        """Nothing but the truth is claimed."""
        return self.verdict == MISSING and set(self.effects) == set(self.truth)

    @property
    def named_or_twin(self) -> bool:
        """The truth is among the claims or among what the claims cannot be told from."""
        return self.verdict == MISSING and bool(set(self.truth) & {*self.effects, *self.ambiguous_with})

    @property
    def all_named(self) -> bool:
        """Every concealed effect is claimed."""
        return self.verdict == MISSING and set(self.truth) <= set(self.effects)


def outcome(trial: Mapping, method: str = PROGRAM) -> Outcome:
    """Read it from a finished case; `method` is the program or the name of a baseline."""
    truth = tuple(effect["name"] for effect in trial["effects"])
    if method != PROGRAM:
        names = trial["baselines"][method].get("name")
        if names is None:
            return Outcome(truth=truth, verdict=FAILURE)
        listed = tuple(name for name in names if name != UNLISTED)
        verdict = ADEQUATE if not names else UNLISTED if names[0] == UNLISTED else MISSING
        return Outcome(truth=truth, verdict=verdict, effects=listed if verdict == MISSING else ())
    found = trial.get("diagnosis")
    if found is None:
        return Outcome(truth=truth, verdict=FAILURE)
    effects, twins = tuple(found["effects"]), tuple(found["ambiguous_with"])
    return Outcome(truth=truth, verdict=found["verdict"], effects=effects, ambiguous_with=twins)
