"""A missing force of no given form, learned as a formula."""
