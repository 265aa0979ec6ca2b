"""Damping and frequency of free vibrations against their amplitude: measured, nominal, candidates and augmented."""

from collections.abc import Iterator

import numpy as np

from identification.diagnosis.diagnosis import MISSING, Diagnosis
from identification.report.diagnosis.words import plain_name
from identification.report.figures.base import Picture
from identification.report.figures.ring_downs import Line, ring_down_picture
from identification.report.page_style import DASHED, DASHES, PageStyle
from identification.result.ring_down import RingDown
from identification.wording.numbers import joined

_BOTH = ("nominal", "augmented")
_BEYOND = (2, 3, 4)
"""Places in the style's series of the candidates' colours, which neither model has."""


def ring_downs(diagnosis: Diagnosis, style: PageStyle) -> Iterator[Picture]:
    """One picture, where a record has a free vibration; candidates within the errors of the nominal model are left out."""
    found = diagnosis.ring_downs
    if not found.measured:
        return
    nominal = found.models.get("nominal", ())
    lines = [Line(name="nominal model", ring_downs=nominal, colour=style.nominal.colour, dashes=DASHED)]
    others = {name: curve for name, curve in found.models.items() if name not in _BOTH and _differs(curve, nominal, found.measured)}
    for (name, curve), place, dashes in zip(others.items(), _BEYOND, DASHES[2:], strict=False):
        words = f"nominal with {plain_name(name)}"
        lines.append(Line(name=words, ring_downs=curve, colour=style.series[place], width=1.0, dashes=dashes))
    if "augmented" in found.models:
        names = [plain_name(effect.name) for effect in diagnosis.model.effects]
        words = f"with {joined(names)}" if diagnosis.verdict == MISSING else "with the learned term"
        lines.append(Line(name=words, ring_downs=found.models["augmented"], colour=style.augmented.colour))
    yield ring_down_picture(found, lines, diagnosis.experiment, style)


def _differs(curve: tuple[RingDown, ...], nominal: tuple[RingDown, ...], measured: tuple[RingDown, ...]) -> bool:
    """Whether a curve is somewhere further from that of the nominal model than one typical standard error."""
    for name in ("damping", "frequency"):
        error = float(np.median(np.concatenate([getattr(one, f"{name}_stderr") for one in measured])))
        for one, other in zip(curve, nominal, strict=False):
            known = np.interp(one.amplitude, other.amplitude[::-1], getattr(other, name)[::-1])
            if np.max(np.abs(known - getattr(one, name))) > error:
                return True
    return False
