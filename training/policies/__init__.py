"""Policies as functions, and the files that hold them."""
