"""`report.html` of a diagnosis: one page that stands alone, with every image inside, and the plots beside it."""

import re
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from markupsafe import Markup, escape

from identification.diagnosis.diagnosis import MISSING, Diagnosis
from identification.diagnosis.files import diagnosis_provenance
from identification.report.base import SCREEN, PageStyle, Progress, framed, rendered, write_page
from identification.report.contact import restitution_of_both
from identification.report.decay import ring_downs_of_both
from identification.report.diagnosis import tables
from identification.report.diagnosis.figures import before_after, missing, missing_over_others, residual_maps
from identification.report.tables import load_words, reading_errors
from identification.wording.numbers import grouped, joined

FIGURES = (missing, before_after, missing_over_others, residual_maps, restitution_of_both, ring_downs_of_both)
_GREEK = {"Omega": "Ω", "delta": "δ", "lambda": "λ", "omega": "ω", "zeta": "ζ", "tau": "τ", "pi": "π", "phi": "φ"}
_SIGNS = (("->", "→"), ("<=", "≤"), (">=", "≥"), ("-", "−"), ("&#39;&#39;", "″"), ("&#39;", "′"), (" * ", " · "))


def write_diagnosis_report(
    diagnosis: Diagnosis,
    folder: Path,
    *,
    provenance: Mapping[str, Any] | None = None,
    style: PageStyle = SCREEN,
    progress: Progress = lambda stage: None,
) -> list[Path]:
    """Write `report.html`, and every plot as PNG, with a style for paper also as PDF.

    Arguments and result are those of `identification.report.write_report`.
    """
    records = diagnosis.nominal.records
    images = rendered(FIGURES, diagnosis, diagnosis.experiment, records, style, progress)
    drawn, listed = {image.picture.record for image in images}, tables.strongest(diagnosis)
    fitted = [one for one in listed if one.drop is not None] or list(listed[:5])
    html = framed(
        "diagnosis.html",
        images,
        style,
        next_steps=tables.next_steps(diagnosis),
        provenance=diagnosis_provenance(diagnosis) if provenance is None else provenance,
        seconds=diagnosis.seconds,
        filters={"equation": equation_html},
        diagnosis=diagnosis,
        tables=tables,
        load=load_words(diagnosis.nominal_model),
        missing=diagnosis.verdict == MISSING,
        candidates=tables.candidates(diagnosis, fitted),
        further=tables.candidates(diagnosis, [one for one in listed if one not in fitted]),
        more=max(len(diagnosis.considered) - len(listed), 0),
        undrawn=joined([record.file for record in records if record.file not in drawn]),
        unread=grouped(diagnosis.ring_downs.left_out.items()),
        readings=reading_errors(diagnosis.reading_error, diagnosis.experiment),
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
