"""The frame that every page has: head, look on screen and on paper, and where it all came from at the end."""

from collections.abc import Callable, Mapping
from typing import Any

import jinja2

from identification.wording.numbers import significant, unit_text
from identification.wording.symbols import prose_html, symbol_html


def page_template(package: str, filters: Mapping[str, Callable[..., Any]] | None = None) -> jinja2.Template:
    """The page `template.html` of a package, which extends `frame.html`.

    What is not marked as HTML is escaped, and a misspelt name is an error. The frame itself needs `provenance`, `seconds` and `stages`.

    Args:
        package: in which the template lies.
        filters: beside `symbol`, `prose`, `number` and `unit`.
    """
    environment = jinja2.Environment(
        loader=jinja2.ChoiceLoader([jinja2.PackageLoader(name, "") for name in (package, "identification.report")]),
        autoescape=True,
        undefined=jinja2.StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    environment.filters.update({"symbol": symbol_html, "prose": prose_html, "number": significant, "unit": unit_text}, **(filters or {}))
    return environment.get_template("template.html")
