"""What is read off an experiment before a fit: declared model, recorded inputs, smoothed motion, first guesses; and simulation."""
