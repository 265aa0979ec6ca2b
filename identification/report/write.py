"""From a fit to files: the page, and the plots beside it."""

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

from identification.report.figures import FIGURES
from identification.report.image import Image, rendered, write_page
from identification.report.page import page
from identification.report.page_style import SCREEN, PageStyle
from identification.result.files import provenance as provenance_of
from identification.result.reference import Reference, compare
from identification.result.result import FitResult


def write_report(
    result: FitResult,
    folder: Path,
    *,
    reference: Reference | None = None,
    provenance: Mapping[str, Any] | None = None,
    style: PageStyle = SCREEN,
    progress: Callable[[str], None] | None = None,
) -> list[Path]:
    """Write `report.html`, and every plot as PNG, with a style for paper also as PDF.

    Args:
        result: of the fit.
        folder: that receives the files; it must exist.
        reference: known values to set beside the fitted ones.
        provenance: as in `fit.json`; by default that of the result.
        style: in colours, or in black and white.
        progress: called before the drawing begins.

    Returns:
        Paths of the files, the page first.

    Raises:
        InputError: the reference does not suit the fit; nothing is written then.
    """
    if reference is not None:
        compare(result, reference)
    if progress is not None:
        progress("drawing the report")
    images = draw(result, style)
    html = page(result, images, style, reference=reference, provenance=provenance_of(result) if provenance is None else provenance)
    return write_page(html, images, folder)


def draw(result: FitResult, style: PageStyle = SCREEN) -> list[Image]:
    """Every figure of the report, rendered."""
    pictures = (picture for drawer in FIGURES for picture in drawer(result, style))
    return rendered(pictures, result.experiment, result.records, style)
