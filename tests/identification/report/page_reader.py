"""A report's page as a browser would read it."""

from html.parser import HTMLParser

VOID = {"meta", "img", "br", "link", "hr"}


class Checked(HTMLParser):
    """Balanced tags, addresses and texts of a page, and the tags around its tables."""

    def __init__(self):
        super().__init__()
        self.open, self.addresses, self.alts, self.text = [], [], [], ""
        self.boxes, self.before = [], ""

    def handle_starttag(self, tag, attrs):
        if tag == "table":
            self.boxes.append(self.before)
        self.before = self.get_starttag_text()
        if tag not in VOID:
            self.open.append(tag)
        self.addresses += [value for name, value in attrs if name in ("src", "href", "srcset", "action")]
        self.alts += [dict(attrs).get("alt") for _ in [0] if tag == "img"]

    def handle_endtag(self, tag):
        assert self.open.pop() == tag

    def handle_data(self, data):
        self.text += data


def read(path):
    page = Checked()
    page.feed(path.read_text(encoding="utf-8"))
    assert page.open == []
    page.text = " ".join(page.text.split())
    return page
