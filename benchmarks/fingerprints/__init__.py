"""The mark that each listed effect leaves in a record."""

from benchmarks.fingerprints.marks import FINGERPRINTS, Fingerprint, effect_of

__all__ = ["FINGERPRINTS", "Fingerprint", "effect_of"]
