"""Speed and accuracy, measured together with peers. No other package imports this one."""

import os

# kernels made for each scene, as in long runs; also in the processes that benchmarks start
os.environ.setdefault("RIGID_ENVS_KERNEL", "special")
