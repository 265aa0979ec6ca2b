"""A report's page as a browser would read it."""

import base64
import io
import json
import re
import zlib
from html.parser import HTMLParser
from xml.etree import ElementTree

import numpy as np
from PIL import Image

VOID = {"meta", "img", "br", "link", "hr"}
_COLOUR = re.compile(r"#([0-9a-fA-F]{6}|[0-9a-fA-F]{3})\b")
_WORD = re.compile(r"(?:fill|stroke|stop-color|color)\s*:\s*([a-z]+)")


class Checked(HTMLParser):
    """Balanced tags, addresses and texts of a page, its SVG and what can be zoomed, and the tags around its tables."""

    def __init__(self):
        super().__init__()
        self.open, self.addresses, self.alts, self.text = [], [], [], ""
        self.boxes, self.before, self.ids, self.zooms = [], "", [], []
        self.script = ""

    def handle_starttag(self, tag, attrs):
        if tag == "table":
            self.boxes.append(self.before)
        self.before = self.get_starttag_text()
        if tag not in VOID:
            self.open.append(tag)
        given = dict(attrs)
        self.addresses += [value for name, value in attrs if name in ("src", "href", "srcset", "action")]
        self.ids += [given["id"]] if "id" in given else []
        self.alts += [given.get("aria-label")] if given.get("role") == "img" else []
        self.zooms += [(json.loads(given["data-zoom"]), given["data-samples"])] if "data-zoom" in given else []

    def handle_endtag(self, tag):
        assert self.open.pop() == tag

    def handle_data(self, data):
        if self.open and self.open[-1] == "script":
            self.script += data
        elif "svg" not in self.open and "style" not in self.open:
            self.text += data


def read(path):
    page = Checked()
    page.feed(path.read_text(encoding="utf-8"))
    assert page.open == []
    page.text = " ".join(page.text.split())
    return page


def svgs(path):
    """Every figure of a page, parsed as XML."""
    return [ElementTree.fromstring(one) for one in re.findall(r"<svg .*?</svg>", path.read_text(encoding="utf-8"), re.DOTALL)]


def is_grey(svg):
    """Whether no colour of a figure, the images in it included, has a hue."""
    text = ElementTree.tostring(svg, encoding="unicode")
    words = set(_WORD.findall(text)) - {"none", "url"}
    assert words <= {"white", "black"}, words
    values = [
        value if len(value) == 6 else "".join(2 * one for one in value) for value in _COLOUR.findall(re.sub(r"url\(#[^)]*\)", "", text))
    ]
    images = [one.attrib["href"].partition(",")[2] for one in svg.iter("image")]
    return all(value[:2] == value[2:4] == value[4:] for value in values) and all(_grey_image(base64.b64decode(one)) for one in images)


def _grey_image(data):
    pixels = np.asarray(Image.open(io.BytesIO(data)).convert("RGBA")).astype(int)
    return np.ptp(pixels[pixels[..., 3] > 0][:, :3], axis=1).max(initial=0) == 0


def unpacked(zoom, samples):
    """The series that travel with a figure, as the script reads them."""
    data, begin, found = np.frombuffer(zlib.decompress(base64.b64decode(samples)), np.uint8), 0, []
    for track in zoom["tracks"]:
        planes = data[begin : begin + 4 * track["count"]].reshape(4, -1).astype(np.int64)
        folded = sum(planes[k] << (8 * k) for k in range(4))
        steps = np.cumsum(np.where(folded % 2, -(folded + 1) // 2, folded // 2))
        found.append(np.where(steps == -(2**30), np.nan, track["origin"] + track["step"] * steps))
        begin += 4 * track["count"]
    assert begin == len(data)
    return found
