"""Figures of the estimates themselves: sample of the posterior, likelihood profiles."""
