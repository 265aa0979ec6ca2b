"""Whether mass, units and time agree with what the impacts do to the hammer's speed."""

from identification.experiment.channels import CHANNELS, MOTION_CHANNELS
from identification.experiment.errors import DoubtError, ExperimentError, shown
from identification.experiment.plausibility.impulses import Response
from identification.experiment.record import Record
from identification.experiment.settings.scales import FAR, NEAR, mistaken_unit


def check_momentum(
    record: Record, hammer: Response | None, mass: float | None, units: dict[str, str | None], through: frozenset[str] = frozenset()
) -> None:
    """Compare mass times change of speed with the impulse of the impacts.

    A load cell that clips or lags and a compliant stop change the ratio by less than a factor of ten, a mistaken unit by more.

    Args:
        record: with its channels.
        hammer: its response to the impacts; None where it is not known.
        mass: of the hammer, kg; None where it is to be estimated.
        units: declared, by channel; None where the file states one.
        through: channels that are read through a sensitivity, which may be wrong by any factor.

    Raises:
        ExperimentError: one of them is off by a factor that a mistaken unit explains; the message names it.
        DoubtError: by another factor of ten or more.
    """
    channel = next((name for name in MOTION_CHANNELS if name in record.channels), None)
    if hammer is None or mass is None or channel is None or hammer.sign >= 0:
        return
    ratio = -hammer.slope * mass
    if 1.0 / FAR < ratio < FAR:
        return
    suspect = through & {channel, "impact_force"}
    causes = (
        []
        if suspect
        else [
            f"{name} were in {unit}" for name, off in ((channel, ratio), ("impact_force", 1.0 / ratio)) if (unit := _unit(name, off, units))
        ]
    )
    causes += ["mass were in g"] if abs(ratio / 1e3 - 1.0) < NEAR else []
    causes += ["time were in ms"] if abs(ratio / 1e-6 - 1.0) < NEAR else []
    raise (ExperimentError if causes else DoubtError)(
        f"mass times the change of speed of {channel} is {ratio:.2g} times the impulse of impact_force in {hammer.impacts} impacts of "
        f"record {shown(record.file)}: expected about the same{', as it is if ' + ' or '.join(causes) if causes else ''}; correct 'mass', "
        f"which is in kg, a unit, {'a sensitivity, ' if suspect else ''}or 'time_unit' of the record"
    )


def _unit(channel: str, factor: float, units: dict[str, str | None]) -> str:
    """The unit that the numbers of a channel would have to be in; empty where there is none, or none is declared."""
    return mistaken_unit(channel, factor, units.get(channel)) if channel in CHANNELS else ""
