"""What the site's build adds to the pages: the command line's reference, the catalogue of effects, and equations as MathML.

Equations become MathML while the site is built (`latex2mathml`), which every browser of today draws by itself: no script, no font and no
server are needed to read them.
"""

import html
import re
import sys
from pathlib import Path

sys.path[:0] = [str(Path(__file__).resolve().parent), str(Path(__file__).resolve().parent.parent.parent)]

from latex2mathml.converter import convert  # noqa: E402
from pages import PAGES, filled  # noqa: E402

_MATH = re.compile(r'<(?P<tag>span|div) class="arithmatex">\\[(\[](?P<tex>.*?)\\[)\]]</(?P=tag)>', re.DOTALL)


def on_page_markdown(markdown, page, config, files):
    """Fill in what is generated."""
    return filled(page.file.src_uri, markdown) if page.file.src_uri in PAGES else markdown


def on_page_content(content, page, config, files):
    """Turn LaTeX into MathML."""
    return _MATH.sub(_mathml, content)


def _mathml(found):
    block = found["tag"] == "div"
    formula = convert(html.unescape(found["tex"]), display="block" if block else "inline")
    return f'<div class="equation">{formula}</div>' if block else formula
