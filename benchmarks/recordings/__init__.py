"""Diagnoses of recordings by others, and the page about them."""
