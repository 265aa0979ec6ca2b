"""How much a record file may claim before anything is allocated for it."""

import math
import sys

from identification.experiment.errors import ExperimentError

MAX_SAMPLES = 50_000_000
MAX_TEXT_BYTES = 4 * 2**30
LARGEST = math.sqrt(sys.float_info.max / MAX_SAMPLES) / 2**16
"""A larger number counts as missing: units, differences and sums of squares of up to this one stay finite in double precision."""
# A measured signal carries noise and never shrinks a hundredfold; small files are let through whatever their ratio.
MAX_RATIO = 100
FREE_BYTES = 64 * 2**20
# For a file that is read in a process of its own: what the libraries take to start with, and far more than any of them needs for a byte.
FREE_SECONDS, BYTES_PER_SECOND = 15, 1_000_000
FREE_MEMORY, COPIES = 2**30, 3


def allowed_bytes(stored_bytes: int) -> int:
    """Number of bytes that a file may unfold to.

    Args:
        stored_bytes: the file's own size.

    Returns:
        The limit in bytes.

    Example:
        >>> allowed_bytes(10) == FREE_BYTES
        True
    """
    return max(FREE_BYTES, MAX_RATIO * stored_bytes)


def check_samples(samples: int, what: str) -> None:
    """Refuse more samples than a record may have.

    Args:
        samples: as the file claims.
        what: for the message.

    Raises:
        ExperimentError: more than `MAX_SAMPLES`.
    """
    if samples > MAX_SAMPLES:
        raise ExperimentError(f"{what} claims {samples} samples: expected at most {MAX_SAMPLES}; cut or decimate the record")


def check_claim(claimed_bytes: int, stored_bytes: int, what: str) -> None:
    """Refuse a claim that the file's own size cannot back.

    Args:
        claimed_bytes: memory that reading would take.
        stored_bytes: size of the file.
        what: for the message.

    Raises:
        ExperimentError: the claim is beyond `allowed_bytes`.
    """
    if claimed_bytes > allowed_bytes(stored_bytes):
        raise ExperimentError(
            f"{what} claims {claimed_bytes} bytes in a file of {stored_bytes} bytes: expected at most {allowed_bytes(stored_bytes)}; "
            "the file is damaged, export it again"
        )


def allowed_seconds(stored_bytes: int) -> int:
    """Processor time that reading a file may take.

    Args:
        stored_bytes: the file's own size.

    Returns:
        The limit in s.

    Example:
        >>> allowed_seconds(3_000_000)
        18
    """
    return FREE_SECONDS + stored_bytes // BYTES_PER_SECOND


def allowed_memory(stored_bytes: int) -> int:
    """Memory that reading a file may take: some copies of what it may unfold to.

    Args:
        stored_bytes: the file's own size.

    Returns:
        The limit in bytes.
    """
    return FREE_MEMORY + COPIES * allowed_bytes(stored_bytes)
