"""`report.html` of a fit: one page that stands alone, with every image and the script that zooms inside."""

from collections.abc import Mapping
from typing import Any

from identification.experiment import Experiment
from identification.report import rows
from identification.report.figures.ring_downs import left_out
from identification.report.frame import framed
from identification.report.image import Image
from identification.report.next_steps import next_steps
from identification.report.page_style import PageStyle
from identification.report.verdict import judge
from identification.result.reference import Reference, compare, unmatched
from identification.result.result import FitResult, RecordFit
from identification.wording.numbers import significant


def page(
    result: FitResult, images: list[Image], style: PageStyle, *, reference: Reference | None = None, provenance: Mapping[str, Any]
) -> str:
    """The whole page.

    Args:
        result: of the fit.
        images: in the order in which they appear within their section.
        style: of the images.
        reference: known values to set beside the fitted ones.
        provenance: as in `fit.json`.

    Returns:
        HTML without any address outside itself.

    Raises:
        InputError: the reference does not suit the fit.
    """
    comparisons = compare(result, reference) if reference is not None else ()
    verdict = judge(result)
    return framed(
        "identification.report",
        images,
        style,
        next_steps=next_steps(result, verdict),
        provenance=provenance,
        seconds=result.seconds,
        result=result,
        verdict=verdict,
        load=rows.load_words(result.model),
        parameters=rows.parameter_rows(result),
        derived=rows.derived_rows(result),
        reasons=rows.reasons(result),
        alone=rows.alone_rows(result),
        wishes=rows.wishes(result),
        posterior=rows.posterior_rows(result),
        posterior_words=rows.posterior_words(result),
        reference=reference,
        comparisons=rows.comparison_rows(comparisons),
        not_compared=unmatched(comparisons, reference) if reference is not None else (),
        records=[_record(record, result.experiment, images) for record in result.records],
        unfitted=rows.unfitted_words(result),
        held_back=[_record(record, result.experiment, []) for record in result.held_back],
        samples=sum(record.samples for record in result.records),
        windows=sum(record.windows for record in result.records),
        correlations=rows.correlations(result),
        listed_from=rows.LISTED_FROM,
        starts=sorted(result.starts, key=lambda start: start.final_cost),
        unread=left_out(result.ring_downs),
        shift=significant(result.discretisation, 2),
    )


def _record(record: RecordFit, experiment: Experiment, images: list[Image]) -> dict[str, Any]:
    """What the page says about one record."""
    read = rows.recorded(record, experiment)
    return {
        "file": record.file,
        "kind": record.kind,
        "gap": rows.gap_in_mm(record),
        "frequency": None if read is None else read.excitation_frequency,
        "samples": record.samples,
        "windows": record.windows,
        "channels": rows.channel_rows(record, experiment),
        "nuisances": rows.nuisance_rows(record),
        "notices": record.notices,
        "images": [image for image in images if image.section == "records" and image.record == record.file],
    }
