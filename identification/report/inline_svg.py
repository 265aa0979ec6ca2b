"""A figure as SVG inside a page: compact, without an address, and with names that no other figure of the page has.

Matplotlib writes a file that stands alone; several of them in one page would share names and styles. Text remains text.
"""

import base64
import io
import re
from collections.abc import Iterator
from xml.etree import ElementTree

import numpy as np
from matplotlib import rc_context
from matplotlib.figure import Figure
from PIL import Image

from vibrojax.drawing import DENSE_DPI

_XLINK = "{http://www.w3.org/1999/xlink}href"
_FONTS = "'DejaVu Sans',Verdana,sans-serif"
_OWN_FAMILY = re.compile(r"font-family: '?DejaVu Sans'?(?:, [^;]*)?(?:; ?)?")
_CODE = re.compile(r"\\u((?!d[89a-f])[0-9a-f]{4})|\\U000([0-9a-f]{5})")
"""A letter that Matplotlib's fonts lack, as `drawable` writes it; a browser may have it."""
_LOCAL = re.compile(r"#([\w.-]+)")
_STEP = re.compile(r"([MLz])([^MLz]*)")
_NUMBER = re.compile(r"-?\d+\.\d+")
_NO_TURN = re.compile(r"rotate\(-?0 [^)]*\) ?")
_FINE, _COARSE, _LONG = 100, 10, 200
"""Parts of a point to which short and long paths are rounded, and the steps of a long one."""
_SEVERAL = 8
"""Equal marks that become one path."""
_PALETTE = 256
Shift = tuple[int, int]


def inline_svg(figure: Figure, name: str, description: str) -> str:
    """The figure as an `<svg>` element.

    Args:
        figure: drawn.
        name: unique within the page; that of every referenced part begins with it.
        description: for a reader who does not see it.

    Returns:
        XML without namespaces. An artist whose `gid` is "zoomed", and every tick, has that or "tick" as its class.
    """
    stream = io.BytesIO()
    with rc_context({"svg.fonttype": "none", "svg.hashsalt": "report"}):
        figure.savefig(stream, format="svg", dpi=DENSE_DPI, metadata=dict.fromkeys(("Creator", "Date", "Format", "Type")))
    root = ElementTree.fromstring(stream.getvalue())
    for element in root.iter():
        _plain(element)
    _drop_styles(root)
    _rename(root, name)
    for element in root.iter():
        _shrink(element)
    _join_marks(root, name)
    _unwrap(root)
    size = root.attrib["viewBox"]
    root.attrib.clear()
    root.attrib |= {"viewBox": size, "preserveAspectRatio": "xMinYMin", "role": "img", "aria-label": description}
    root.attrib["style"] = f"font-family:{_FONTS};stroke-linejoin:round;stroke-linecap:butt"
    return ElementTree.tostring(root, encoding="unicode")


def _plain(element: ElementTree.Element) -> None:
    """No namespaces, no line breaks, no codes for letters."""
    element.tag = element.tag.rpartition("}")[2]
    if (target := element.attrib.pop(_XLINK, None)) is not None:
        element.attrib["href"] = target
    element.tail = None
    is_text = element.tag in ("text", "tspan")
    element.text = _CODE.sub(lambda found: chr(int(found[1] or found[2], 16)), element.text or "") if is_text else None


def _drop_styles(root: ElementTree.Element) -> None:
    """A style sheet inside a page would hold for all of it."""
    for parent in list(root.iter()):
        for child in [one for one in parent if one.tag in ("style", "metadata") or (one.tag == "defs" and not _kept(one))]:
            parent.remove(child)


def _kept(definitions: ElementTree.Element) -> bool:
    return any(one.tag != "style" for one in definitions)


def _rename(root: ElementTree.Element, name: str) -> None:
    """Names that are referred to become short and the figure's own; the others go, or say which kind of part it is."""
    referred = {found for element in root.iter() for value in _references(element) for found in _LOCAL.findall(value)}
    names = {old: f"{name}-{number}" for number, old in enumerate(sorted(referred))}
    for element in root.iter():
        own = element.attrib.pop("id", "")
        if own in names:
            element.attrib["id"] = names[own]
        elif own == "zoomed" or re.fullmatch(r"[xy]tick_\d+", own):
            element.attrib["class"] = "zoomed" if own == "zoomed" else "tick"
        for key in ("href", "clip-path"):
            if not element.attrib.get(key, "data:").startswith("data:"):
                element.attrib[key] = _LOCAL.sub(lambda found: "#" + names[found[1]], element.attrib[key])
        if "url(" in (style := element.attrib.get("style", "")):  # hatches
            element.attrib["style"] = re.sub(r"url\(#([^)]*)\)", lambda found: f"url(#{names[found[1]]})", style)


def _references(element: ElementTree.Element) -> Iterator[str]:
    for key in ("href", "clip-path"):
        if not (value := element.attrib.get(key, "data:")).startswith("data:"):
            yield value
    yield from re.findall(r"url\(([^)]*)\)", element.attrib.get("style", ""))


def _shrink(element: ElementTree.Element) -> None:
    """Fewer digits, and images in few colours where they have no more."""
    attributes = element.attrib
    if "d" in attributes:
        attributes["d"] = _short_path(attributes["d"])
    if attributes.get("href", "").startswith("data:"):
        attributes["href"] = _few_colours(attributes["href"])
    if "transform" in attributes:
        attributes["transform"] = _NO_TURN.sub("", attributes["transform"])
    for key in ("x", "y", "width", "height", "transform"):
        if key in attributes:
            attributes[key] = _NUMBER.sub(lambda found: _decimal(round(_FINE * float(found[0])), _FINE), attributes[key])
    if not attributes.get("transform", "-"):
        del attributes["transform"]
    if "style" in attributes:
        attributes["style"] = _OWN_FAMILY.sub("", attributes["style"]).replace(": ", ":").replace("; ", ";")


def _join_marks(root: ElementTree.Element, name: str) -> None:
    """Replace many equal marks by one path with an SVG marker at every corner."""
    marks = {element.attrib["id"]: element for element in root.iter() if element.tag == "path" and "id" in element.attrib}
    groups = [element for element in root.iter() if element.tag == "g" and len(element) >= _SEVERAL]
    for number, group in enumerate(groups):
        kinds = {(one.tag, one.attrib.get("href", "")[1:], one.attrib.get("style", "")) for one in group}
        (tag, mark, look), *others = kinds
        if others or tag != "use" or mark not in marks:
            continue
        corner, places = f"{name}-mark-{number}", [f"{one.attrib['x']} {one.attrib['y']}" for one in group]
        marker = ElementTree.Element("marker", {"id": corner, "overflow": "visible", "markerUnits": "userSpaceOnUse"})
        style = ";".join(part for part in (marks[mark].attrib.get("style"), look) if part)
        marker.append(ElementTree.Element("path", {"d": marks[mark].attrib["d"], "style": style}))
        ends = ";".join(f"marker-{end}:url(#{corner})" for end in ("start", "mid", "end"))
        path = "".join(("L" if before else "M") + place for before, place in enumerate(places))
        group[:] = [marker, ElementTree.Element("path", {"d": path, "style": f"fill:none;stroke:none;{ends}"})]


def _unwrap(root: ElementTree.Element) -> None:
    """Replace groups without attributes by their children."""
    for child in root:
        _unwrap(child)
    held: list[ElementTree.Element] = []
    for child in root:
        held += list(child) if child.tag == "g" and not child.attrib else [child]
    root[:] = held


def _short_path(path: str) -> str:
    """A path of straight lines in relative coordinates; one with curves stays in absolute ones."""
    if set(re.findall("[A-Za-z]", path)) - set("MLz"):
        return _NUMBER.sub(lambda found: _decimal(round(_FINE * float(found[0])), _FINE), " ".join(path.split()))
    steps = [(kind, tuple(map(float, place.split()))) for kind, place in _STEP.findall(path)]
    parts = _COARSE if len(steps) > _LONG else _FINE
    pieces, here, begin = [], (0, 0), (0, 0)
    for kind, place in steps:
        if kind == "z":
            pieces.append("z")
            here = begin
            continue
        there = (round(parts * place[0]), round(parts * place[1]))
        moved = there if kind == "M" else (there[0] - here[0], there[1] - here[1])
        if kind == "M" or moved != (0, 0):
            pieces.append(_step("M" if kind == "M" else "l", moved, parts, pieces))
        here, begin = there, there if kind == "M" else begin
    return "".join(pieces)


def _step(kind: str, moved: Shift, parts: int, before: list[str]) -> str:
    """One step; its letter is left out after another of its kind."""
    x, y = (_decimal(one, parts) for one in moved)
    both = x + ("" if y.startswith("-") else " ") + y
    again = kind == "l" and before and before[-1][0] not in "Mz"
    return (("" if both.startswith("-") else " ") if again else kind) + both


def _decimal(number: int, parts: int) -> str:
    """`number` of so many parts of one, in as few letters as possible."""
    text = f"{number / parts:.{len(str(parts)) - 1}f}"
    text = text.rstrip("0").rstrip(".") if "." in text else text
    return re.sub(r"^(-?)0\.", r"\1.", text) if text != "-0" else "0"


def _few_colours(source: str) -> str:
    """An embedded image by the palette of its colours, where they are few."""
    head, _, data = source.partition(",")
    pixels = np.asarray(Image.open(io.BytesIO(base64.b64decode(data))).convert("RGBA"))
    found, index = np.unique(np.ascontiguousarray(pixels).view(np.uint32), return_inverse=True)
    colours = found.view(np.uint8).reshape(-1, 4)
    if len(colours) > _PALETTE:
        return source
    image = Image.fromarray(index.reshape(pixels.shape[:2]).astype(np.uint8), "P")
    image.putpalette(colours[:, :3].tobytes())
    stream = io.BytesIO()
    image.save(stream, "png", optimize=True, transparency=colours[:, 3].tobytes())
    return f"{head},{base64.b64encode(stream.getvalue()).decode('ascii')}"
