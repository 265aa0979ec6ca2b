"""Measured figures: accuracy, speed and convergence, one command each."""
