"""What figures were measured on: machine, versions of packages, commit and date."""

import os
import platform
import subprocess
from datetime import date
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any

from llvmlite.binding import get_host_cpu_features, get_host_cpu_name

from physics.step.threads import default_threads

THREADS = 2  # of every side that uses threads
ROOT = Path(__file__).resolve().parents[2]
VECTORS = ("avx512f", "avx2", "avx")  # widest first
PACKAGES = ("numpy", "numba", "gymnasium", "mujoco")


def provenance() -> dict[str, Any]:
    """Date, commit, machine and versions of this process."""
    versions = {"python": platform.python_version()}
    for package in PACKAGES:
        try:
            versions[package] = version(package)
        except PackageNotFoundError:
            versions[package] = "not installed"
    return {
        "date": date.today().isoformat(),
        "commit": _commit(),
        "machine": {
            "processor": _processor(),
            "system": f"{platform.system()} {platform.machine()}",
            "cores": default_threads(),
            "threads": THREADS,
            # a load above the number of cores means that other programs slow the benchmarks down
            "load": round(os.getloadavg()[0], 2) if hasattr(os, "getloadavg") else "unknown",
        },
        "versions": versions,
    }


def describe(run: dict[str, Any]) -> str:
    """The provenance of a run in two lines."""
    machine = run["machine"]
    versions = ", ".join(f"{name} {number}" for name, number in run["versions"].items())
    return (
        f"{machine['processor']}, {machine['system']}: {machine['cores']} cores, "
        f"{machine['threads']} threads used, load {machine['load']}\n"
        f"{versions}; {run['date']}, commit {run['commit']}"
    )


def _processor() -> str:
    """Its name, and what decides the width of vectors: its kind, as LLVM names it, and AVX."""
    features = get_host_cpu_features()
    widest = next((name for name in VECTORS if features.get(name)), "no AVX")
    return f"{_processor_name()} ({get_host_cpu_name()}, {widest})"


def _processor_name() -> str:
    try:
        lines = Path("/proc/cpuinfo").read_text().splitlines()
    except OSError:
        return platform.processor() or platform.machine()
    names = [line.split(":", 1)[1].strip() for line in lines if line.startswith("model name")]
    return names[0] if names else platform.machine()


def _commit() -> str:
    def git(*arguments: str) -> str:
        run = subprocess.run(["git", *arguments], cwd=ROOT, capture_output=True, text=True)
        return run.stdout.strip() if run.returncode == 0 else ""

    head = git("rev-parse", "--verify", "--short=10", "HEAD")
    if not head:
        return "none"
    changed = git("status", "--porcelain", "--", "*.py", "pyproject.toml", "constraints*.txt")
    return head + (" with local changes" if changed else "")
