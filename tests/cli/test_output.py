"""Results appear all at once or not at all."""

import contextlib
import errno
import fcntl
import hashlib
import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

from vibrojax.aside import of_earlier_set
from vibrojax.cli.output import output_file, output_folder
from vibrojax.errors import InputError


def test_a_new_folder_appears_on_success(tmp_path):
    out = tmp_path / "new" / "results"
    with output_folder(out) as folder:
        (folder / "plots").mkdir()
        (folder / "fit.json").write_text("fitted")
        (folder / "plots" / "overlay.svg").write_text("drawn")
        assert not out.parent.exists()
    assert (out / "fit.json").read_text() == "fitted"
    assert (out / "plots" / "overlay.svg").read_text() == "drawn"
    assert os.listdir(tmp_path) == ["new"]


def test_others_may_read_the_results(tmp_path):
    plain = tmp_path / "plain"
    plain.mkdir()
    with output_folder(tmp_path / "out") as folder:
        (folder / "plots").mkdir()
    assert (tmp_path / "out").stat().st_mode == plain.stat().st_mode
    assert (tmp_path / "out" / "plots").stat().st_mode == plain.stat().st_mode


def test_nothing_is_left_after_a_failure(tmp_path):
    with pytest.raises(RuntimeError, match="half way"), output_folder(tmp_path / "a" / "b") as folder:
        (folder / "fit.json").write_text("half")
        raise RuntimeError("half way")
    assert os.listdir(tmp_path) == []


def test_an_earlier_result_survives_a_failure(tmp_path):
    out = tmp_path / "out"
    out.mkdir()
    (out / "fit.json").write_text("old")
    with pytest.raises(KeyboardInterrupt), output_folder(out) as folder:
        (folder / "fit.json").write_text("half")
        raise KeyboardInterrupt
    assert os.listdir(out) == ["fit.json"]
    assert (out / "fit.json").read_text() == "old"


def test_an_earlier_result_is_replaced_and_foreign_files_stay(tmp_path):
    out = tmp_path / "out"
    (out / "plots").mkdir(parents=True)
    (out / "fit.json").write_text("old")
    (out / "notes.txt").write_text("mine")
    (out / "plots" / "mine.svg").write_text("mine")
    with output_folder(out) as folder:
        (folder / "fit.json").write_text("new")
        (folder / "plots").mkdir()
        (folder / "plots" / "overlay.svg").write_text("new")
    assert (out / "fit.json").read_text() == "new"
    assert (out / "notes.txt").read_text() == "mine"
    assert sorted(os.listdir(out / "plots")) == ["mine.svg", "overlay.svg"]
    assert sorted(os.listdir(out)) == ["fit.json", "notes.txt", "plots"]


def test_a_full_disk_is_reported_in_a_line_and_changes_no_file(tmp_path):
    (tmp_path / "fit.json").write_text("old")
    with pytest.raises(InputError, match=r"No space left on device; make room, or name another place"), output_folder(tmp_path) as folder:
        (folder / "fit.json").write_text("half")
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
    assert os.listdir(tmp_path) == ["fit.json"]
    assert (tmp_path / "fit.json").read_text() == "old"


def test_a_file_is_replaced_when_it_is_whole_through_a_link_too(tmp_path):
    (tmp_path / "target.json").write_text("old")
    (tmp_path / "link.json").symlink_to("target.json")
    with output_file(tmp_path / "link.json") as file:
        file.write_text("new")
        assert (tmp_path / "target.json").read_text() == "old"
    assert (tmp_path / "link.json").is_symlink()
    assert (tmp_path / "target.json").read_text() == "new"


def test_a_pipe_is_written_to_and_not_replaced(tmp_path):
    os.mkfifo(tmp_path / "pipe")
    with output_file(tmp_path / "pipe") as file:
        assert file == tmp_path / "pipe"
    assert (tmp_path / "pipe").is_fifo()


@pytest.mark.parametrize("out", ["taken", "taken/below"])
def test_a_file_in_the_way_is_bad_input(tmp_path, out):
    (tmp_path / "taken").write_text("a file")
    with pytest.raises(InputError, match="taken is not a folder; name another folder with --out"), output_folder(tmp_path / out):
        pass
    assert (tmp_path / "taken").read_text() == "a file"


def test_a_folder_in_the_place_of_a_result_is_bad_input(tmp_path):
    (tmp_path / "out" / "fit.json").mkdir(parents=True)
    (tmp_path / "out" / "a.json").write_text("old")
    with pytest.raises(InputError, match="fit.json: Is a directory"), output_folder(tmp_path / "out") as folder:
        (folder / "a.json").write_text("new")
        (folder / "fit.json").write_text("new")
    assert sorted(os.listdir(tmp_path / "out")) == ["a.json", "fit.json"]
    assert (tmp_path / "out" / "a.json").read_text() == "old"


def test_a_file_in_the_place_of_a_folder_is_bad_input(tmp_path):
    (tmp_path / "out").mkdir()
    (tmp_path / "out" / "plots").write_text("mine")
    with pytest.raises(InputError, match="plots: Not a directory"), output_folder(tmp_path / "out") as folder:
        (folder / "plots").mkdir()
        (folder / "plots" / "one.svg").write_text("new")
    assert (tmp_path / "out" / "plots").read_text() == "mine"


@pytest.mark.skipif(os.geteuid() == 0, reason="the superuser may write anywhere")
def test_a_folder_that_cannot_be_written_is_bad_input(tmp_path):
    tmp_path.chmod(0o500)
    with pytest.raises(InputError, match="Permission denied"), output_folder(tmp_path / "out"):
        pass


def old_results(out, *more):
    """An earlier set."""
    for name in (*"abcdefghijkl", *more):
        (out / name).parent.mkdir(parents=True, exist_ok=True)
        (out / name).write_text("old")
    return out


def write_new(folder):
    for name in "abcdefghijkl":
        (folder / name).write_text("new")


def texts(out):
    return {(out / name).read_text() for name in "abcdefghijkl"}


@pytest.fixture
def renames(monkeypatch):
    """Files and folders that were renamed; the move of the sixth file fails, as on a faulty disk."""
    calls, rename = [], os.rename

    def renamed(source, target):
        calls.append(source)
        if Path(source).is_file() and len(calls) == 6:
            raise OSError(errno.EIO, os.strerror(errno.EIO), str(source))
        rename(source, target)

    monkeypatch.setattr("vibrojax.aside.os.rename", renamed)
    return calls


def test_results_are_replaced_as_a_whole(tmp_path, renames):
    """No file is moved by itself: folders are."""
    out = old_results(tmp_path / "out")
    with output_folder(out) as folder:
        write_new(folder)
    assert texts(out) == {"new"} and renames[:2] == [out, folder] and {path.parent for path in renames} == {tmp_path}


@pytest.mark.parametrize("ends", [False, True], ids=["fails", "ends"])
def test_a_second_run_between_the_two_renames_spoils_nothing(tmp_path, monkeypatch, ends):
    out, rename = old_results(tmp_path / "out", "notes.txt"), os.rename

    def renamed(source, target):
        if target == out:
            monkeypatch.undo()
            with contextlib.suppress(RuntimeError), output_folder(out) as folder:
                (folder / "second.txt").write_text("second")
                if not ends:
                    raise RuntimeError
        rename(source, target)

    monkeypatch.setattr("vibrojax.aside.os.rename", renamed)
    with output_folder(out) as folder:
        write_new(folder)
    assert texts(out) == {"new"} and (out / "notes.txt").read_text() == "old"
    assert (out / "second.txt").exists() == ends and os.listdir(tmp_path) == ["out"]


def test_where_the_folder_has_to_stay_an_error_puts_everything_back(tmp_path, renames):
    out = old_results(tmp_path / "out", "archive/mine")
    with pytest.raises(InputError, match=r"out/c: Input/output error; name another folder"), output_folder(out) as folder:
        write_new(folder)
        (folder / "Only-new").write_text("new")
    assert texts(out) == {"old"} and len(renames) > 6
    assert sorted(os.listdir(out)) == sorted([*"abcdefghijkl", "archive"]) and os.listdir(tmp_path) == ["out"]


def test_a_folder_that_cannot_be_renamed_is_filled_file_by_file(tmp_path, monkeypatch):
    out, rename = old_results(tmp_path / "out", "notes.txt"), os.rename

    def renamed(source, target):
        if source == out:
            raise OSError(errno.EXDEV, os.strerror(errno.EXDEV), str(source))
        rename(source, target)

    monkeypatch.setattr("vibrojax.aside.os.rename", renamed)
    with output_folder(out) as folder:
        write_new(folder)
    assert texts(out) == {"new"} and (out / "notes.txt").read_text() == "old" and os.listdir(tmp_path) == ["out"]


def test_the_current_folder_is_not_replaced_under_who_works_in_it(tmp_path, monkeypatch):
    out = old_results(tmp_path / "out")
    monkeypatch.chdir(out)
    with output_folder(out) as folder:
        write_new(folder)
    assert texts(Path(".")) == {"new"} and out.samefile(".")


def test_a_file_that_comes_while_the_results_are_made_stays(tmp_path):
    out = old_results(tmp_path / "out")
    with output_folder(out) as folder:
        write_new(folder)
        (out / "notes.txt").write_text("mine")
    assert (out / "notes.txt").read_text() == "mine" and texts(out) == {"new"}


def test_rights_links_and_what_the_folder_links_to_stay(tmp_path):
    real = old_results(tmp_path / "real")
    real.chmod(0o750)
    (real / "link").symlink_to("nowhere")
    (tmp_path / "out").symlink_to("real")
    with output_folder(tmp_path / "out") as folder:
        write_new(folder)
    assert (tmp_path / "out").is_symlink() and texts(real) == {"new"}
    assert real.stat().st_mode & 0o777 == 0o750 and os.readlink(real / "link") == "nowhere"


def test_what_a_killed_run_has_left_is_cleared_and_a_living_one_is_not_disturbed(tmp_path):
    for name in (".out-unfinished-dead", ".out-unfinished-alive", ".other-unfinished-1"):
        old_results(tmp_path / name)
    lock = os.open(tmp_path / ".out-unfinished-alive", os.O_RDONLY)
    fcntl.flock(lock, fcntl.LOCK_EX)
    with output_folder(tmp_path / "out") as folder:
        write_new(folder)
    os.close(lock)
    assert sorted(os.listdir(tmp_path)) == [".other-unfinished-1", ".out-unfinished-alive", "out"]


def test_a_folder_that_a_killed_run_has_moved_away_comes_back(tmp_path):
    old_results(tmp_path / ".out-replaced-1", "notes.txt")
    with pytest.raises(RuntimeError), output_folder(tmp_path / "out"):
        raise RuntimeError
    assert os.listdir(tmp_path) == ["out"] and texts(tmp_path / "out") == {"old"}


def test_a_kill_or_an_error_at_any_step_mixes_nothing(root):
    """In a program of its own, which forks."""
    command = [sys.executable, "-m", "benchmarks.reliability.result_sets"]
    done = subprocess.run(command, capture_output=True, text=True, cwd=root)
    found = json.loads(done.stdout)
    assert found.pop("steps") > 500
    assert found == {"mixed": 0, "unexpected": 0, "not_mended": 0}


def stated(folder: Path, *names: str, by: str = "fit.json") -> None:
    (folder / by).write_text(json.dumps({"files": {name: hashlib.sha256((folder / name).read_bytes()).hexdigest() for name in names}}))


@pytest.mark.parametrize("more", [(), ("archive/mine",)], ids=["at once", "one by one"])
def test_files_of_the_earlier_set_go_and_foreign_or_changed_ones_stay(tmp_path, more):
    out = old_results(tmp_path / "out", *more)
    for name in ("posterior.nc", "overlay.png", "edited.png", "notes.txt"):
        (out / name).write_text("old")
    stated(out, "posterior.nc", "overlay.png", "edited.png", "a", by="diagnosis.json")
    (out / "edited.png").write_text("mine")
    with output_folder(out, outdated=of_earlier_set) as folder:
        write_new(folder)
    left = set(os.listdir(out)) - {"archive"}
    assert left == {*"abcdefghijkl", "edited.png", "notes.txt"} and {(out / name).read_text() for name in "abcdefghijkl"} == {"new"}


def test_an_error_brings_files_of_the_earlier_set_back(tmp_path, monkeypatch):
    out = old_results(tmp_path / "out", "archive/mine")
    (out / "posterior.nc").write_text("old")
    stated(out, "posterior.nc")
    before = {path.name: path.read_text() for path in out.iterdir() if path.is_file()}
    rename = os.rename

    def failing(source, target):
        if Path(source).name == "posterior.nc":
            raise OSError(errno.EIO, os.strerror(errno.EIO), str(source))
        rename(source, target)

    with pytest.raises(InputError, match="Input/output error"), output_folder(out, outdated=of_earlier_set) as folder:
        write_new(folder)
        monkeypatch.setattr("vibrojax.aside.os.rename", failing)
    monkeypatch.undo()
    assert {path.name: path.read_text() for path in out.iterdir() if path.is_file()} == before


@pytest.mark.parametrize(
    "content", ["", "{}", '{"files": {"../notes.txt": "ab", "archive": "cd"}}', '{"files": ["notes.txt"]}', "[" * 100_000]
)
def test_what_a_hostile_statement_names_stays(tmp_path, content):
    out = old_results(tmp_path / "out", "archive/mine")
    (tmp_path / "notes.txt").write_text("mine")
    (out / "fit.json").write_text(content)
    assert of_earlier_set(out) <= {Path("fit.json")}
