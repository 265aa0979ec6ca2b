"""One trajectory per record: a chain of short segments, fitted, weighed and predicted in one likelihood."""
