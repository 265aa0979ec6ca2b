"""A small part of the campaign, always the same one; and that the campaign would see what it looks for."""

import os
import random
import re
import warnings

import pytest

from benchmarks.reliability import inputs, recorded_files, trials
from benchmarks.reliability.mutations import mutated
from benchmarks.reliability.page import BEGIN, END, write_page
from benchmarks.reliability.stores import REFUSED, REPAIRED, UNNOTICED, damaged_stores
from benchmarks.resume import contents
from vibrojax.errors import one_line

KINDS = [kind for kind in inputs.kinds() if not kind.startswith("result.nc")]  # which take a fit; fit and diagnosis have tests of their own
SEED = 7


@pytest.mark.filterwarnings("ignore")
@pytest.mark.parametrize("kind", KINDS)
def test_mutated_inputs_end_in_a_result_or_in_one_line(kind, tmp_path):
    for number in range(12):
        what, text = trials.outcome(trials.Reading(kind, SEED), number, tmp_path)
        assert what in (trials.ACCEPTED, trials.REFUSED), f"{kind} {number}: {text}"
        if what == trials.REFUSED:
            assert one_line(text).isprintable() and re.search(r"expected|export|correct|rename|name ", text), text


@pytest.mark.parametrize("kind", KINDS)
def test_the_sound_file_is_accepted(kind, tmp_path, monkeypatch):
    monkeypatch.setattr(trials, "mutated", lambda content, rng: content)
    assert trials.outcome(trials.Reading(kind, SEED), 0, tmp_path) == (trials.ACCEPTED, "")


def test_a_store_is_whole_again_before_another_of_its_files_is_damaged(tmp_path):
    trials.make_sound("store", tmp_path)
    whole = contents(tmp_path / "a.zarr")
    for number in range(5):
        trials._put_damaged(trials.Reading("store", SEED), number, tmp_path)
        now = contents(tmp_path / "a.zarr")
        assert sum(now[name] != content for name, content in whole.items()) == 1 and now.keys() == whole.keys()


def test_a_traceback_a_warning_and_too_much_memory_are_seen(tmp_path, monkeypatch):
    def raising(error):
        def use(path):
            raise error

        return inputs.Kind("a.csv", recorded_files.csv, use)

    warned = inputs.Kind("a.csv", recorded_files.csv, lambda path: warnings.warn("overflow", RuntimeWarning, stacklevel=1))
    for kind, expected in ((raising(KeyError("x")), trials.TRACEBACK), (warned, trials.TRACEBACK), (raising(MemoryError()), trials.HANG)):
        monkeypatch.setattr(trials, "kinds", lambda kind=kind: {"csv": kind})
        assert trials.outcome(trials.Reading("csv", SEED), 0, tmp_path)[0] == expected


def crashing(reading, begin, end, folder, send):
    """Input 2 crashes, where it is read in this process and where not; 3 only in this process; 4 raises here."""
    for number in range(begin, end):
        if number == 2 or (number == 3 and not reading.apart):
            os.abort()
        send((number, trials.TRACEBACK if number == 4 and not reading.apart else trials.ACCEPTED, ""))
    send(0.5)


def test_a_crash_is_read_again_apart_and_the_block_goes_on(tmp_path):
    found = trials.block(trials.Reading("csv", SEED, apart=False), 0, 6, tmp_path, crashing)
    assert found["counts"] == {trials.ACCEPTED: 5, trials.CRASH: 1, trials.CONTAINED: 1}
    assert found["wrong"] == ["csv 2 of seed 7: crashes: the process ended"]


def test_a_campaign_goes_on_where_it_was_broken_off(tmp_path, monkeypatch):
    read = []

    def counted(reading, begin, end, folder):
        read.append((reading.kind, begin, end))
        return {"counts": {trials.ACCEPTED: end - begin}, "wrong": [], "seconds": 0.1, "cpu_seconds": 0.1, "slowest": [0.01, begin]}

    monkeypatch.setattr(trials, "block", counted)
    monkeypatch.setattr(trials, "_forked_once", lambda kind, folder: iter(()))
    monkeypatch.setattr(trials, "BLOCK", 10)
    lines = tmp_path / "blocks.jsonl"
    for part in ("a", "b"):
        (tmp_path / part).mkdir()
    first = trials.campaign(["csv", "h5"], 15, SEED, tmp_path / "a", lines)
    next(first), next(first), next(first), first.close()
    rest = list(trials.campaign(["csv", "h5"], 15, SEED, tmp_path / "b", lines))
    assert read == [("csv", 0, 10), ("h5", 0, 10), ("csv", 10, 15), ("h5", 10, 15)] and [one["kind"] for one in rest] == ["h5"]
    assert list(trials.campaign(["csv", "h5"], 15, SEED, tmp_path / "b", lines, until=0.0)) == []


def test_mutations_change_something_and_are_drawn_by_the_seed():
    content = b'{"a": [1.5, 2], "b": "text"}' * 20
    one, again, other = (mutated(content, random.Random(seed)) for seed in (1, 1, 2))
    assert one == again != content and other not in (one, content)


def test_damaged_stores_are_noticed(tmp_path):
    found, wrong = damaged_stores(12, SEED, tmp_path)
    assert wrong == [] and found[UNNOTICED] == 0
    assert found[REFUSED] > 0 and found[REPAIRED] > 0


def figures(**more):
    kind = {"inputs": 10, "refused": 4, "accepted": 6, "tracebacks": 0, "crashes": 0, "hangs": 0, "contained": 1}
    row = kind | {"per_cpu_second": 200.0, "slowest_s": 0.25}
    return {
        "machine": {"revision": "abc", "processor": "a processor"},
        "input_revisions": ["abc"],
        "by_kind": {"csv": row, "h5": row},
    } | more


def test_the_page_holds_the_figures_of_one_revision(tmp_path):
    page = tmp_path / "page.md"
    page.write_text(f"before\n{BEGIN}\nold\n{END}\nafter\n")
    killed = {"fit": {"kills": 7, "while_computing": 2, "too_late": 0, "mixed": 0, "remains_not_cleared": 0}}
    write_page(page, [figures(), {**figures(), "by_kind": {}, "killed": killed, "stores": {"refused": 3, "repaired": 2, "unnoticed": 0}}])
    text = page.read_text()
    assert "| csv | 10 | 4 | 6 | 0 | 0 | 0 | 1 | 200.0 | 0.25 |" in text and "| all | 20 | 8 | 12 | 0 | 0 | 0 | 2 |  | 0.25 |" in text
    assert "With no failure among 20, fewer than one such input in 6 fails" in text
    assert "| kills of fit, 2 of them before anything was written | 7 | 0 mixed sets" in text and "| damaged stores | 5 | 3 refused" in text
    assert text.startswith("before\n") and text.endswith("after\n") and "old" not in text
    with pytest.raises(SystemExit, match=r"the figures are of revisions def and abc, whose programs differ: expected one program"):
        write_page(page, [figures(input_revisions=["def"])])
