"""Pictures as a page holds them: rendered, and embedded so that the page stands alone."""

import base64
import dataclasses
from collections.abc import Iterable
from pathlib import Path

from identification.report.figures.base import Picture
from vibrojax.drawing import png, style

SCREEN_DPI = 118
"""Pixels an inch at which a page shows a figure, if it has the room."""


@dataclasses.dataclass(frozen=True, kw_only=True)
class Image:
    """A picture as the page holds it."""

    name: str
    section: str
    record: str | None
    caption: str
    alt: str
    width: int
    height: int
    png: bytes

    @property
    def source(self) -> str:
        """Address that holds the image itself."""
        return "data:image/png;base64," + base64.b64encode(self.png).decode("ascii")


def rendered(pictures: Iterable[Picture]) -> list[Image]:
    """Draw the pictures one by one, and render each in few colours."""
    with style():
        return [_image(picture) for picture in pictures]


def by_section(images: list[Image]) -> dict[str, list[Image]]:
    """The images of each section of a page, in their order."""
    return {section: [image for image in images if image.section == section] for section in {image.section for image in images}}


def write_page(html: str, images: list[Image], folder: Path) -> list[Path]:
    """Write `report.html`, and each of its images as a PNG file beside it; returns the paths, the page first."""
    written = [folder / "report.html"]
    written[0].write_text(html, encoding="utf-8")
    for image in images:
        written.append(folder / f"{image.name}.png")
        written[-1].write_bytes(image.png)
    return written


def _image(picture: Picture) -> Image:
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
