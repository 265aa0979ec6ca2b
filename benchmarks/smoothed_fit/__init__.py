"""Fits with the smoothed contact law beside those of the exact contact, against the width of the smoothing."""
