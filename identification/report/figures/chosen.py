"""Which records get pictures of their own: all of a few, the most telling ones of many."""

from collections.abc import Iterator

from identification.result.result import FitResult, RecordFit

MOST = 8
"""Records with pictures of their own."""


def drawn_records(result: FitResult) -> Iterator[tuple[int, RecordFit]]:
    """Number (from 1, in the order of the experiment) and record; beyond `MOST`, those with the largest misfit in any channel."""
    numbered = list(enumerate(result.records, start=1))
    worst = sorted(numbered, key=lambda item: -max(item[1].chi2_reduced.values(), default=0.0))[:MOST]
    yield from sorted(worst, key=lambda item: item[0])
