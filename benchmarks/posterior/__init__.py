"""Whether the posterior, the standard errors and the likelihood profiles of a fit agree. `python -m benchmarks.posterior`."""
