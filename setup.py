"""Packages whose files stand elsewhere in the source tree: settings and trained policies."""

from setuptools import find_packages, setup

setup(
    packages=[
        *find_packages(include=["physics", "physics.*", "rigid_envs", "rigid_envs.*"]),
        *find_packages(include=["training", "training.*"]),
        "training.configs",
        "training.shipped",
    ],
    package_dir={"training.configs": "configs", "training.shipped": "results"},
    package_data={
        "": ["py.typed"],
        "training.configs": ["*.yaml"],
        "training.shipped": ["ppo/*_seed0/policy.safetensors"],
    },
)
