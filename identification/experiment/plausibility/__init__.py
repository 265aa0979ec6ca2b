"""Contradictions between records and their description, stated in one line before anything is fitted."""
