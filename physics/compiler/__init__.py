"""How numba compiles kernels, and where compiled code is kept."""
