"""Restitution against approach speed as it was measured, with the contact laws before and after."""

from collections.abc import Iterator

from identification.discrepancy.diagnosis import Diagnosis
from identification.discrepancy.report.figures.base import AFTER, BEFORE, DASHED, Picture
from identification.report.figures.restitution import FEWEST, restitution_picture
from identification.report.rebounds import rebounds


def restitution(diagnosis: Diagnosis) -> Iterator[Picture]:
    """One picture where something is missing and enough contacts have flight on either side, which the better model tells best."""
    nominal, augmented = diagnosis.nominal, diagnosis.augmented
    found = [] if diagnosis.location is None else rebounds(augmented.records, augmented.model)
    if len(found) < FEWEST:
        return
    laws, curves = [(nominal.model, {"color": BEFORE, "linestyle": DASHED, "label": "nominal law"})], "blue: the nominal contact law"
    if augmented is not nominal:
        laws.append((augmented.model, {"color": AFTER, "label": "augmented law"}))
        curves = "blue and dashed: the nominal contact law, orange: the augmented one"
    yield restitution_picture(found, laws, curves, section="location")
