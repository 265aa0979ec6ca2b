"""Windows of the records (multiple shooting), and first guesses for a fit."""
