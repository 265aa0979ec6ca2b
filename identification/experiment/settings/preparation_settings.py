"""The keys of a `[[record]]` table that prepare its samples."""

from identification.experiment.channels import CHANNELS
from identification.experiment.errors import ExperimentError, shown, suggestion
from identification.experiment.record import Preparation
from identification.experiment.settings.schema import Table, finite

TRENDS = ("constant", "linear")


def read_preparation(table: Table) -> Preparation:
    """Read `crop`, `lowpass`, `decimate`, `resample` and `detrend`.

    Args:
        table: of the record.

    Returns:
        The preparation; empty where none is declared.

    Raises:
        ExperimentError: one of them is not as it should be, or two exclude each other.
    """
    decimate = table.values.get("decimate")
    if decimate is not None and (isinstance(decimate, bool) or not isinstance(decimate, int) or decimate < 2):
        raise ExperimentError(f"decimate in {table.where} is {shown(decimate)}: expected a whole number of at least 2; correct it")
    resample = table.number("resample", unit="Hz", positive=True)
    if decimate is not None and resample is not None:
        raise ExperimentError(f"{table.where} has both decimate and resample: expected one of the two; remove one")
    return Preparation(
        crop=_crop(table),
        lowpass=table.number("lowpass", unit="Hz", positive=True),
        decimate=decimate,
        resample=resample,
        detrend=_detrend(table),
    )


def _crop(table: Table) -> tuple[float, float] | None:
    """Read `crop = [first, last]`, s."""
    if "crop" not in table.values:
        return None
    value, where = table.values["crop"], f"crop in {table.where}"
    if not isinstance(value, list) or len(value) != 2:
        raise ExperimentError(f"{where} is {shown(value)}: expected two instants in s; write crop = [first, last]")
    first, last = (finite(each, where, unit="s") for each in value)
    if first >= last:
        raise ExperimentError(f"{where} is {shown(value)}: expected the earlier instant first; write crop = [first, last]")
    return first, last


def _detrend(table: Table) -> dict[str, str]:
    """Read `detrend = { channel = "linear" }`."""
    trends = table.table("detrend", f"detrend of {table.where}")
    for channel in trends.values:
        if channel not in CHANNELS:
            raise ExperimentError(f"unknown channel {shown(channel)} in {trends.where}{suggestion(channel, CHANNELS)}")
    return {channel: trends.needed_string(channel, TRENDS) for channel in trends.values}
