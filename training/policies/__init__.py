"""Policies as functions, and the files that store them."""
