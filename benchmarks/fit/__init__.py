"""The whole fit beside SciPy's `least_squares` with finite differences around a compiled simulator: `python -m benchmarks.fit`."""
