"""Pictures as a page holds them: drawn, stated, and written as SVG inside the page and PNG beside it, for paper PDF too."""

import dataclasses
from collections.abc import Iterable
from pathlib import Path

from markupsafe import Markup

from identification.experiment import Experiment
from identification.report.figures.base import Picture
from identification.report.figures.zoom import zoom_data
from identification.report.inline_svg import inline_svg
from identification.report.page_style import PageStyle
from identification.report.subject import subject
from identification.result.result import RecordFit
from vibrojax.drawing import footnote, pdf, png, style

SCREEN_DPI = 118
"""Pixels an inch at which a page shows a figure, if it has the room."""


@dataclasses.dataclass(frozen=True, kw_only=True)
class Image:
    """A picture as the page holds it.

    Attributes:
        name, section, record, caption, alt: as of the picture.
        width: pixels across, where there is room.
        svg: an element of the page.
        data: attributes of the element around it, without `data-`; empty where it cannot be zoomed.
        files: content of the files beside the page, by suffix.
    """

    name: str
    section: str
    record: str | None
    caption: str
    alt: str
    width: int
    svg: Markup
    data: dict[str, str]
    files: dict[str, bytes]


def rendered(pictures: Iterable[Picture], experiment: Experiment, records: tuple[RecordFit, ...], look: PageStyle) -> list[Image]:
    """Draw the pictures one by one, state below each what it is about, and render it."""
    with style():
        return [
            _image(picture, f"p{number}", subject(experiment, records, picture.record), look)
            for number, picture in enumerate(pictures, start=1)
        ]


def by_section(images: list[Image]) -> dict[str, list[Image]]:
    """The images of each section of a page, in their order."""
    return {section: [image for image in images if image.section == section] for section in {image.section for image in images}}


def write_page(html: str, images: list[Image], folder: Path) -> list[Path]:
    """Write `report.html`, and the files of its images beside it; returns the paths, the page first."""
    written = [folder / "report.html"]
    written[0].write_text(html, encoding="utf-8")
    for image in images:
        for suffix, content in image.files.items():
            written.append(folder / f"{image.name}.{suffix}")
            written[-1].write_bytes(content)
    return written


def _image(picture: Picture, short: str, stated: str, look: PageStyle) -> Image:
    footnote(picture.figure, stated)
    return Image(
        name=picture.name,
        section=picture.section,
        record=picture.record,
        caption=picture.caption,
        alt=picture.alt,
        width=round(SCREEN_DPI * float(picture.figure.get_figwidth())),
        svg=Markup(inline_svg(picture.figure, short, picture.alt)),
        data=zoom_data(picture.panels) if picture.panels else {},
        files={"png": png(picture.figure)} | ({"pdf": pdf(picture.figure)} if look.pdf else {}),
    )
