"""Results appear all at once or not at all."""

import errno
import os

import pytest

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


def test_a_full_disk_is_told_in_a_line_and_changes_no_file(tmp_path):
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
