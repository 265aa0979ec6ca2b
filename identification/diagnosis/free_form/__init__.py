"""Free-form missing force: a sum of terms selected from the records."""
