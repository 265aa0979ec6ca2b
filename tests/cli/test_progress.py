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


def test_the_time_left_follows_from_what_is_counted(monkeypatch, capsys):
    seconds = iter([0.0, 1.0, 1.0, 5.0, 5.0, 65.0, 65.0, 66.0, 67.0])
    monkeypatch.setattr(progress.time, "perf_counter", lambda: next(seconds))
    with progress.stages(quiet=False) as say:
        for stage in ("row 3 of 13", "row 5 of 13", "row 2 of 13", "writing", WarningLine("row 5 of 13 is odd")):
            say(stage)
    lines = [line.strip().split(" s  ")[1] for line in capsys.readouterr().err.splitlines()]
    assert lines == ["row 3 of 13", "row 5 of 13, about 18 s left", "row 2 of 13", "writing", "row 5 of 13 is odd"]


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


@pytest.mark.parametrize("terminal", [True, False])
def test_experiments_are_counted_from_those_done_before_and_failures_stay(monkeypatch, capsys, terminal):
    monkeypatch.setattr(progress, "Console", functools.partial(Console, force_terminal=terminal, width=100))
    with progress.experiments_done(5, 2, quiet=False) as say:
        say("a: good")
        say(WarningLine("b [2]: mass is missing"))
        time.sleep(0.3)  # the bar is drawn by a thread
    err = capsys.readouterr().err
    assert err.startswith("2 of 5 experiments are done already\n")
    if terminal:
        assert "4/5" in err and "b [2]: mass is missing\n" in err and "a: good\n" not in err
    else:
        lines = err.splitlines()[1:]
        assert lines[0].endswith(" s left  a: good") and "3 of 5 experiments, " in lines[0]
        assert lines[1].endswith(" s left  b [2]: mass is missing") and "4 of 5 experiments, " in lines[1]


def test_time_left_is_the_mean_of_this_run(monkeypatch, capsys):
    """Three of ten were there before; two take 10 s each, so that the last five take 50 s."""
    clock = iter([0.0, 10.0, 20.0])
    monkeypatch.setattr(progress.time, "perf_counter", lambda: next(clock))
    with progress.experiments_done(10, 3, quiet=False) as say:
        say("a: good")
        say("b: good")
    assert "5 of 10 experiments, 50 s left  b: good" in capsys.readouterr().err
