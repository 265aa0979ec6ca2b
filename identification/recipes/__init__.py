"""Recordings made by others as experiments: the raw layouts of data sets, and the recipes that name them."""

from identification.recipes.layouts import RAW_READERS, Cut, RawReader
from identification.recipes.load import Recipe

__all__ = ["RAW_READERS", "Cut", "RawReader", "Recipe"]
