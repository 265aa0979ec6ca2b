"""The frame that every page has: look on screen and on paper, one order of sections, and where it all came from at the end."""

import re
from collections.abc import Callable, Mapping
from importlib import resources
from typing import Any

import jinja2
from markupsafe import Markup

from identification.report.image import Image, by_section
from identification.report.page_style import PageStyle
from identification.wording.names import prose_html, symbol_html
from identification.wording.numbers import significant, unit_text


def framed(
    package: str,
    images: list[Image],
    style: PageStyle,
    *,
    next_steps: tuple[str, ...],
    provenance: Mapping[str, Any],
    seconds: Mapping[str, float],
    filters: Mapping[str, Callable[..., Any]] | None = None,
    **content: Any,
) -> str:
    """The page `template.html` of a package, which extends `frame.html`: verdict, numbers, pictures, what to do next, provenance.

    What is not marked as HTML is escaped, and a misspelt name is an error. The page has no address outside itself.

    Args:
        package: in which the template lies.
        images: in the order in which they appear within their section.
        style: of the images, and of the page.
        next_steps: sentences.
        provenance: as in the JSON file of the results.
        seconds: wall time by stage, s; with "total", that alone is shown.
        filters: beside `symbol`, `prose`, `number`, `unit` and `step`.
        content: of the template.
    """
    environment = jinja2.Environment(
        loader=jinja2.ChoiceLoader([jinja2.PackageLoader(name, "") for name in (package, __package__ or "")]),
        autoescape=True,
        undefined=jinja2.StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    own = {"symbol": symbol_html, "prose": prose_html, "number": significant, "unit": unit_text, "step": _step_html}
    environment.filters.update(own, **(filters or {}))
    script = resources.files(__package__ or "").joinpath("zoom.js").read_text(encoding="utf-8")
    return environment.get_template("template.html").render(
        images=by_section(images),
        style=style,
        script=Markup(script) if any(image.data for image in images) else "",
        next_steps=next_steps,
        provenance=provenance,
        seconds=seconds.get("total", sum(seconds.values())),
        stages={} if "total" in seconds else seconds,
        **content,
    )


def _step_html(text: str) -> Markup:
    """A sentence with commands between back quotes."""
    return Markup(re.sub(r"`([^`]+)`", r"<code>\1</code>", str(prose_html(text))))
