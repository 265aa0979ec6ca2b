"""Residuals of all windows and how a sum of squares is minimised."""
