"""Reading in a process of its own: a library that crashes, hangs or fills the memory ends that process alone.

One process is started when the first such file is read and forks a child for every file, so that no file meets what another one has left.
The child has limits on memory and time and writes into a pipe of its own: a header in JSON, then the numbers; nothing is unpickled.
"""

import atexit
import contextlib
import ctypes
import importlib
import json
import os
import signal
import socket
import subprocess
import sys
import threading
from collections.abc import Callable
from collections.abc import Set as AbstractSet
from pathlib import Path
from typing import Any, NoReturn

import numpy as np

from identification.experiment.errors import ExperimentError, shown
from identification.experiment.limits import allowed_memory, allowed_seconds, limit_process
from identification.experiment.readers.base import AbstractReader, Columns, Lost

LENGTH = 8
"""Bytes of the header's length, and the multiple to which the header is filled up."""
ERROR, OUT_OF_MEMORY = "error", 70
"""Key of a header that holds a message in place of columns; exit status of a child that had no memory left."""
_SERVE = (
    "import json, sys; sys.path[:] = json.loads(sys.argv[1]); "
    "from identification.experiment.readers import apart, check_suffix, read_here; apart.serve(int(sys.argv[2]), check_suffix, read_here)"
)
Read = Callable[[Path, AbstractSet[str], str], Columns]
"""Reads the wanted columns of a file, whose name is for messages."""


class TooCostlyError(ExperimentError):
    """A file that takes more memory or time than one of its size may."""


class ReadingProcess:
    """The process that reads, started when it is first asked and ended with this one."""

    def __init__(self, serve: str = _SERVE) -> None:
        """Start nothing yet; `serve` is the program of the process."""
        self._serve = serve
        self._lock = threading.Lock()
        self._process: subprocess.Popen[bytes] | None = None
        self._line: socket.socket | None = None
        self._owner = 0

    def read(self, path: Path, wanted: AbstractSet[str], file: str, kind: str) -> Columns:
        """Read the wanted columns of a file; `kind` is the format for messages, all else as for `read_columns`."""
        stored = path.stat().st_size
        with self._lock:
            content, status = self._asked({"path": os.path.abspath(path), "wanted": sorted(wanted), "file": file, "stored": stored})
        if status != 0:
            costly = status in (OUT_OF_MEMORY, -signal.SIGXCPU)
            error = TooCostlyError if costly else ExperimentError
            raise error(f"record {shown(file)} cannot be read as {kind}: {_ended(status, stored)}; export it again")
        return _columns(content)

    def close(self) -> None:
        """End the process and what it has forked."""
        if self._process is not None and self._line is not None and self._owner == os.getpid():
            self._line.close()
            with contextlib.suppress(ProcessLookupError):
                os.killpg(self._process.pid, signal.SIGKILL)
            self._process.wait()
        self._process = self._line = None

    def _asked(self, request: dict[str, object]) -> tuple[bytearray, int]:
        """What a child wrote, and its exit status (minus the number of a signal)."""
        for _ in range(2):  # it may have been ended from outside
            line = self._started()
            reading, writing = os.pipe()
            with open(reading, "rb") as pipe, contextlib.suppress(OSError):
                try:
                    socket.send_fds(line, [b"{"], [writing])
                finally:
                    os.close(writing)
                line.sendall(json.dumps(request).encode()[1:] + b"\n")
                content = bytearray(pipe.read())
                if status := line.recv(LENGTH):
                    return content, int(status)
            self.close()
        raise ExperimentError("the process that reads record files ends at once: expected it to run; see the messages above")

    def _started(self) -> socket.socket:
        if self._process is None or self._line is None or self._owner != os.getpid() or self._process.poll() is not None:
            self.close()
            self._line, far = socket.socketpair()
            with far:
                path = [os.path.abspath(each or ".") for each in sys.path]
                self._process = subprocess.Popen(
                    [sys.executable, "-P", "-c", self._serve, json.dumps(path), str(far.fileno())],
                    pass_fds=[far.fileno()],
                    stdin=subprocess.DEVNULL,
                    stdout=subprocess.DEVNULL,
                    env=os.environ | dict.fromkeys(("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS"), "1"),
                    start_new_session=True,  # Ctrl-C is this process's affair
                )
            self._owner = os.getpid()
            atexit.register(self.close)
        return self._line


def _ended(status: int, stored: int) -> str:
    """Why a child gave no answer."""
    if status == OUT_OF_MEMORY:
        return f"reading it takes more than {allowed_memory(stored) // 2**20} MiB of memory, so the file is damaged or made to do harm"
    if status == -signal.SIGXCPU:
        return f"reading it takes more than {allowed_seconds(stored)} s, so the file is damaged or made to do harm"
    how = signal.Signals(-status).name if status < 0 else f"status {status}"
    return f"the library that reads it crashed ({how}), so the file is damaged"


def _columns(content: bytearray) -> Columns:
    """The columns that a child wrote."""
    begin = LENGTH + int.from_bytes(content[:LENGTH], "little")
    header = json.loads(content[LENGTH:begin])
    if ERROR in header:
        raise ExperimentError(header[ERROR])
    values, numbers, place = {}, np.frombuffer(content, dtype=np.float64, offset=begin), 0
    for name, length in header["columns"]:
        values[name] = numbers[place : place + length]
        place += length
    lost = tuple(Lost(column=column, why=why, places=np.array(places)) for column, why, places in header["lost"])
    return Columns(names=tuple(header["names"]), values=values, units=header["units"], notices=tuple(header["notices"]), lost=lost)


APART = ReadingProcess()
"""For all files."""


def serve(line: int, reader_of: Callable[[str], tuple[AbstractReader, str]], read: Read) -> None:
    """Answer requests until the other side closes the line, the number of an open socket.

    Every request is a line of JSON and comes with a pipe to write to. `read` reads the wanted columns of a file in this process.
    """
    _end_with_parent()
    with socket.socket(fileno=line) as asked:
        while True:
            text, pipes, _, _ = socket.recv_fds(asked, 2**20, 1)
            while text and not text.endswith(b"\n"):
                text += asked.recv(2**20) or b"\n"
            if not text or not pipes:
                return
            request = json.loads(text)
            if library := reader_of(request["file"])[0].library:
                with contextlib.suppress(ImportError):  # the reader says so
                    importlib.import_module(library)  # here, so that it is loaded once
            child = os.fork()
            if child == 0:
                asked.close()
                _answer(request, pipes[0], read)
            os.close(pipes[0])
            _, status = os.waitpid(child, 0)
            asked.sendall(f"{os.waitstatus_to_exitcode(status):{LENGTH}d}".encode())


def _answer(request: dict[str, Any], pipe: int, read: Read) -> NoReturn:
    """Read one file and end."""
    status = 1
    try:
        _end_with_parent()
        os.dup2(os.open(os.devnull, os.O_WRONLY), 2)
        limit_process(request["stored"])
        header, arrays = _read(request, read)
        text = json.dumps(header).encode()
        text += b" " * (-len(text) % LENGTH)
        with open(pipe, "wb") as stream:
            stream.write(len(text).to_bytes(LENGTH, "little") + text)
            for values in arrays:
                stream.write(values.data)
        status = 0
    except MemoryError:
        status = OUT_OF_MEMORY
    finally:
        os._exit(status)


def _read(request: dict[str, Any], read: Read) -> tuple[dict[str, Any], list[Any]]:
    try:
        found = read(Path(request["path"]), frozenset(request["wanted"]), request["file"])
    except ExperimentError as error:
        if _has_memory_error(error):
            raise MemoryError from error
        return {ERROR: str(error)}, []
    columns = [(name, len(values)) for name, values in found.values.items()]
    lost = [(one.column, one.why, one.places.tolist()) for one in found.lost]
    header = {"names": found.names, "units": found.units, "columns": columns, "notices": found.notices, "lost": lost}
    return header, list(found.values.values())


def _has_memory_error(error: BaseException | None) -> bool:
    """Whether it began with a lack of memory."""
    return error is not None and (isinstance(error, MemoryError) or _has_memory_error(error.__cause__ or error.__context__))


def _end_with_parent() -> None:
    """Where the system can: whoever ends the program leaves no process behind."""
    with contextlib.suppress(OSError, AttributeError):
        ctypes.CDLL(None).prctl(1, signal.SIGKILL)  # PR_SET_PDEATHSIG
