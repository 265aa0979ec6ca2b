"""Records cut into windows, and where a fit of them begins."""
