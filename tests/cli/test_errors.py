"""A reader that goes away does not end the work; a full disk is one line."""

import os
import subprocess
import sys

import pytest

SAY = """
import sys, typer
from vibrojax.cli.errors import run
app = typer.Typer()
@app.command()
def say():
    for stream in (sys.stdout, sys.stderr):
        for number in range(20_000):
            print(number, file=stream)
    open("done", "w").close()
sys.argv = ["say"]
run(app)
"""


def status(folder, name: str, target: int) -> tuple[int, str]:
    """Exit status with one of the streams sent to a target, and the end of the other one."""
    other = {"stdout": "stderr", "stderr": "stdout"}[name]
    pipes = {name: target, other: subprocess.PIPE}
    done = subprocess.run([sys.executable, "-c", SAY], cwd=folder, text=True, **pipes)
    os.close(target)
    assert (folder / "done").exists()
    return done.returncode, (done.stdout or done.stderr or "").splitlines()[-1]


@pytest.mark.parametrize("name", ["stdout", "stderr"])
def test_a_closed_pipe_changes_nothing(name, tmp_path):
    reading, writing = os.pipe()
    os.close(reading)
    assert status(tmp_path, name, writing) == (0, "19999")


def test_a_full_disk_behind_the_output_is_one_line(tmp_path):
    found = status(tmp_path, "stdout", os.open("/dev/full", os.O_WRONLY))
    assert found == (2, "error: standard output cannot be written (No space left on device): make room, or send it elsewhere")


def test_a_full_disk_behind_the_messages_changes_nothing(tmp_path):
    assert status(tmp_path, "stderr", os.open("/dev/full", os.O_WRONLY)) == (0, "19999")
