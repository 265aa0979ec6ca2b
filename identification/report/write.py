"""From a fit to files: the plots and the page."""

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

from identification.reference import Reference, compare
from identification.report.figures import FIGURES
from identification.report.figures.base import SCREEN_DPI
from identification.report.page import Image, page
from identification.result import FitResult
from identification.result_json import provenance as provenance_of
from vibrojax.drawing import png, style


def write_report(
    result: FitResult,
    folder: Path,
    *,
    reference: Reference | None = None,
    provenance: Mapping[str, Any] | None = None,
    progress: Callable[[str], None] | None = None,
) -> list[Path]:
    """Write `report.html` and one PNG file a plot.

    Args:
        result: of the fit.
        folder: that receives the files; it must exist.
        reference: known values to set beside the fitted ones.
        provenance: as in `fit.json`; by default that of the result.
        progress: told before the drawing begins.

    Returns:
        Paths of the files, the page first.

    Raises:
        InputError: the reference does not suit the fit; nothing is written then.
    """
    if reference is not None:
        compare(result, reference)
    if progress is not None:
        progress("drawing the report")
    images = draw(result)
    html = page(result, images, reference=reference, provenance=provenance_of(result) if provenance is None else provenance)
    written = [folder / "report.html"]
    written[0].write_text(html, encoding="utf-8")
    for image in images:
        written.append(folder / f"{image.name}.png")
        written[-1].write_bytes(image.png)
    return written


def draw(result: FitResult) -> list[Image]:
    """Every figure of the report, rendered."""
    images = []
    with style():
        for drawer in FIGURES:
            for picture in drawer(result):
                width, height = picture.figure.get_size_inches()
                images.append(
                    Image(
                        name=picture.name,
                        section=picture.section,
                        record=picture.record,
                        caption=picture.caption,
                        alt=picture.alt,
                        width=round(SCREEN_DPI * width),
                        height=round(SCREEN_DPI * height),
                        png=png(picture.figure),
                    )
                )
    return images
