"""Every notebook runs in a fresh process; its last cell asserts what its text claims. What was built from it is what it says."""

import json
import os
import subprocess
import sys

import pytest

from tests.conftest import ROOT

NOTEBOOKS = sorted((ROOT / "notebooks").glob("*.py"))
BUILT = sorted((ROOT / "notebooks").glob("*.ipynb"))
LARGEST = 300_000
"""Bytes of a built notebook."""


SIMULATING = ("dynamics", "hammer_design", "smooth_to_discontinuous")
"""Notebooks that simulate more than they compile; the others are compiled with fewer optimisations where they run small."""


@pytest.mark.parametrize("size", ["small", pytest.param("full", marks=pytest.mark.thorough)])
@pytest.mark.parametrize("script", NOTEBOOKS, ids=lambda path: path.stem)
def test_notebook_runs(script, size):
    """The percent script from top to bottom."""
    environment = {**os.environ, "MPLBACKEND": "agg", "VIBROJAX_NOTEBOOKS": size}
    if size == "small" and script.stem not in SIMULATING:
        environment["JAX_DISABLE_MOST_OPTIMIZATIONS"] = "1"
    done = subprocess.run([sys.executable, str(script)], cwd=ROOT, env=environment, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr


@pytest.mark.parametrize("built_file", BUILT, ids=lambda path: path.stem)
def test_built_notebook_is_that_of_the_script(built_file):
    """No cell of the source was changed after the last build; everything ran, without an error."""
    script, text = built_file.with_suffix(".py"), built_file.read_text(encoding="utf-8")
    assert len(text) < LARGEST
    cells = json.loads(text)["cells"]
    code = [cell for cell in cells if cell["cell_type"] == "code"]
    built = ["".join(cell["source"]) if cell in code else _commented(cell) for cell in cells]
    assert built == [part.partition("\n")[2].strip() for part in script.read_text(encoding="utf-8").split("# %%")[1:]]
    assert all(cell["execution_count"] for cell in code)
    assert not [output for cell in code for output in cell["outputs"] if output["output_type"] == "error"]


def test_there_are_notebooks():
    """An empty folder would pass unseen, and so would a script that nobody has built."""
    assert NOTEBOOKS
    assert [path.stem for path in NOTEBOOKS] == [path.stem for path in BUILT]


def _commented(cell: dict) -> str:
    """A cell of text as the percent script has it."""
    lines = "".join(cell["source"]).split("\n")
    return "\n".join(f"# {line}".rstrip() for line in lines)
