"""How often a diagnosis is right on rigs without a stop, and without a spring."""
