"""Memory is handed back where the C library can do that, and nowhere else."""

import ctypes
import types

import pytest

from identification.discrepancy import memory


@pytest.mark.parametrize(("platform", "can", "calls"), [("linux", True, [0]), ("linux", False, []), ("win32", True, [])])
def test_free_memory_is_handed_back_where_the_library_can(monkeypatch, platform, can, calls):
    done = []
    library = types.SimpleNamespace(**({"malloc_trim": done.append} if can else {}))
    monkeypatch.setattr(ctypes, "CDLL", lambda name: library)
    monkeypatch.setattr(memory.sys, "platform", platform)
    memory.give_back()
    assert done == calls
