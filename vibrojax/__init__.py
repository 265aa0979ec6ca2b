"""Vibro-impact systems in JAX: a hammer on a suspension, a moving cart, a stop, and the contact law between them."""

__version__ = "0.1.0"
