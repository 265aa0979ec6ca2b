"""Restitution against approach speed as it was measured, and as the models before and after have it."""

from collections.abc import Iterator

from identification.discrepancy.diagnosis import Diagnosis
from identification.discrepancy.report.figures.base import AFTER, BEFORE, Picture
from identification.report.figures.restitution import FEWEST, restitution_picture
from identification.report.rebounds import rebounds


def restitution(diagnosis: Diagnosis) -> Iterator[Picture]:
    """One picture where something is missing and enough contacts have flight on either side; measured by that of the better model."""
    if diagnosis.location is None:
        return
    nominal, augmented = diagnosis.nominal, diagnosis.augmented
    before, after = (rebounds(side.records, side.model) for side in (nominal, augmented))
    if min(len(before), len(after)) < FEWEST:
        return
    models, in_words = [(before, BEFORE, "nominal model")], "blue: the nominal model"
    if augmented is not nominal:
        models, in_words = [*models, (after, AFTER, "augmented model")], f"{in_words}, orange: the augmented one"
    yield restitution_picture(after, models, in_words, section="location")
