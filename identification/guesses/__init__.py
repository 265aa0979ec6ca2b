"""What a fit starts from: declared model, fitted part of the records, their smoothed motion and recorded inputs, first guesses."""
