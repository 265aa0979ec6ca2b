"""The page of all figures of the thesis's rigs, beside the figures of the thesis that they answer to.

    python docs/generate/gallery.py FOLDER

makes the gallery of every preset in FOLDER (`vibrojax gallery NAME --out FOLDER/NAME`; one that is there already is kept), writes
docs/gallery.md, and puts the figures, made small, into docs/images/gallery.
"""

import re
import subprocess
import sys
from pathlib import Path

from PIL import Image

from vibrojax.presets import NAMES

DOCS = Path(__file__).resolve().parent.parent
IMAGES = DOCS / "images" / "gallery"
_WIDTH, _WIDE = 500, 720
_HEAD = """# Gallery: the thesis's figures

Every figure of the thesis that a model can draw, drawn from the [presets](presets.md), beside the words of the thesis's list of figures
(shortened). The thesis's pictures are not at hand: what the list states can be compared, and nothing else. The presets are rigs that
reproduce what the front matter states as far as one can; forces scale with a mass that is assumed.

`vibrojax gallery wires --style paper --out wires` makes the figures of one rig for print, with captions and data. This page is made by

    python docs/generate/gallery.py FOLDER

"""


def small(source: Path, target: Path) -> None:
    """A figure in few pixels and colours."""
    with Image.open(source) as image:
        is_map = image.width > 1200
        width = _WIDE if is_map else _WIDTH
        picture = image.convert("RGB").resize((width, round(image.height * width / image.width)), Image.Resampling.LANCZOS)
    picture.quantize(128 if is_map else 64, dither=Image.Dither.NONE).save(target, optimize=True)


def section(name: str, folder: Path) -> str:
    """The page of one preset as a section, its images copied."""
    text = re.sub(r"^#", "##", (folder / "index.md").read_text(encoding="utf-8"), flags=re.MULTILINE)
    for stem in re.findall(r"\]\(([\w.-]+)\.png\)", text):
        small(folder / f"{stem}.png", IMAGES / f"{name}_{stem}.png")
    text = re.sub(r"\]\(([\w.-]+\.png)\)", rf"](images/gallery/{name}_\1)", text)
    return re.sub(r" \[Caption\]\([^)]*\)\.", "", text)


def main() -> None:
    """Make what is missing, then the page."""
    root = Path(sys.argv[1])
    root.mkdir(parents=True, exist_ok=True)
    for name in NAMES:
        if not (root / name / "index.md").is_file():
            command = "from vibrojax.cli.main import main; main()"
            subprocess.run([sys.executable, "-c", command, "gallery", name, "--out", str(root / name)], check=True)
    IMAGES.mkdir(parents=True, exist_ok=True)
    for image in IMAGES.glob("*.png"):
        image.unlink()
    text = _HEAD + "\n".join(section(name, root / name) for name in NAMES)
    (DOCS / "gallery.md").write_text(text.rstrip() + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
