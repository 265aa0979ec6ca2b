"""A report's page as a browser would read it."""

import base64
import io
from html.parser import HTMLParser

import numpy as np
from PIL import Image

VOID = {"meta", "img", "br", "link", "hr"}
_PNG = "data:image/png;base64,"


class Checked(HTMLParser):
    """Balanced tags, addresses, images and texts of a page, headings of its tables, and the tags around these."""

    def __init__(self):
        super().__init__()
        self.open, self.addresses, self.alts, self.images, self.text = [], [], [], [], ""
        self.boxes, self.before = [], ""
        self.details = 0

    def handle_starttag(self, tag, attrs):
        if tag == "table":
            self.boxes.append(self.before)
        self.before = self.get_starttag_text()
        if tag not in VOID:
            self.open.append(tag)
        given = dict(attrs)
        self.addresses += [value for name, value in attrs if name in ("src", "href", "srcset", "action")]
        self.details += tag == "details"
        if tag == "img":
            self.alts.append(given.get("alt"))
            assert given["src"].startswith(_PNG)
            self.images.append(base64.b64decode(given["src"].removeprefix(_PNG)))

    def handle_endtag(self, tag):
        assert self.open.pop() == tag

    def handle_data(self, data):
        assert "script" not in self.open
        if "style" not in self.open:
            self.text += data


def read(path):
    page = Checked()
    page.feed(path.read_text(encoding="utf-8"))
    assert page.open == []
    page.text = " ".join(page.text.split())
    return page


def is_grey(content):
    """Whether no pixel of an image has a hue."""
    with Image.open(io.BytesIO(content)) as image:
        return np.ptp(np.asarray(image.convert("RGB")).astype(int), axis=2).max() <= 2
