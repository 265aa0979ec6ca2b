"""The score test: what each candidate would gain, without fitting it."""
