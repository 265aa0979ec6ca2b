"""The likelihood of records: sensor noise, random force, random effects, and what follows of them for estimates and models."""
