"""Location of the misfit, and the further record that would separate the remaining alternatives."""
