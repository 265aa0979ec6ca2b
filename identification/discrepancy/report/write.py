"""From a diagnosis to files: the plots and the page."""

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

from identification.discrepancy.diagnosis import Diagnosis
from identification.discrepancy.report.figures import FIGURES
from identification.discrepancy.report.json_file import diagnosis_provenance
from identification.discrepancy.report.page import page
from identification.report.figures import Picture
from identification.report.figures.base import SCREEN_DPI
from identification.report.page import Image
from vibrojax.drawing import png, style


def write_diagnosis_report(
    diagnosis: Diagnosis,
    folder: Path,
    *,
    provenance: Mapping[str, Any] | None = None,
    progress: Callable[[str], None] | None = None,
) -> list[Path]:
    """Write `report.html` and one PNG file a plot.

    Args:
        diagnosis: of one experiment.
        folder: that receives the files; it must exist.
        provenance: as in `diagnosis.json`; by default that of the diagnosis.
        progress: told before the drawing begins.

    Returns:
        Paths of the files, the page first.
    """
    if progress is not None:
        progress("drawing the report")
    images = draw(diagnosis)
    html = page(diagnosis, images, provenance=diagnosis_provenance(diagnosis) if provenance is None else provenance)
    written = [folder / "report.html"]
    written[0].write_text(html, encoding="utf-8")
    for image in images:
        written.append(folder / f"{image.name}.png")
        written[-1].write_bytes(image.png)
    return written


def draw(diagnosis: Diagnosis) -> list[Image]:
    """Every figure of the report, rendered."""
    with style():
        return [_rendered(picture) for drawer in FIGURES for picture in drawer(diagnosis)]


def _rendered(picture: Picture) -> Image:
    width, height = picture.figure.get_size_inches()
    return Image(
        name=picture.name,
        section=picture.section,
        record=picture.record,
        caption=picture.caption,
        alt=picture.alt,
        width=round(SCREEN_DPI * width),
        height=round(SCREEN_DPI * height),
        png=png(picture.figure),
    )
