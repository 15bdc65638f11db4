"""Kernels of the renderer: rays from the eye and to the sun, and the colours that they give."""
