"""Packages whose files stand elsewhere in the tree, and kernels that `make wheel` compiled."""

from pathlib import Path

from setuptools import find_packages, setup
from setuptools.dist import Distribution


class WithKernels(Distribution):
    """A package whose kernels fit one kind of machine and one version of Python."""

    def has_ext_modules(self) -> bool:
        """So the wheel is tagged for them."""
        return True


prebuilt = any(Path("physics/prebuilt").glob("*.kernel"))
setup(
    distclass=WithKernels if prebuilt else Distribution,
    packages=[
        *find_packages(include=["physics", "physics.*", "rigid_envs", "rigid_envs.*"]),
        *find_packages(include=["training", "training.*"]),
        "training.configs",
        "training.shipped",
    ],
    package_dir={"training.configs": "configs", "training.shipped": "results"},
    package_data={
        "": ["py.typed"],
        "physics": ["prebuilt/*"],
        "training.configs": ["*.yaml"],
        "training.shipped": ["ppo/*_seed0/policy.safetensors"],
    },
)
