"""Likelihood of the records: autocorrelated sensor noise, random force, random effects; estimates and model evidence that follow."""
