"""A library that crashes, hangs or fills the memory ends the process that reads, never the program."""

import os
import signal
import struct

import numpy as np
import pytest
import scipy.io

from identification.experiment import ExperimentError
from identification.experiment.readers import APART, read_columns
from identification.experiment.readers.apart import _SERVE, ReadingProcess, TooCostlyError

REPLACED = """
import sys; sys.path[:] = __import__("json").loads(sys.argv[1])
import os, signal
from pathlib import Path
from identification.experiment.readers import apart, base, check_suffix
import numpy as np
def read(path, wanted, file):
    {body}
    return base.Columns(names=("F",), values={{"F": np.arange(3.0)}})
apart.allowed_seconds = lambda stored: 1
apart.serve(int(sys.argv[2]), check_suffix, read)
"""


@pytest.fixture
def reading(tmp_path):
    """Read one file in a process whose library is replaced."""
    started = []

    def read(body: str):
        (tmp_path / "a.mat").write_bytes(b"whatever")
        started.append(ReadingProcess(REPLACED.format(body=body)))
        return started[-1].read(tmp_path / "a.mat", frozenset({"F"}), "a.mat", "MATLAB")

    yield read
    for each in started:
        each.close()


def vectors(path, **columns):
    scipy.io.savemat(path, columns or {name: np.arange(600.0) for name in "abcde"})
    return path


def test_a_mat_file_that_crashes_scipy_is_one_line(tmp_path):
    """The last data tag of five vectors says one byte of type 0 where it said 4800 bytes of type 9."""
    whole = vectors(tmp_path / "a.mat").read_bytes()
    place = whole.rindex(struct.pack("<II", 9, 4800))
    (tmp_path / "b.mat").write_bytes(whole[:place] + struct.pack("<II", 0, 1) + whole[place + 8 :])
    with pytest.raises(ExperimentError, match=r"record 'b.mat' cannot be read as MATLAB: the library that reads it crashed \(SIG"):
        read_columns(tmp_path / "b.mat", frozenset("abcde"), "b.mat")
    np.testing.assert_array_equal(read_columns(tmp_path / "a.mat", frozenset("e"), "a.mat").values["e"], np.arange(600.0))


def test_what_is_read_may_be_changed(tmp_path):
    values = read_columns(vectors(tmp_path / "a.mat"), frozenset("a"), "a.mat").values["a"]
    values[0] = 7.0
    assert values[0] == 7.0 and values.dtype == np.float64


@pytest.mark.parametrize(
    ("body", "message"),
    [
        ("os.kill(os.getpid(), signal.SIGSEGV)", r"the library that reads it crashed \(SIGSEGV\)"),
        ("os.abort()", r"the library that reads it crashed \(SIGABRT\)"),
        ("os._exit(3)", r"the library that reads it crashed \(status 3\)"),
    ],
)
def test_a_crash_is_an_error_of_the_file(body, message, reading):
    with pytest.raises(ExperimentError, match=message):
        reading(body)


@pytest.mark.parametrize(
    ("body", "message"), [("while True: pass", "takes more than 15 s"), ("hoard = bytearray(10**11)", "takes more than 1216 MiB of memory")]
)
def test_time_and_memory_are_limited(body, message, reading):
    with pytest.raises(TooCostlyError, match=message):
        reading(body)


def test_a_library_that_prints_disturbs_nothing(reading, capfd):
    found = reading("os.write(1, b'noise'); os.write(2, b'noise')")
    np.testing.assert_array_equal(found.values["F"], np.arange(3.0))
    assert capfd.readouterr() == ("", "")


def test_a_process_that_was_ended_is_started_again(tmp_path):
    path = vectors(tmp_path / "a.mat")
    for _ in range(2):
        assert read_columns(path, frozenset(), "a.mat").names == tuple("abcde")
        os.kill(APART._process.pid, signal.SIGKILL)
    assert read_columns(path, frozenset(), "a.mat").names == tuple("abcde")


def test_a_process_that_does_not_start_is_one_line(tmp_path):
    with pytest.raises(ExperimentError, match="the process that reads record files ends at once"):
        ReadingProcess("raise SystemExit(1)").read(vectors(tmp_path / "a.mat"), frozenset(), "a.mat", "MATLAB")


def test_the_process_is_not_fed_from_the_folder_that_it_is_started_in(tmp_path, monkeypatch):
    (tmp_path / "json.py").write_text("raise SystemExit('code of the folder was run')")
    monkeypatch.chdir(tmp_path)
    process = ReadingProcess(_SERVE)
    assert process.read(vectors(tmp_path / "a.mat"), frozenset(), "a.mat", "MATLAB").names == tuple("abcde")
    process.close()
