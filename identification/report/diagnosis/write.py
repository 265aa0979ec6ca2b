"""From a diagnosis to files: the page, and the plots beside it."""

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

from identification.diagnosis.diagnosis import Diagnosis
from identification.diagnosis.files import diagnosis_provenance
from identification.report.diagnosis.figures import FIGURES
from identification.report.diagnosis.page import page
from identification.report.image import Image, rendered, write_page
from identification.report.page_style import SCREEN, PageStyle


def write_diagnosis_report(
    diagnosis: Diagnosis,
    folder: Path,
    *,
    provenance: Mapping[str, Any] | None = None,
    style: PageStyle = SCREEN,
    progress: Callable[[str], None] | None = None,
) -> list[Path]:
    """Write `report.html`, and every plot as PNG, with a style for paper also as PDF.

    Args:
        diagnosis: of one experiment.
        folder: that receives the files; it must exist.
        provenance: as in `diagnosis.json`; by default that of the diagnosis.
        style: in colours, or in black and white.
        progress: called before the drawing begins.

    Returns:
        Paths of the files, the page first.
    """
    if progress is not None:
        progress("drawing the report")
    images = draw(diagnosis, style)
    html = page(diagnosis, images, style, provenance=diagnosis_provenance(diagnosis) if provenance is None else provenance)
    return write_page(html, images, folder)


def draw(diagnosis: Diagnosis, style: PageStyle = SCREEN) -> list[Image]:
    """Every figure of the report, rendered."""
    pictures = (picture for drawer in FIGURES for picture in drawer(diagnosis, style))
    return rendered(pictures, diagnosis.experiment, diagnosis.nominal.records, style)
