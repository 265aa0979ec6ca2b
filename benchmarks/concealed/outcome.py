"""What one method said about one case, and whether that is right."""

import dataclasses
from collections.abc import Mapping

PROGRAM = "program"
ADEQUATE, RESTLESS, UNLISTED, MISSING, UNDECIDED, FAILURE = "adequate", "restless", "unlisted", "missing", "undecided", "failure"
VERDICTS = (ADEQUATE, RESTLESS, UNLISTED, MISSING, UNDECIDED, FAILURE)
OPEN = (UNDECIDED, FAILURE)
"""No verdict on the rig."""
_UNREST = ("unrest", "colour", "scatter")
"""Where a case says what unrest its rig has."""


@dataclasses.dataclass(frozen=True, kw_only=True)
class Outcome:
    """A verdict beside the truth."""

    truth: tuple[str, ...]
    """Names of what is concealed."""
    verdict: str
    """One of `VERDICTS`; "failure" where the method gave none."""
    effects: tuple[str, ...] = ()
    """Listed effects that are claimed, the most probable first."""
    ambiguous_with: tuple[str, ...] = ()
    unrest: bool = False
    """Whether the rig has a random force, coloured noise or scatter, so that "restless" is no error."""

    @property
    def claim(self) -> str:
        """The verdict, or the first name where effects are claimed."""
        return self.effects[0] if self.verdict == MISSING and self.effects else self.verdict

    @property
    def detected(self) -> bool:
        """Something is said to be missing."""
        return self.verdict in (MISSING, UNLISTED)

    @property
    def false_alarm(self) -> bool:
        """A complete model is found wanting."""
        return self.verdict != ADEQUATE and not self._rightly_restless

    @property
    def refrained(self) -> bool:
        """An effect that is on no list is given no name: "unlisted", or "restless" where the rig is so."""
        return (self.verdict == UNLISTED or self._rightly_restless) and not self.effects

    @property
    def wrong_name(self) -> bool:
        """One of the effects that are claimed is not there."""
        return not set(self.effects) <= set(self.truth)

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

    @property
    def _rightly_restless(self) -> bool:
        return self.unrest and self.verdict == RESTLESS


def outcome(trial: Mapping, method: str = PROGRAM) -> Outcome:
    """Read it from a finished case; `method` is the program or the name of a baseline."""
    truth = tuple(effect["name"] for effect in trial["effects"])
    unrest = any(trial.get(name) is not None for name in _UNREST)
    if method != PROGRAM:
        names = trial["baselines"][method].get("name")
        if names is None:
            return Outcome(truth=truth, verdict=FAILURE, unrest=unrest)
        listed = tuple(name for name in names if name != UNLISTED)
        verdict = ADEQUATE if not names else UNLISTED if names[0] == UNLISTED else MISSING
        return Outcome(truth=truth, verdict=verdict, effects=listed if verdict == MISSING else (), unrest=unrest)
    found = trial.get("diagnosis")
    if found is None:
        return Outcome(truth=truth, verdict=FAILURE, unrest=unrest)
    effects, twins = tuple(found["effects"]), tuple(found["ambiguous_with"])
    return Outcome(truth=truth, verdict=found["verdict"], effects=effects, ambiguous_with=twins, unrest=unrest)
