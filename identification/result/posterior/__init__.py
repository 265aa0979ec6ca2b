"""Sample of the posterior as part of a result."""
