"""The process that reads files for another one (`apart`): it forks a child for each, with limits on memory and time."""

import ctypes
import importlib
import json
import os
import resource
import signal
import socket
from pathlib import Path
from typing import Any, NoReturn

from identification.experiment.errors import ExperimentError
from identification.experiment.readers import check_suffix, read_here
from identification.experiment.readers.apart import ERROR, LENGTH, OUT_OF_MEMORY
from identification.experiment.readers.labdata import silenced
from identification.experiment.readers.limits import allowed_memory, allowed_seconds

_DIE_WITH_PARENT = 1
"""Request of Linux's `prctl`."""


def serve(line: int) -> None:
    """Answer requests until the other side closes the line.

    Args:
        line: number of an open socket; every request is a line of JSON and comes with a pipe to write to.
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
            _load_library(request["file"])
            child = os.fork()
            if child == 0:
                asked.close()
                _answer(request, pipes[0])
            os.close(pipes[0])
            _, status = os.waitpid(child, 0)
            asked.sendall(f"{os.waitstatus_to_exitcode(status):{LENGTH}d}".encode())


def _load_library(file: str) -> None:
    """Here, so that it is loaded once; where it is not installed the reader says so."""
    library = check_suffix(file)[0].library
    if library is not None:
        try:
            with silenced(library):
                importlib.import_module(library)
        except ImportError:
            pass


def _answer(request: dict[str, Any], pipe: int) -> NoReturn:
    """Read one file and end."""
    status = 1
    try:
        _end_with_parent()
        os.dup2(os.open(os.devnull, os.O_WRONLY), 2)
        _limited(request["stored"])
        header, arrays = _read(request)
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


def _read(request: dict[str, Any]) -> tuple[dict[str, Any], list[Any]]:
    try:
        found = read_here(Path(request["path"]), frozenset(request["wanted"]), request["file"])
    except ExperimentError as error:
        if _has_memory_error(error):
            raise MemoryError from error
        return {ERROR: str(error)}, []
    columns = [(name, len(values)) for name, values in found.values.items()]
    return {"names": found.names, "units": found.units, "columns": columns}, list(found.values.values())


def _has_memory_error(error: BaseException | None) -> bool:
    """Whether it began with a lack of memory."""
    return error is not None and (isinstance(error, MemoryError) or _has_memory_error(error.__cause__ or error.__context__))


def _limited(stored: int) -> None:
    """From here on this process has so much memory and time as the file may take."""
    pages = int(Path("/proc/self/statm").read_text(encoding="ascii").split()[0])
    memory, seconds = pages * resource.getpagesize() + allowed_memory(stored), allowed_seconds(stored)
    resource.setrlimit(resource.RLIMIT_AS, (memory, memory))
    resource.setrlimit(resource.RLIMIT_CPU, (seconds, seconds + 1))
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))


def _end_with_parent() -> None:
    """Where the system can: whoever ends the program leaves no process behind."""
    try:
        ctypes.CDLL(None).prctl(_DIE_WITH_PARENT, signal.SIGKILL)
    except (OSError, AttributeError):
        pass
