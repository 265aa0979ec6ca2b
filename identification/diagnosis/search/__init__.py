"""Forward search for the effects that the model leaves out."""
