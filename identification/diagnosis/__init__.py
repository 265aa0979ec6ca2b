"""Search for effects missing from the nominal model: score test, forward search, location of the misfit, verdict; see `diagnose`."""
