"""Tests of the first guesses."""
