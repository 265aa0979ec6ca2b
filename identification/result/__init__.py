"""Results of a fit: estimates, predictions and random force, and their files."""
