"""The versions of numba that kernels can be compiled with.

`linking`, `resolution` and `kernel_files` use parts of numba that are not public, and that change
from one version to the next. `make oldest` tests the first version, all else the last.
"""

import numba

FIRST, BEYOND = (0, 62), (0, 69)


def check_numba(version: str) -> None:
    """Raises ImportError if kernels can't be compiled with this version of numba."""
    found = tuple(int(part) for part in version.split(".")[:2])
    if not FIRST <= found < BEYOND:
        text = [".".join(map(str, bound)) for bound in (FIRST, BEYOND)]
        raise ImportError(
            f"numba {version} is installed, but rigid-envs needs at least {text[0]} and less than "
            f'{text[1]}: pip install "numba>={text[0]},<{text[1]}"'
        )


check_numba(numba.__version__)
