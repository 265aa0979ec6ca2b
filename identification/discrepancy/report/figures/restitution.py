"""Restitution against approach speed as it was measured, with the contact laws before and after."""

from collections.abc import Iterator

from identification.discrepancy.diagnosis import Diagnosis
from identification.discrepancy.report.figures.base import AFTER, BEFORE, DASHED, Picture
from identification.report.figures.restitution import FEWEST, restitution_picture
from identification.report.rebounds import rebounds


def restitution(diagnosis: Diagnosis) -> Iterator[Picture]:
    """One picture, where enough contacts were recorded with flight on either side, which is told best by the better model."""
    nominal, augmented = diagnosis.nominal, diagnosis.augmented
    found = rebounds(augmented.records, augmented.model)
    if len(found) < FEWEST:
        return
    laws, curves = [(nominal.model, {"color": BEFORE, "linestyle": DASHED, "label": "nominal law"})], "blue: the nominal contact law"
    if augmented is not nominal:
        laws.append((augmented.model, {"color": AFTER, "label": "augmented law"}))
        curves = "blue and dashed: the nominal contact law, orange: the augmented one"
    yield restitution_picture(found, laws, curves, section="location")
