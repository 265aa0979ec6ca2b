"""Recordings made by others as experiments: the raw layouts of data sets, and the recipes that name them."""
