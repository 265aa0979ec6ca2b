"""What recorded files hold, before anyone has described them: facts, guesses, and a proposed experiment file. No fit, no JAX."""

from identification.inspection.inspect import inspect_path, summary
from identification.inspection.proposal import propose

__all__ = ["inspect_path", "propose", "summary"]
