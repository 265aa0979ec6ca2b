"""A small part of the campaign, always the same one; and that the campaign would see what it looks for."""

import random
import re

import pytest

from benchmarks.reliability import inputs, trials
from benchmarks.reliability.mutations import mutated
from benchmarks.reliability.stores import REFUSED, REPAIRED, UNNOTICED, damaged_stores
from vibrojax.errors import one_line

KINDS = [kind for kind in inputs.kinds() if kind != "result.nc"]  # which takes a fit; the diagnosis and the fit have tests of their own
SEED = 7


@pytest.mark.filterwarnings("ignore")
@pytest.mark.parametrize("kind", KINDS)
def test_mutated_inputs_end_in_a_result_or_in_one_line(kind, tmp_path):
    for number in range(12):
        what, text = trials.outcome(kind, number, SEED, tmp_path)
        assert what in (trials.ACCEPTED, trials.REFUSED), f"{kind} {number}: {text}"
        if what == trials.REFUSED:
            assert one_line(text).isprintable() and re.search(r"expected|export|correct|rename|name ", text), text


@pytest.mark.parametrize("kind", KINDS)
def test_the_sound_file_is_accepted(kind, tmp_path, monkeypatch):
    monkeypatch.setattr(trials, "mutated", lambda content, rng: content)
    assert trials.outcome(kind, 0, SEED, tmp_path) == (trials.ACCEPTED, "")


def test_a_traceback_and_too_much_memory_are_seen(tmp_path, monkeypatch):
    def raising(error):
        def use(path):
            raise error

        return inputs.Kind("a.csv", inputs._csv, use)

    for error, expected in ((KeyError("x"), trials.TRACEBACK), (MemoryError(), trials.HANG)):
        monkeypatch.setattr(trials, "kinds", lambda error=error: {"csv": raising(error)})
        assert trials.outcome("csv", 0, SEED, tmp_path)[0] == expected


def test_a_crash_is_seen_and_the_campaign_goes_on(monkeypatch):
    """Of processes that crash at the third input of the first five, and at none after it."""
    code = """
import json, os, sys
print(json.dumps(["ready"]), flush=True)
for number in range(int(sys.argv[4]), int(sys.argv[5])):
    if number == 2: os.abort()
    print(json.dumps([number, "accepted", ""]), flush=True)
"""
    start = trials.subprocess.Popen
    monkeypatch.setattr(trials.subprocess, "Popen", lambda command, **more: start([command[0], "-c", code, *command[1:]], **more))
    counts, wrong = trials.campaign("csv", 5, SEED)
    assert counts == {trials.ACCEPTED: 4, trials.CRASH: 1}
    assert wrong == ["csv 2 of seed 7: crashes: exit status -6"]


def test_mutations_change_something_and_are_drawn_by_the_seed():
    content = b'{"a": [1.5, 2], "b": "text"}' * 20
    one, again, other = (mutated(content, random.Random(seed)) for seed in (1, 1, 2))
    assert one == again != content and other not in (one, content)


def test_damaged_stores_are_noticed(tmp_path):
    found, wrong = damaged_stores(12, SEED, tmp_path)
    assert wrong == [] and found[UNNOTICED] == 0
    assert found[REFUSED] > 0 and found[REPAIRED] > 0
