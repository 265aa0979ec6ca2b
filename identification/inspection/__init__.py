"""What recorded files hold, before anyone has described them: facts, guesses, and a proposed experiment file. No fit, no JAX."""

from identification.inspection.inspect import inspect_path
from identification.inspection.proposal import propose
from identification.inspection.table import summary
from identification.inspection.template import template

__all__ = ["inspect_path", "propose", "summary", "template"]
