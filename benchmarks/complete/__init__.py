"""Whether fits of complete models are right where the records are awkward."""
