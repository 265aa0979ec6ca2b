"""Sampling of the fitted likelihood: its density as one compiled function, and chains of the No-U-Turn Sampler."""
