import json

import pytest

from benchmarks.resumable import finished, lines_beside, run_trials


def squared(number):
    return {"index": number, "square": number**2}


def test_a_line_cut_off_by_an_interruption_is_run_again(tmp_path):
    lines = tmp_path / "trials.jsonl"
    lines.write_text(json.dumps({"index": 4, "square": 16}) + '\n{"index": 5, "squ', encoding="utf-8")
    assert list(finished(lines, "index")) == [4]
    run_trials("numbers", squared, [5, 6], lines, workers=1)
    assert {index: one["square"] for index, one in finished(lines, "index").items()} == {4: 16, 5: 25, 6: 36}


def test_what_an_earlier_run_left_is_kept_only_when_asked_for(tmp_path):
    lines = tmp_path / "x.jsonl"
    lines.write_text('{"index": 1}\n', encoding="utf-8")
    assert lines_beside(tmp_path / "x.json", resume=True) == lines
    assert list(finished(lines, "index")) == [1]
    assert finished(lines_beside(tmp_path / "x.json", resume=False), "index") == {}


def test_figures_do_not_take_the_place_of_the_trials(tmp_path):
    (tmp_path / "x.jsonl").write_text('{"index": 1}\n', encoding="utf-8")
    with pytest.raises(SystemExit, match="the name that the trials take"):
        lines_beside(tmp_path / "x.jsonl", resume=False)
    assert (tmp_path / "x.jsonl").exists()
