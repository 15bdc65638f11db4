"""How numba compiles kernels, and where compiled code is kept."""

from physics.compiler import versions  # noqa: F401  (an error here comes before all others)
