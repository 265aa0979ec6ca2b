"""Files that the pages name are there."""

import re
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
PAGES = sorted([ROOT / "README.md", ROOT / "CONTRIBUTING.md", *(ROOT / "docs").rglob("*.md")])
NAMED = re.compile(r"`((?:vibrojax|identification|benchmarks|tests|notebooks|data|docs)/[\w./-]*)`")
EXAMPLE = re.compile(r"/(test_)?my_|NAME")
"""Of a file that the reader is to write."""


def test_every_file_that_a_page_names_is_there():
    named = {(page.name, path) for page in PAGES for path in NAMED.findall(page.read_text(encoding="utf-8"))}
    assert len(named) > 50
    assert not {(page, path) for page, path in named if not EXAMPLE.search(path) and not (ROOT / path).exists()}


def test_no_page_has_a_gap_to_be_filled():
    assert not [(page.name, gap) for page in PAGES for gap in re.findall(r"@[A-Z]+@|\bTODO\b|\bTBD\b", page.read_text(encoding="utf-8"))]
