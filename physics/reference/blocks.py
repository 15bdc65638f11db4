"""Truths about blocks: one that slides down a dome, one that rocks.

As in `physics.reference.truths`, each function says the right value.
"""

import math
from collections.abc import Callable

import numpy as np

from physics.reference.truths import GRAVITY, MASS, Array, Level, step_near
from physics.scene.fidelity import resolve
from physics.scene.material import Material
from physics.scene.scene import Scene
from physics.scene.shapes import Box, Sphere
from physics.scene.solids import Body, Ground, Static
from physics.world import World

HALF = 0.02  # m, half the width of the cube that slides
BLOCK = (0.015, 0.06)  # m, half width and half height of the block that rocks
# Housner (1963): angular velocity after and before the impact of a slim block on its other edge
ROCKING = 1.0 - 1.5 * BLOCK[0] ** 2 / (BLOCK[0] ** 2 + BLOCK[1] ** 2)


def dome_slide(level: Level) -> tuple[float, float]:
    """Speed and normal force of a cube that slides down a dome of 1 m, over those of theory.

    It starts at 0.3 rad with 0.8 m/s, mu = 0.2, and is compared at 0.6 rad. Right: 1 and 1.
    """
    rough, angle, core = Material(friction=0.2), 0.3, 1.0 + HALF
    # friction turns the cube about its contact until that lies mu times its height downhill
    behind = math.atan(0.2 * HALF / core)
    distance, speed = core / math.cos(behind), 0.8
    x, z = distance * math.sin(angle), distance * math.cos(angle)
    half = 0.5 * (angle + behind)
    cube = Body(
        Box((HALF, HALF, HALF)), mass=MASS, position=(x, 0.0, z), material=rough,
        orientation=(0.0, math.sin(half), 0.0, math.cos(half)),
        linear_velocity=(speed * z / distance, 0.0, -speed * x / distance),
        angular_velocity=(0.0, speed / distance, 0.0),
    )  # fmt: skip
    world = World(Scene([cube], [Static(Sphere(1.0), material=rough)]), level)
    h, seen = step_near(level, 2e-3), [(angle, speed, math.nan)]
    while seen[-1][0] < 0.61 and len(seen) < 1000:
        world.advance(h)
        x, _, z = world.position[0, 0]
        force = world.normal_force(0, 1)[0]
        seen.append((math.atan2(x, z), float(np.linalg.norm(world.linear_velocity[0, 0])), force))
    angles, speeds, forces = np.array(seen[1:]).T
    exact, press = _slid(distance, behind, 0.2, angle, 0.6, speed)
    near = np.abs(angles - 0.6) < 0.05  # the cube sways a little
    force = np.polyval(np.polyfit(angles[near], forces[near], 1), 0.6)
    return float(np.interp(0.6, angles, speeds) / exact), float(force / (MASS * press))


def _slid(
    radius: float, behind: float, friction: float, start: float, end: float, speed: float
) -> tuple[float, float]:
    """Speed in m/s and N/m in m/s^2 at the angle `end` rad of a body that slides on a circle.

    Its contact is `behind` rad further on than its centre, so

        N/m (cos b + mu sin b) = g cos a - v^2/R,    v dv/da = R (g sin a + N/m (sin b - mu cos b)).
    """
    radial = math.cos(behind) + friction * math.sin(behind)
    along = math.sin(behind) - friction * math.cos(behind)

    def press(angle: float, square: float) -> float:
        return (GRAVITY * math.cos(angle) - square / radius) / radial

    def rate(angle: float, square: float) -> float:
        return 2.0 * radius * (GRAVITY * math.sin(angle) + press(angle, square) * along)

    square, step = speed**2, (end - start) / 1000
    for n in range(1000):
        angle = start + n * step
        middle = square + 0.5 * step * rate(angle, square)
        square += step * rate(angle + 0.5 * step, middle)
    return math.sqrt(square), press(end, square)


def rocking(level: Level, count: int = 24) -> Array:
    """[count] angular velocity after over before the impact of a block that rocks, e = 0, mu = 1.

    It is let go at half to 0.6 of the angle at which it would tip, so that it hits at any phase of
    a step. Right: `ROCKING`, by the angular momentum about the edge that is hit (Housner 1963). The
    speeds follow from the largest angles.
    """
    rounding = resolve(level).rounding * BLOCK[0]
    wide, high = BLOCK[0] - rounding, BLOCK[1] - rounding  # of the core
    tip = math.atan2(wide, high)
    # spread evenly, whatever the count, by the golden ratio
    start = (0.5 + 0.1 * np.mod(np.arange(count) * 0.5 * (math.sqrt(5.0) - 1.0), 1.0)) * tip
    block = Body(Box((BLOCK[0], *BLOCK)), mass=MASS, material=Material(1.0))
    world = World(Scene([block], [Ground(material=Material(1.0))]), level, count)
    position, orientation = np.zeros((count, 1, 3)), np.zeros((count, 1, 4))
    position[:, 0, 0] = high * np.sin(start) - wide * np.cos(start)
    position[:, 0, 2] = rounding + wide * np.sin(start) + high * np.cos(start)
    orientation[:, 0, 1], orientation[:, 0, 3] = np.sin(0.5 * start), np.cos(0.5 * start)
    world.set_state(position=position, orientation=orientation)
    h, angles = step_near(level, 1e-3), []
    for _ in range(int(0.6 / h)):
        world.advance(h)
        angles.append(2.0 * np.arctan2(world.orientation[:, 0, 1], world.orientation[:, 0, 3]))
    ratios = []
    for begins, angle in zip(start, np.array(angles).T, strict=True):
        over = int(np.argmax(angle < 0.0))
        far = -angle[over : over + int(0.3 / h)].min()
        rises, falls = (math.cos(tip - a) - math.cos(tip) for a in (far, begins))
        ratios.append(math.sqrt(max(rises, 0.0) / falls))
    return np.array(ratios)


# as `truths.BALLS`
BLOCKS: tuple[tuple[str, float, Callable[[Level], float]], ...] = (
    ("speed of a cube that slides down a dome, over theory", 1.0, lambda f: dome_slide(f)[0]),
    ("its normal force, over theory", 1.0, lambda f: dome_slide(f)[1]),
    ("rocking block, speed after over before, mean", ROCKING, lambda f: rocking(f).mean()),
)
