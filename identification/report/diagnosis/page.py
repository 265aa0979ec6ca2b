"""`report.html` of a diagnosis: one page that stands alone, with every image inside, and the plots beside it."""

import re
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from markupsafe import Markup, escape

from identification.diagnosis.diagnosis import MISSING, Diagnosis
from identification.report.base import SCREEN, PageStyle, Picture, Progress, framed, rendered, write_page
from identification.report.contact import restitution_of_both
from identification.report.decay import left_out, ring_downs_of_both
from identification.report.diagnosis import tables
from identification.report.diagnosis.figures import before_after, loop_kink, missing, missing_over_others, residual_maps
from identification.report.diagnosis.json_file import diagnosis_provenance
from identification.report.tables import load_words
from identification.wording.lists import joined

FIGURES = (missing, before_after, missing_over_others, loop_kink, residual_maps, restitution_of_both, ring_downs_of_both)
_GREEK = {"Omega": "Ω", "delta": "δ", "lambda": "λ", "omega": "ω", "zeta": "ζ", "tau": "τ", "pi": "π", "phi": "φ"}
_SIGNS = (("->", "→"), ("<=", "≤"), (">=", "≥"), ("-", "−"), ("&#39;&#39;", "″"), ("&#39;", "′"), (" * ", " · "))


def pictures(diagnosis: Diagnosis, style: PageStyle) -> list[Picture]:
    """Every figure of the page, drawn; within `vibrojax.drawing.style`."""
    return [picture for drawer in FIGURES for picture in drawer(diagnosis, style)]


def write_diagnosis_report(
    diagnosis: Diagnosis,
    folder: Path,
    *,
    provenance: Mapping[str, Any] | None = None,
    style: PageStyle = SCREEN,
    progress: Progress = lambda stage: None,
) -> list[Path]:
    """Write `report.html`, and every plot as PNG, with a style for paper also as PDF.

    Args:
        diagnosis: of one experiment.
        folder: that receives the files; it must exist.
        provenance: as in `diagnosis.json`; by default that of the diagnosis.
        style: in colours, or in black and white.
        progress: called with a line of text for each figure.

    Returns:
        Paths of the files, the page first.
    """
    records = diagnosis.nominal.records
    images = rendered(lambda: pictures(diagnosis, style), diagnosis.experiment, records, style, progress)
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
        load=load_words(diagnosis.nominal_model),
        missing=diagnosis.verdict == MISSING,
        headline=tables.headline(diagnosis),
        looked_for=tables.looked_for(diagnosis),
        warnings=tables.warnings(diagnosis),
        place=tables.place(diagnosis),
        effects=[
            {"effect": one.effect, "where": tables.where(one), "probability": tables.probability_text(one.probability), "numbers": found}
            for one in diagnosis.effects
            for found in (tables.numbers(one.reported, one.effect.parameters),)
        ],
        ambiguous=joined([tables.effect_words(name) for name in diagnosis.ambiguous_with]),
        learned=tables.learned(diagnosis),
        changes=tables.changes(diagnosis),
        errors=tables.errors(diagnosis),
        misfits=tables.misfits(diagnosis),
        scatter=tables.scatter(diagnosis),
        candidates=tables.candidates(diagnosis, fitted),
        further=tables.candidates(diagnosis, [one for one in listed if one not in fitted]),
        more=max(len(diagnosis.considered) - len(listed), 0),
        undrawn=joined([record.file for record in records if record.file not in drawn]),
        unread=left_out(diagnosis.ring_downs),
        notices=tables.notices(diagnosis),
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
