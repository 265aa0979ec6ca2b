"""Every notebook runs in a fresh process; its last cell asserts what its text claims."""

import subprocess
import sys

import pytest

from tests.conftest import ROOT

NOTEBOOKS = sorted((ROOT / "notebooks").glob("*.py"))


@pytest.mark.parametrize("script", NOTEBOOKS, ids=lambda path: path.stem)
def test_notebook_runs(script):
    """The percent script as it stands, from top to bottom."""
    done = subprocess.run([sys.executable, str(script)], cwd=ROOT, capture_output=True, text=True, timeout=600, check=False)
    assert done.returncode == 0, done.stderr


def test_there_are_notebooks():
    """An empty folder would pass unseen."""
    assert NOTEBOOKS
