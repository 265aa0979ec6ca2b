"""The example files of the page on extensions: each is a module that works, and its tests pass."""

import inspect
import re
import sys
import types
from pathlib import Path

PAGE = Path(__file__).resolve().parents[2] / "docs" / "extending.md"
FILE = re.compile(r"^`(?P<path>[\w/]+)\.py`:\n\n<!-- [^\n]+ -->\n```python\n(?P<code>.*?)^```", re.MULTILINE | re.DOTALL)


def test_example_files_work_and_pass_their_tests(monkeypatch, tmp_path):
    tests = 0
    for found in FILE.finditer(PAGE.read_text(encoding="utf-8")):
        name = found["path"].replace("/", ".")
        module = types.ModuleType(name)
        monkeypatch.setitem(sys.modules, name, module)
        exec(compile(found["code"], found["path"], "exec"), vars(module))
        assert module.__doc__, f"{name} has no docstring"
        for test in [one for one in vars(module).values() if inspect.isfunction(one) and one.__name__.startswith("test_")]:
            test(**{argument: tmp_path for argument in inspect.signature(test).parameters})
            tests += 1
    assert tests == 4


def test_listings_have_the_place_that_the_page_shows():
    listings = re.findall(
        r"^In `([\w/]+\.py)` .*?\n```diff\n\+from [^\n]+\n # isort: on\n```", PAGE.read_text(encoding="utf-8"), re.MULTILINE | re.DOTALL
    )
    assert len(listings) == 3
    assert all((PAGE.parents[1] / path).read_text(encoding="utf-8").count("\n# isort: on\n") == 1 for path in listings)
