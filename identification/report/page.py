"""`report.html` of a fit or a diagnosis: one page that stands alone, with every image inside, and the plots beside it."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from identification.diagnosis.diagnosis import MISSING, Diagnosis
from identification.diagnosis.files import diagnosis_provenance
from identification.report import diagnosis_tables, tables
from identification.report.base import SCREEN, PageStyle, Progress, rendered, subject, write_page
from identification.report.contact import loops, phase_plane, restitution, restitution_of_both
from identification.report.decay import ring_downs, ring_downs_of_both
from identification.report.diagnosis_figures import before_after, missing, missing_over_others, residual_maps
from identification.report.estimates import likelihood_profiles, posterior
from identification.report.records import impact_closeups, overlay, residuals
from identification.report.verdict import judge, next_steps
from identification.result.files import provenance as provenance_of
from identification.result.reference import Reference, compare
from identification.result.result import FitResult
from identification.wording.numbers import grouped, joined, significant

FIGURES = (loops, restitution, phase_plane, ring_downs, overlay, impact_closeups, residuals, likelihood_profiles, posterior)
FIGURES_OF_DIAGNOSIS = (missing, before_after, missing_over_others, residual_maps, restitution_of_both, ring_downs_of_both)


def write_report(
    result: FitResult,
    folder: Path,
    *,
    reference: Reference | None = None,
    provenance: Mapping[str, Any] | None = None,
    style: PageStyle = SCREEN,
    progress: Progress = lambda stage: None,
) -> list[Path]:
    """Write `report.html`, and every plot as PNG, with a style for paper also as PDF, into a folder that exists; the page is first.

    Known values in a `reference` are set beside the fitted ones. The provenance is as in `fit.json`, by default that of the result.

    Raises:
        InputError: the reference does not suit the fit; nothing is written then.
    """
    compared = None if reference is None else tables.comparison(compare(result, reference), reference)
    images = rendered(FIGURES, result, lambda picture: subject(result.experiment, result.records, picture.record), style, progress)
    verdict, drawn = judge(result), {image.picture.record for image in images}
    return write_page(
        "fit.html",
        images,
        style,
        folder,
        next_steps=next_steps(result, verdict),
        provenance=provenance_of(result) if provenance is None else provenance,
        seconds=result.seconds,
        result=result,
        verdict=verdict,
        tables=tables,
        parameters=tables.parameters(result),
        records=tables.records(result.records, result.experiment),
        channels=tables.channels((*result.records, *result.held_back), result.experiment),
        samples=sum(record.samples for record in result.records),
        reference=reference,
        compared=compared,
        undrawn=[record.file for record in result.records if record.file not in drawn],
        unread=grouped(result.ring_downs.left_out.items()),
        shift=significant(result.discretisation, 2),
    )


def write_diagnosis_report(
    diagnosis: Diagnosis,
    folder: Path,
    *,
    provenance: Mapping[str, Any] | None = None,
    style: PageStyle = SCREEN,
    progress: Progress = lambda stage: None,
) -> list[Path]:
    """Write the same of a diagnosis."""
    experiment, records = diagnosis.experiment, diagnosis.nominal.records
    images = rendered(FIGURES_OF_DIAGNOSIS, diagnosis, lambda picture: subject(experiment, records, picture.record), style, progress)
    drawn, listed = {image.picture.record for image in images}, diagnosis_tables.strongest(diagnosis)
    fitted = [one for one in listed if one.drop is not None] or list(listed[:5])
    return write_page(
        "diagnosis.html",
        images,
        style,
        folder,
        next_steps=diagnosis_tables.next_steps(diagnosis),
        provenance=diagnosis_provenance(diagnosis) if provenance is None else provenance,
        seconds=diagnosis.seconds,
        diagnosis=diagnosis,
        tables=diagnosis_tables,
        load=tables.load_words(diagnosis.nominal_model),
        missing=diagnosis.verdict == MISSING,
        candidates=diagnosis_tables.candidates(diagnosis, fitted),
        further=diagnosis_tables.candidates(diagnosis, [one for one in listed if one not in fitted]),
        more=max(len(diagnosis.considered) - len(listed), 0),
        undrawn=joined([record.file for record in records if record.file not in drawn]),
        unread=grouped(diagnosis.ring_downs.left_out.items()),
        readings=tables.reading_errors(diagnosis.reading_error, diagnosis.experiment),
        samples=sum(record.samples for record in records),
    )
