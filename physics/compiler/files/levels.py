"""Levels of x86-64 processors, for which a wheel brings kernels.

A kernel that was compiled for a level runs on every processor that has its instructions. Results
are bitwise the same: products are fused by rule, and vectors of any length do the same operations.
"""

from functools import cache

from llvmlite import binding

# what the newest instructions of each level are, in LLVM's words; the highest level first
_INSTRUCTIONS = {
    "x86-64-v4": ("avx512f", "avx512bw", "avx512cd", "avx512dq", "avx512vl"),
    "x86-64-v3": ("avx2", "bmi", "bmi2", "f16c", "fma", "lzcnt", "movbe"),
}
LEVELS = tuple(reversed(_INSTRUCTIONS))


@cache
def offered() -> tuple[str, ...]:
    """The levels that this processor has, the highest first."""
    has = binding.get_host_cpu_features()
    lacks = {level: not all(has.get(x) for x in needs) for level, needs in _INSTRUCTIONS.items()}
    return tuple(level for level in _INSTRUCTIONS if not lacks[level])
