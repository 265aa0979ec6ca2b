"""Batched sweeps beside what one would write instead."""
