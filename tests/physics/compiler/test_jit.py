"""Only the compiler knows numba; without numba the stages are plain Python."""

import contextlib
import io
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

import physics

PACKAGE = Path(physics.__file__).parent
ROOT = PACKAGE.parent

PUSH = """
from physics import World
from physics.reference import scenes
world = World(scenes.push_like(), per_world_parameters={per_world})
if world.features.per_world_parameters:
    world.set_parameters(mass=0.17, friction=0.3, restitution=0.4)
world.set_state(position=(0.0, 0.0, 0.0199), drive_position=(-0.0349, 0.0, 0.021))
world.command_drives((0.3, 0.1, 0.0))
world.advance(0.02)
values = (world.position, world.orientation, world.linear_velocity, world.angular_velocity)
values += (world.drive_position, world.contacts().force)
print(*[repr(float(x)) for v in values for x in v.ravel()])
"""


def run(program, cache, root=ROOT, **variables):
    """Numbers that a program prints in a process of its own."""
    environment = {
        **os.environ,
        "PYTHONPATH": str(root),
        "NUMBA_CACHE_DIR": str(cache),
        "PYTHONDONTWRITEBYTECODE": "1",
        **variables,
    }
    done = subprocess.run(
        [sys.executable, "-c", program],
        env=environment, cwd=root, capture_output=True, text=True, timeout=300,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    return [float(x) for x in done.stdout.split()]


def test_only_the_compiler_knows_numba():
    for path in PACKAGE.rglob("*.py"):
        if PACKAGE / "compiler" not in path.parents:
            assert "numba" not in "".join(
                line for line in path.read_text().splitlines(True) if "import" in line
            ), path


@pytest.mark.parametrize("per_world", [False, True])
def test_without_compilation_the_same_stages_give_the_same_numbers(tmp_path, per_world, stress):
    if per_world and not stress:
        pytest.skip("half a minute in plain Python; see make stress")
    script = PUSH.format(per_world=per_world)
    plain = run(script, tmp_path, NUMBA_DISABLE_JIT="1")
    printed = io.StringIO()
    with contextlib.redirect_stdout(printed):
        exec(script, {})  # in this process, which shares kernels with the other tests
    compiled = [float(x) for x in printed.getvalue().split()]
    assert len(plain) == len(compiled) > 20
    np.testing.assert_allclose(plain, compiled, rtol=1e-9, atol=1e-9)
