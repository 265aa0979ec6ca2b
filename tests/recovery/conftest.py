"""Recoveries compile one program for each candidate: they are compiled with fewer optimisations."""

from tests.quick_compiling import quick_compiling as quick_compiling
