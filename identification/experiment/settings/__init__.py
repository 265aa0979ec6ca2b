"""The tables of `experiment.toml`."""
