"""What records and their description cannot both say: told in one line before anything is fitted."""
