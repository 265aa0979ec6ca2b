"""Which record would part the causes that these records cannot."""

from identification.discrepancy.diagnosis import Asserted
from identification.discrepancy.search import Search


def next_experiment(found: Search, effects: tuple[Asserted, ...], ambiguous: tuple[str, ...]) -> str:
    """One sentence; empty where nothing is in doubt."""
    return ""
