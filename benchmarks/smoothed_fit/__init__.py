"""Fits with the smoothed contact law beside the chain, against the width of the smoothing."""
