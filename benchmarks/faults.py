"""Faults put into the engine on purpose, and which test finds each.

    python -m benchmarks.faults [--commit COMMIT] [--tests all] [NAME ...]

Each fault changes one line of a copy of the sources: a sign, a factor, a missing term. The tests
that should find it run until the first fails. With `--tests all` the whole suite does, which takes
minutes for each fault.
"""

import argparse
import os
import re
import shutil
import subprocess
import sys
import time
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import NamedTuple

ROOT = Path(__file__).parents[1]


class Fault(NamedTuple):
    """A line of the engine with a fault.

    Attributes:
        file: below physics/.
        line: part of a line, which stands once in the file.
        fault: what stands there instead.
        tests: files or folders below tests/physics that should find it.
    """

    file: str
    line: str
    fault: str
    tests: str


FAULTS = {
    "weight": Fault(
        "motion/gravity.py", "= weight[axis, i]", "= 1.001 * weight[axis, i]",
        "integrators/test_midpoint.py",
    ),
    "cross product": Fault(
        "motion/vectors.py", "az * bx - ax * bz", "az * bx + ax * bz", "motion/test_fields.py"
    ),
    "kick of the angular momentum": Fault(
        "integrators/kick.py", "L[1, i] += time * torque[1, i]", "L[1, i] += 0.0 * torque[1, i]",
        "spring/test_contact.py",
    ),
    "midpoint of a rotation": Fault(
        "integrators/midpoint.py", "half = 0.5 * time", "half = time", "integrators/test_orders.py"
    ),
    "spin about the axis of symmetry": Fault(
        "integrators/far_rotation.py", "half = 0.5 * time * spin", "half = -0.5 * time * spin",
        "integrators/test_far_rotation.py",
    ),
    "Runge-Kutta weights": Fault(
        "integrators/tableaus.py", "(1 / 6, 1 / 3, 1 / 3, 1 / 6)", "(1 / 6, 1 / 3, 1 / 6, 1 / 3)",
        "integrators/test_orders.py",
    ),
    "normal damping": Fault(
        "spring/hunt_crossley.py", "y = a * S", "y = 0.98 * a * S", "spring/test_contact.py"
    ),
    "load of a contact": Fault(
        "spring/hunt_crossley.py", "change = load_rate * (approach",
        "change = -load_rate * (approach", "spring",
    ),
    "Coulomb's limit": Fault(
        "spring/coulomb.py", "limit = mu * normal\n", "limit = 1.01 * mu * normal\n",
        "spring/test_contact.py",
    ),
    "damping of friction": Fault(
        "spring/coulomb.py", "whole = k * h + c\n", "whole = k * h\n", "spring"
    ),
    "torque of a contact": Fault(
        "spring/contact_loop.py", "torque[1, i] += rz * fx - rx * fz",
        "torque[1, i] += rz * fx + rx * fz", "spring/test_contact.py",
    ),
    "rebound of an impulse": Fault(
        "impulse/impact_points.py", "point.impact_restitution[i] = e if",
        "point.impact_restitution[i] = 0.99 * e if", "impulse/test_impulses.py",
    ),
    "curvature of a contact": Fault(
        "impulse/contact_rows.py", "point.bend[i] = bend if touches",
        "point.bend[i] = 0.9 * bend if touches", "test_truths.py",
    ),
    "speed of pushing out": Fault(
        "impulse/sweep.py", "overlapping = max(rate * separation, -MAX_PUSH_OUT_SPEED)",
        "overlapping = rate * separation", "impulse/test_pushing_out.py",
    ),
    "centripetal acceleration in joints": Fault(
        "constraints/convective.py", "px, py, pz = _centripetal(o, i, ax, ay, az)",
        "px, py, pz = 0.0, 0.0, 0.0", "constraints/test_joints.py",
    ),
    "position of a servo in a joint": Fault(
        "constraints/joint_forces.py", "left = min(max(aim, low), high) - work.value[i]",
        "left = min(max(aim, low), high) - 0.5 * work.value[i]", "constraints",
    ),
    "momentum in the fields' velocities": Fault(
        "motion/fields.py", "half = 0.5 * drifted", "half = 0.0 * drifted", "motion/test_fields.py"
    ),
    "damping of servos": Fault(
        "motion/drives.py", "pull += damping * (moving", "pull -= damping * (moving",
        "spring/test_contact.py",
    ),
    "force limit of a gripper": Fault(
        "motion/drives.py", "carriage = min(max(0.5 * (one + two), -limit), limit)",
        "carriage = 0.5 * (one + two)", "motion/test_gripper.py",
    ),
    "distance from a capsule": Fault(
        "collision/distances.py", "z = z - min(max(z, -half_length), half_length)",
        "z = z - min(max(z, -half_length), 0.9 * half_length)",
        "collision/test_resting_heights.py",
    ),
    "penetration of a plane": Fault(
        "collision/contact_point.py", "penetration = radius - (rz + (c[2, i] - ca))",
        "penetration = radius - (rz + c[2, i] + ca)", "collision/test_resting_heights.py",
    ),
    "time of an impact": Fault(
        "step/impact_times.py", "gap + left * (speed - 0.5 * curvature * left) > 0.0",
        "gap + left * (0.5 * speed - 0.5 * curvature * left) > 0.0", "step/test_time_control.py",
    ),
    "reach of particles": Fault(
        "granular/pair_forces.py", "reach = particle[i + _3] + particle[j + _3]",
        "reach = 0.999 * (particle[i + _3] + particle[j + _3])", "granular",
    ),
    "work of servos": Fault(
        "motion/servo_work.py", "(P[c, i] + 0.5 * time * F[c, i])", "P[c, i]",
        "motion/test_servo_work.py",
    ),
}  # fmt: skip


def first_failure(root: Path, tests: list[str]) -> str:
    """The first test that fails in the sources at `root`, "" if none does."""
    environment = {**os.environ, "PYTHONPATH": str(root), "NUMBA_CACHE_DIR": str(root / "cache")}
    done = subprocess.run(
        [sys.executable, "-m", "pytest", "-q", "-x", "-n", "2", "--dist", "worksteal",
         "-m", "not packaging", *tests],
        cwd=root, env=environment, capture_output=True, text=True, check=False,
    )  # fmt: skip
    found = re.search(r"^FAILED (\S+)", done.stdout, re.MULTILINE)
    if done.returncode and not found:
        raise SystemExit(f"the tests did not run:\n{done.stdout[-2000:]}{done.stderr[-2000:]}")
    return found[1] if found else ""


def first_failure_with(fault: Fault, root: Path, tests: list[str]) -> str:
    """The same, with a fault in the sources."""
    path = root / "physics" / fault.file
    source = path.read_text(encoding="utf-8")
    if source.count(fault.line) != 1:
        raise SystemExit(f"{fault.file} has {fault.line!r} {source.count(fault.line)} times, not 1")
    path.write_text(source.replace(fault.line, fault.fault), encoding="utf-8")
    try:
        return first_failure(root, tests)
    finally:
        path.write_text(source, encoding="utf-8")


def main() -> int:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawTextHelpFormatter
    )
    parser.add_argument("names", nargs="*", metavar="NAME")
    parser.add_argument(
        "--commit", help="sources and tests of a commit; this working tree if left out"
    )
    parser.add_argument("--tests", choices=("some", "all"), default="some")
    arguments = parser.parse_args()
    chosen = arguments.names or list(FAULTS)
    if unknown := [name for name in chosen if name not in FAULTS]:
        parser.error(f"unknown fault {unknown[0]!r}: choose from {', '.join(FAULTS)}")

    def tests_of(name: str) -> list[str]:
        if arguments.tests == "all":
            return ["tests"]
        return [f"tests/physics/{test}" for test in FAULTS[name].tests.split()]

    missed = 0
    with TemporaryDirectory() as folder:
        root = Path(folder) / "sources"
        if arguments.commit:
            subprocess.run(["git", "clone", "-q", str(ROOT), str(root)], check=True)
            subprocess.run(["git", "checkout", "-q", arguments.commit], cwd=root, check=True)
        else:
            skipped = shutil.ignore_patterns(".*", "__pycache__", "runs", "dist")
            shutil.copytree(ROOT, root, ignore=skipped)
        every = sorted({test for name in chosen for test in tests_of(name)})
        if failed := first_failure(root, [test for test in every if (root / test).exists()]):
            raise SystemExit(f"{failed} fails without a fault")
        for name in chosen:
            begin = time.perf_counter()
            found = first_failure_with(FAULTS[name], root, tests_of(name))
            missed += not found
            spent = time.perf_counter() - begin
            print(f"{name:36} {spent:5.0f} s  {found or 'NOT FOUND'}", flush=True)
    print(f"{missed} not found" if missed else "all found")
    return int(missed > 0)


if __name__ == "__main__":
    raise SystemExit(main())
