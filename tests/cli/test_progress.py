"""What stays on a terminal while a command works."""

import functools
import time

import pytest
from rich.console import Console

from vibrojax.cli import progress
from vibrojax.errors import WarningLine


@pytest.mark.parametrize(("stage", "stays"), [(WarningLine("the gap is odd"), True), ("warning: a stage that only reads like one", False)])
def test_a_terminal_keeps_a_warning_and_no_stage(monkeypatch, capsys, stage, stays):
    monkeypatch.setattr(progress, "Console", functools.partial(Console, force_terminal=True, width=80))
    with progress.stages(quiet=False) as say:
        say(stage)
    assert (f"{stage}\n" in capsys.readouterr().err) == stays


def test_a_log_file_holds_both(monkeypatch, capsys):
    with progress.stages(quiet=False) as say:
        say(WarningLine("set sign = -1 in [sensors.impact_force]"))
        say("fitting [all]")
    lines = capsys.readouterr().err.splitlines()
    assert [line.split(" s  ")[1] for line in lines] == ["set sign = -1 in [sensors.impact_force]", "fitting [all]"]


def test_a_terminal_shows_names_in_brackets(monkeypatch, capsys):
    monkeypatch.setattr(progress, "Console", functools.partial(Console, force_terminal=True, width=80))
    with progress.stages(quiet=False) as say:
        say("fitting [all]")
        time.sleep(0.3)  # the spinner is drawn by a thread
    assert "fitting [all]" in capsys.readouterr().err


@pytest.mark.parametrize("terminal", [True, False])
def test_results_go_to_standard_output_between_two_stages(monkeypatch, capsys, terminal):
    monkeypatch.setattr(progress, "Console", functools.partial(Console, force_terminal=terminal, width=80))
    with progress.stages(quiet=False) as say:
        say("fitting")
        say.show("k = 1")
        say("drawing the report")
        assert "k = 1" in capsys.readouterr().out, "at once"
