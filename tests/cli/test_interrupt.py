"""Ctrl-C ends the process, whatever the program is doing, and leaves nothing behind."""

import os
import signal
import subprocess
import sys
import threading

import pytest

from vibrojax.cli import interrupt

REQUESTS = [signal.SIGINT, signal.SIGTERM, signal.SIGHUP]
BEGIN = """
import os, signal, sys, threading
from pathlib import Path
from vibrojax.cli import interrupt
from vibrojax.cli.output import output_folder
signal.signal(signal.SIGINT, signal.default_int_handler)  # a shell that starts the tests in the background has it ignored
signal.signal(signal.SIGHUP, signal.SIG_DFL)
def press(number={number}): os.kill(os.getpid(), number)
def forever():
    while True: threading.Event().wait(1)
"""


def run(body: str, folder, number=signal.SIGINT) -> subprocess.CompletedProcess:
    """A program of its own."""
    code = BEGIN.format(number=int(number)) + body
    return subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, cwd=folder)


def ended(done) -> bool:
    return (done.returncode, done.stdout, done.stderr) == (interrupt.STATUS, "", "")


@pytest.mark.parametrize("number", REQUESTS)
def test_it_ends_the_process_and_what_was_not_finished_is_gone(number, tmp_path):
    body = """
with interrupt.watched(), output_folder(Path("results")) as folder:
    (folder / "fit.json").write_text("half")
    assert folder.exists()
    press()
    forever()
"""
    assert ended(run(body, tmp_path, number))
    assert list(tmp_path.iterdir()) == []


def test_it_ends_a_process_in_which_no_handler_runs(tmp_path):
    """Compiled code that computes, without the lock of the interpreter: here a read from a pipe into which nobody writes."""
    body = """
import ctypes
reading, writing = os.pipe()
with interrupt.watched():
    threading.Timer(0.0, press).start()
    while True: ctypes.CDLL(None).read(reading, ctypes.create_string_buffer(1), 1)
"""
    assert ended(run(body, tmp_path))


def test_it_is_not_lost_in_the_garbage_collector(tmp_path):
    """An exception there would be printed and forgotten."""
    body = """
import gc
gc.callbacks.append(lambda phase, info: press() if phase == "start" else None)
with interrupt.watched():
    gc.collect()
    forever()
"""
    assert ended(run(body, tmp_path))


def test_an_error_that_the_clean_up_causes_is_not_shown(tmp_path):
    body = """
with interrupt.watched(), output_folder(Path("results")) as folder:
    press()
    while True: (folder / "fit.json").write_text("half")
"""
    assert ended(run(body, tmp_path))
    assert list(tmp_path.iterdir()) == []


def test_a_held_block_ends_first(tmp_path):
    body = """
with interrupt.watched():
    with interrupt.held():
        press()
        for _ in range(10**6): pass
        Path("done").write_text("all of it")
    forever()
"""
    assert ended(run(body, tmp_path))
    assert (tmp_path / "done").read_text() == "all of it"


def test_a_second_request_does_not_wait(tmp_path):
    body = """
with interrupt.watched(), interrupt.held():
    press()
    press()
    forever()
"""
    assert ended(run(body, tmp_path))


def test_a_request_after_the_end_changes_no_status(tmp_path):
    body = """
import atexit, typer
from vibrojax.cli.errors import run
app = typer.Typer()
app.command()(lambda: None)
atexit.register(press)
sys.argv = ["nothing"]
run(app)
"""
    done = run(body, tmp_path)
    assert (done.returncode, done.stderr) == (0, "")


def test_handlers_are_as_before_when_the_block_ends():
    before = [signal.getsignal(number) for number in REQUESTS]
    with interrupt.watched():
        assert [signal.getsignal(number) for number in REQUESTS] != before
    assert [signal.getsignal(number) for number in REQUESTS] == before
    assert signal.set_wakeup_fd(-1) == -1


def test_where_signals_cannot_be_handled_nothing_is_changed():
    before, seen = signal.getsignal(signal.SIGINT), []

    def work() -> None:
        with interrupt.watched():
            seen.append(signal.getsignal(signal.SIGINT))

    thread = threading.Thread(target=work)
    thread.start()
    thread.join()
    assert seen == [before]


def test_an_ignored_ctrl_c_stays_ignored():
    before = signal.signal(signal.SIGINT, signal.SIG_IGN)
    with interrupt.watched():
        os.kill(os.getpid(), signal.SIGINT)
        assert signal.getsignal(signal.SIGINT) == signal.SIG_IGN
    signal.signal(signal.SIGINT, before)
