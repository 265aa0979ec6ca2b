"""The fit of an experiment: parameters and their errors."""
