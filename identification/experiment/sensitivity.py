"""Sensitivity of a sensor: its output, a voltage or a current, over what it measures."""

import re
from dataclasses import dataclass
from math import inf

from identification.experiment.errors import ExperimentError, listed, shown
from identification.experiment.units import OUTPUTS, factor_to_si, output_of

_TEXT = re.compile(r"(?P<value>\d*\.?\d+(?:[eE][+-]?\d+)?)\s*(?P<output>[^\s\d./]+)\s*/\s*(?:\((?P<inner>.+)\)|(?P<plain>.+))")
"""Such as "10.2 mV/(m/s^2)"."""
_EXAMPLES = {"force": "11.2 mV/N", "acceleration": "100 mV/g", "displacement": "0.8 V/mm"}
"""By dimension."""
_SMALLEST = 1e-30
"""V or A for one SI unit; no sensor has less, nor more than its inverse."""


def example(dimension: str, output: str) -> str:
    """A sensitivity as one writes it, of a sensor with such an output.

    Example:
        >>> example("force", "mV"), example("displacement", "mA")
        ('11.2 mV/N', '0.8 mA/mm')
    """
    voltage = _EXAMPLES[dimension]
    return voltage if output_of(output) == "voltage" else re.sub(r"m?V", "mA", voltage)


@dataclass(frozen=True, kw_only=True)
class Sensitivity:
    """Output of a sensor over what it measures, as its calibration sheet states it.

    Attributes:
        text: as written, for instance "11.2 mV/N".
        unit: of the output there, for instance "mV".
        per_si: output in V or A for one SI unit of what is measured, above 0.
    """

    text: str
    unit: str
    per_si: float

    def factor(self, unit: str, where: str) -> float:
        """SI value of what is measured at an output of one `unit`.

        Args:
            unit: of the recorded numbers.
            where: the place that states it, for the message.

        Raises:
            ExperimentError: it is no unit of the sensor's output.

        Example:
            >>> read_sensitivity("10 mV/N", "force", "[sensors.impact_force]").factor("V", "")
            100.0
        """
        kind = output_of(self.unit)
        if kind is None or output_of(unit) != kind:
            known = listed(OUTPUTS[kind] if kind else ())
            raise ExperimentError(
                f"unit {shown(unit)} in {where} does not suit the sensitivity of {self.text}: expected one of the sensor's output, that is "
                f"{known}; correct the unit, or take the sensitivity out where the numbers are what it measures"
            )
        return factor_to_si(unit, kind, where) / self.per_si


def read_sensitivity(text: str, dimension: str, where: str) -> Sensitivity:
    """Read a sensitivity.

    Args:
        text: a number, the unit of the output, "/" and a unit of what is measured: "11.2 mV/N", "10.2 mV/(m/s^2)".
        dimension: of what is measured.
        where: the table that states it, for the message.

    Raises:
        ExperimentError: the text is no such quotient, its number is not above 0, or a unit is unknown or of another dimension, such as the
            rated output of a bridge, in mV/V.

    Example:
        >>> read_sensitivity("0.8 V/mm", "displacement", "[sensors.hammer_displacement]").per_si
        800.0
    """
    found = _TEXT.fullmatch(text.strip())
    value, kind = (float(found["value"]), output_of(found["output"])) if found else (0.0, None)
    if found is None or kind is None or not 0.0 < value < inf:
        outputs = listed(unit for table in OUTPUTS.values() for unit in table)
        raise ExperimentError(
            f"sensitivity in {where} is {shown(text)}: expected a number above 0 with one of {outputs} over a unit of {dimension}; "
            f'write it as "{_EXAMPLES[dimension]}"'
        )
    measured = (found["inner"] or found["plain"]).strip()
    if output_of(measured):
        raise ExperimentError(
            f"sensitivity in {where} is {shown(text)}, a rated output over its supply: expected an output over a unit of {dimension}; "
            'multiply it by the supply and divide by the full scale, for 2 mV/V at 10 V and 500 N write "0.04 mV/N"'
        )
    per_si = value * factor_to_si(found["output"], kind, where) / factor_to_si(measured, dimension, f"the sensitivity of {where}")
    if not _SMALLEST < per_si < 1.0 / _SMALLEST:
        raise ExperimentError(f"sensitivity in {where} is {shown(text)}: expected one that a sensor can have; write it as on its sheet")
    return Sensitivity(text=text.strip(), unit=found["output"], per_si=per_si)
