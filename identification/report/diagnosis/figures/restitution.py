"""Restitution against approach speed as it was measured, and as the models before and after have it."""

from collections.abc import Iterator

from identification.diagnosis.diagnosis import Diagnosis
from identification.report.figures.base import Picture
from identification.report.figures.restitution import FEWEST, Shown, restitution_picture
from identification.report.page_style import PageStyle
from identification.result.rebounds import rebounds


def restitution(diagnosis: Diagnosis, style: PageStyle) -> Iterator[Picture]:
    """One picture where something is missing and enough contacts have flight on either side.

    What is measured is by the better model, or by the nominal one where few flights beside that one are without a jump.
    """
    if diagnosis.location is None:
        return
    nominal, augmented = diagnosis.nominal, diagnosis.augmented
    before, after = (rebounds(side.records, side.model) for side in (nominal, augmented))
    if len(before) < FEWEST:
        return
    models, measured = [Shown(contacts=before, name="nominal model", ink=style.nominal)], before
    if augmented is not nominal and len(after) >= FEWEST:
        models, measured = [*models, Shown(contacts=after, name="augmented model", ink=style.augmented, mark="s")], after
    yield restitution_picture(measured, models, style, section="location")
