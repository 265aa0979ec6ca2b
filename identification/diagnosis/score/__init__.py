"""Score test: expected log-likelihood gain of every candidate, without refitting."""
