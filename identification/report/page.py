"""`report.html` of a fit or a diagnosis: one page that stands alone, with every image inside, and the plots beside it."""

import re
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from markupsafe import Markup, escape

from identification.diagnosis.diagnosis import MISSING, Diagnosis
from identification.diagnosis.files import diagnosis_provenance
from identification.report import diagnosis_tables, tables
from identification.report.base import SCREEN, PageStyle, Progress, framed, rendered, subject, write_page
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
_GREEK = {"Omega": "Ω", "delta": "δ", "lambda": "λ", "omega": "ω", "zeta": "ζ", "tau": "τ", "pi": "π", "phi": "φ"}
_SIGNS = (("->", "→"), ("<=", "≤"), (">=", "≥"), ("-", "−"), ("&#39;&#39;", "″"), ("&#39;", "′"), (" * ", " · "))


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
    images = rendered(FIGURES, result, lambda picture: subject(result.experiment, result.records, picture.record), style, progress)
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


def write_diagnosis_report(
    diagnosis: Diagnosis,
    folder: Path,
    *,
    provenance: Mapping[str, Any] | None = None,
    style: PageStyle = SCREEN,
    progress: Progress = lambda stage: None,
) -> list[Path]:
    """Write `report.html`, and every plot as PNG, with a style for paper also as PDF.

    Arguments and result are those of `write_report`.
    """
    experiment, records = diagnosis.experiment, diagnosis.nominal.records
    images = rendered(FIGURES_OF_DIAGNOSIS, diagnosis, lambda picture: subject(experiment, records, picture.record), style, progress)
    drawn, listed = {image.picture.record for image in images}, diagnosis_tables.strongest(diagnosis)
    fitted = [one for one in listed if one.drop is not None] or list(listed[:5])
    html = framed(
        "diagnosis.html",
        images,
        style,
        next_steps=diagnosis_tables.next_steps(diagnosis),
        provenance=diagnosis_provenance(diagnosis) if provenance is None else provenance,
        seconds=diagnosis.seconds,
        filters={"equation": equation_html},
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
    return write_page(html, images, folder)


def equation_html(text: str) -> Markup:
    """An equation of an effect, written in plain text, with lowered indices, raised powers, Greek letters and proper signs.

    Example:
        >>> print(equation_html("force = -k_3 u^3"))
        force = −k<sub>3</sub> u<sup>3</sup>
        >>> print(equation_html("-3.10(20)e+05 N/m^3 u"))
        −3.10(20) × 10<sup>5</sup> N/m<sup>3</sup> u
    """
    html = str(escape(text))
    html = re.sub(r"(?<=[\d)])e([-+]?\d+)\b", lambda found: f" × 10<sup>{int(found[1])}</sup>", html)
    html = re.sub(r"\^(\w+|\([^)]*\))", lambda found: f"<sup>{found[1].strip('()')}</sup>", html)
    html = re.sub(r"(?<=[^\W\d])(?:_(\w+|\([^)]*\))|(\d+))", lambda found: f"<sub>{(found[1] or found[2]).strip('()')}</sub>", html)
    html = re.sub(rf"\b({'|'.join(_GREEK)})(?=\b|<)", lambda found: _GREEK[found[1]], html)
    for plain, proper in _SIGNS:
        html = html.replace(plain, proper)
    return Markup(html)
