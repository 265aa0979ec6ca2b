"""Every Python example in the pages and in the README runs, and prints what the text block behind it says."""

import re
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
PAGES = sorted([ROOT / "README.md", *(ROOT / "docs").rglob("*.md")])
BLOCK = re.compile(
    r"(?P<skipped><!-- not run by the tests: [^\n]+ -->\n)?```python\n(?P<code>.*?)```\n(\n```text\n(?P<output>.*?)```\n)?", re.DOTALL
)


def blocks(page):
    """Line, code and expected output of every block that is to run."""
    text = page.read_text(encoding="utf-8")
    return [(text.count("\n", 0, b.start("code")), b["code"], b["output"]) for b in BLOCK.finditer(text) if not b["skipped"]]


WITH_CODE = [page for page in PAGES if blocks(page)]


def test_there_are_examples():
    assert {page.name for page in WITH_CODE} >= {"README.md", "index.md"}


@pytest.mark.parametrize("page", WITH_CODE, ids=lambda page: str(page.relative_to(ROOT)))
def test_examples_run(page, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("VIBROJAX_CACHE", "")
    names = {"__name__": "example"}
    for line, code, expected in blocks(page):
        exec(compile("\n" * line + code, str(page), "exec"), names)
        printed = capsys.readouterr().out
        assert expected is None or printed == expected, f"{page.name}, line {line}"
