"""Do 95 % intervals cover the truth in 95 % of experiments? `python -m benchmarks.coverage`."""
