"""Fit of an experiment: parameters with standard errors, records with predictions."""
