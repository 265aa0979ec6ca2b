"""What the nominal model leaves out: score, search, location, verdict; `identification.diagnosis.diagnose` runs them."""
