"""Restitution against approach speed as it was measured, and as the models before and after have it."""

from collections.abc import Iterator

from identification.diagnosis.diagnosis import Diagnosis
from identification.report.diagnosis.figures.base import AFTER, BEFORE, Picture
from identification.report.figures.restitution import FEWEST, restitution_picture
from identification.result.rebounds import rebounds


def restitution(diagnosis: Diagnosis) -> Iterator[Picture]:
    """One picture where something is missing and enough contacts have flight on either side.

    What is measured is by the better model, or by the nominal one where few flights beside that one are without a jump.
    """
    if diagnosis.location is None:
        return
    nominal, augmented = diagnosis.nominal, diagnosis.augmented
    before, after = (rebounds(side.records, side.model) for side in (nominal, augmented))
    if len(before) < FEWEST:
        return
    models, in_words, measured = [(before, BEFORE, "nominal model")], "blue: the nominal model", before
    if augmented is not nominal and len(after) >= FEWEST:
        models, in_words, measured = [*models, (after, AFTER, "augmented model")], f"{in_words}, orange: the augmented one", after
    yield restitution_picture(measured, models, in_words, section="location")
