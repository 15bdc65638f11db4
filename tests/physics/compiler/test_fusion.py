"""Products are fused with sums before LLVM copies code, so that all lanes fuse the same ones."""

import numpy as np
import pytest

from physics import PRESETS, Body, Box, Gripper, Ground, Material, Scene, World
from physics.compiler.fusion import fuse_products
from physics.compiler.jit import LANES, entry, stage

FUNCTION = """define double @"f"(double %"a", double %"b", double %"c")
{{
entry:
{lines}
  ret double %".9"
}}
"""


def fused(*lines):
    """What becomes of the lines of a function."""
    text = fuse_products(FUNCTION.format(lines="\n".join(f"  {line}" for line in lines)))
    body = text.split("entry:\n")[1].split("\n  ret")[0]
    return [line.strip() for line in body.splitlines()]


def call(a, b, c):
    return f'%".9" = call double @llvm.fmuladd.f64(double {a}, double {b}, double {c})'


PRODUCT = '%".1" = fmul double %"a", %"b"'


def test_a_product_is_fused_with_its_sum():
    assert fused(PRODUCT, '%".9" = fadd double %".1", %"c"') == [call('%"a"', '%"b"', '%"c"')]
    assert fused(PRODUCT, '%".9" = fadd double %"c", %".1"') == [call('%"a"', '%"b"', '%"c"')]


def test_a_product_is_fused_with_its_difference():
    minus = '%".9.minus" = fneg double'
    assert fused(PRODUCT, '%".9" = fsub double %".1", %"c"') == [
        f'{minus} %"c"', call('%"a"', '%"b"', '%".9.minus"'),
    ]  # fmt: skip
    assert fused(PRODUCT, '%".9" = fsub double %"c", %".1"') == [
        f'{minus} %"a"', call('%".9.minus"', '%"b"', '%"c"'),
    ]  # fmt: skip


def test_of_two_products_the_left_one_is_fused():
    right = '%".2" = fmul double %"b", %"c"'
    assert fused(PRODUCT, right, '%".9" = fadd double %".2", %".1"') == [
        PRODUCT, call('%"b"', '%"c"', '%".1"'),
    ]  # fmt: skip


def test_a_product_that_is_read_twice_is_kept():
    twice = (PRODUCT, '%".2" = fadd double %".1", %"c"', '%".9" = fadd double %".2", %".1"')
    assert fused(*twice) == list(twice)


CUBE = Body(Box((0.02, 0.02, 0.02)), mass=0.1, material=Material(0.5, 0.1))
PADS = Gripper(
    Box((0.015,) * 3), mass=0.3, force_limit=14.0, grip_limit=4.0, position=(0.0, 0.0, 0.12),
    distance=0.11, frequency=40.0, material=Material(2.0, 0.0),
)  # fmt: skip


@pytest.mark.parametrize("preset", PRESETS)
def test_all_lanes_give_the_same_bits(preset):
    """Cubes that tumble under a gripper, the same in every lane.

    When LLVM chose what to fuse, the last four lanes differed at "accurate".
    """
    scene = Scene([CUBE, CUBE], [Ground(Material(0.5, 0.1))], drives=[PADS])
    world, random = World(scene, PRESETS[preset], LANES), np.random.default_rng(0)

    above = np.array([0.0, 0.0, 0.05])

    def alike(values):
        return np.broadcast_to(values, (LANES, *values.shape))

    for step in range(1000):
        if step % 40 == 0:
            world.set_state(
                position=alike(random.uniform(-0.03, 0.03, (2, 3)) + above),
                orientation=alike(random.normal(size=(2, 4))),
                linear_velocity=alike(0.5 * random.normal(size=(2, 3)) - 10.0 * above),
                angular_velocity=alike(10.0 * random.normal(size=(2, 3))),
            )
        world.advance(4.0 * PRESETS[preset].substep)
        for values in (world.position, world.linear_velocity, world.angular_velocity):
            np.testing.assert_array_equal(values, alike(values[0]))


@stage
def add_product(a, b, c):
    return a * b + c


@entry
def add_products(values):
    values[0] = add_product(values[1], values[2], values[3])


def test_a_compiled_stage_fuses_its_product():
    """If the text that llvmlite prints changed, no product would be fused any more, silently."""
    values = np.array([0.0, 1.0 + 2.0**-30, 1.0 - 2.0**-30, -1.0])
    assert values[1] * values[2] == 1.0  # rounded
    add_products(values)
    assert values[0] == -(2.0**-60)  # rounded once, after the sum
