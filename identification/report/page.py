"""`report.html` of a fit: one page that stands alone, with every image inside, and the plots beside it."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from identification.report import tables
from identification.report.base import SCREEN, PageStyle, Progress, framed, rendered, write_page
from identification.report.contact import loops, phase_plane, restitution
from identification.report.decay import ring_downs
from identification.report.estimates import likelihood_profiles, posterior
from identification.report.records import impact_closeups, overlay, residuals
from identification.report.verdict import judge, next_steps
from identification.result.files import provenance as provenance_of
from identification.result.reference import Reference, compare
from identification.result.result import FitResult
from identification.wording.numbers import grouped, significant

FIGURES = (loops, restitution, phase_plane, ring_downs, overlay, impact_closeups, residuals, likelihood_profiles, posterior)


def write_report(
    result: FitResult,
    folder: Path,
    *,
    reference: Reference | None = None,
    provenance: Mapping[str, Any] | None = None,
    style: PageStyle = SCREEN,
    progress: Progress = lambda stage: None,
) -> list[Path]:
    """Write `report.html`, and every plot as PNG, with a style for paper also as PDF.

    Args:
        result: of the fit.
        folder: that receives the files; it must exist.
        reference: known values to set beside the fitted ones.
        provenance: as in `fit.json`; by default that of the result.
        style: in colours, or in black and white.
        progress: called with a line of text for each figure.

    Returns:
        Paths of the files, the page first.

    Raises:
        InputError: the reference does not suit the fit; nothing is written then.
    """
    compared = None if reference is None else tables.comparison(compare(result, reference), reference)
    images = rendered(FIGURES, result, result.experiment, result.records, style, progress)
    verdict, drawn = judge(result), {image.picture.record for image in images}
    html = framed(
        "fit.html",
        images,
        style,
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
    return write_page(html, images, folder)
