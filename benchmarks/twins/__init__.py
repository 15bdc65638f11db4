"""Twins beside their originals: recorded motions, what is identified from them, what remains."""
