"""What the nominal model leaves out: score, search, location, verdict; `identification.diagnose` runs them."""
