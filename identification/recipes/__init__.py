"""Recordings made by others as experiments: the raw layouts of data sets, and the recipes that name them."""

from identification.recipes.base import Cut, RawReader, Recipe
from identification.recipes.layouts import RAW_READERS

__all__ = ["RAW_READERS", "Cut", "RawReader", "Recipe"]
