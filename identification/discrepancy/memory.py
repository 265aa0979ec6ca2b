"""Memory that compiling leaves behind."""

import ctypes
import sys


def give_back() -> None:
    """Hand free memory back to the system, where the C library offers that (glibc does).

    A compiler run frees hundreds of megabytes, which the allocator would keep for later while the next program takes others.
    """
    trim = getattr(ctypes.CDLL(None), "malloc_trim", None) if sys.platform == "linux" else None
    if trim is not None:
        trim(0)
