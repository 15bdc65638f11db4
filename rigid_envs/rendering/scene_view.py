"""What a world looks like: its solids, goal and contact forces as items that a renderer draws."""

from dataclasses import replace
from typing import Any, NamedTuple, Protocol

import numpy as np

from physics import Box, Capsule, Gripper, Ground, Scene, Sphere, Static, World
from rigid_envs.rendering.view import (
    BODY_COLORS,
    OBSERVED_COLORS,
    Arrow,
    Color,
    Item,
    Marker,
    Particles,
)

Array = np.ndarray

DRIVE_COLOR = (92, 98, 110)
ARM_COLOR = (150, 156, 166)
ARM_OPACITY = 0.45
STATIC_COLOR = (170, 170, 165)
UPRIGHT = np.array([0.0, 0.0, 0.0, 1.0])
# m of arrow to a newton
FORCE_SCALE = 0.03
# of a finger: the length of its rod in m, and its radius as a share of the tip's
STEM, SLENDER = 0.12, 0.55
# of a gripper's mechanism in m: its fingers' half thickness, how far the bar is above the hand and
# how far it reaches beyond the fingers, half the bar's height, half the length of the post on it,
# and the least distance of fingers that the bar is made for
THIN, ABOVE, BEYOND, BAR, POST, NARROWEST = 0.004, 0.06, 0.01, 0.006, 0.02, 0.1


class Shown(Protocol):
    """Running episodes, as far as pictures show them.

    Attributes:
        task: of the episodes.
        world: their worlds at present.
        count: how many worlds.
    """

    task: Any
    world: World
    count: int

    @property
    def goals(self) -> Array:
        """Desired goals [count, goal]."""


class Floor(NamedTuple):
    """The ground of a scene: its height in m and its index as a solid."""

    height: float | None
    solid: int


def floor(scene: Scene) -> Floor:
    """The ground of a scene, the highest if there are several; without one, (None, -1)."""
    first = len(scene.bodies) + len(scene.driven_bodies)
    grounds = [
        Floor(static.height, first + i)
        for i, static in enumerate(scene.statics)
        if isinstance(static, Ground)
    ]
    return max(grounds, default=Floor(None, -1), key=lambda ground: ground.height or 0.0)


def items(
    engine: World, worlds: Array, *, particles: bool = False, observed: bool = False
) -> list[Item]:
    """Bodies, drives and statics but the ground, and grippers' arms, each in all of some worlds.

    Args:
        engine: the worlds.
        worlds: [n], indices of those to show.
        particles: whether to add what the solids touch with.
        observed: whether policies observe them: in the colours that these have learned from, and
            with opaque rods and arms, which people see through, as nothing touches them.
    """
    colors, see_through = (OBSERVED_COLORS, 1.0) if observed else (BODY_COLORS, ARM_OPACITY)
    scene = engine.scene
    position, orientation = engine.position[worlds], engine.orientation[worlds]
    tools, count = engine.drive_position[worlds], len(worlds)
    sizes = np.ones((count, len(scene.bodies)))
    if engine.features.per_world_parameters:
        sizes = engine.parameters.size[worlds]
    upright = np.tile(UPRIGHT, (count, 1))

    def item(k: int, shape: Any, place: Array, turn: Array, color: Color, size: Any = 1.0) -> Item:
        balls = _particles(engine, k, shape) if particles else None
        return Item(shape, place, turn, color, balls, k, size)

    found = [
        item(
            i, body.shape, position[:, i], orientation[:, i],
            colors[i % len(colors)], sizes[:, i],
        )
        for i, body in enumerate(scene.bodies)
    ]  # fmt: skip
    first, arms = len(scene.bodies), list[Item]()
    for i, drive in enumerate(scene.driven_bodies):
        turn = np.tile(drive.orientation, (count, 1))
        found.append(item(first + i, drive.shape, tools[:, i], turn, DRIVE_COLOR))
        if isinstance(drive.shape, Sphere):
            arms.append(_stem(drive.shape.radius, tools[:, i], upright, first + i))
    first += len(scene.driven_bodies)
    for i, static in enumerate(scene.statics):
        if isinstance(static, Static):
            place, turn = (
                np.tile(static.position, (count, 1)),
                np.tile(static.orientation, (count, 1)),
            )
            found.append(item(first + i, static.shape, place, turn, STATIC_COLOR))
    for i, gripper in scene.grippers:
        near = len(scene.bodies) + i
        arms += _arm(gripper, tools[:, i], tools[:, i + 1], upright, near)
    return found + [replace(arm, opacity=see_through) for arm in arms]


def markers(shown: Shown, world: int) -> list[Marker]:
    """Goal and other markers of one world, as its task defines them."""
    return list(shown.task.markers(shown.world, world, shown.goals[world].astype(float)))


def forces(engine: World, world: int, *, particles: bool = False) -> list[Arrow]:
    """The contact forces of one world: of each two solids the sum, or of each of their points.

    An arrow starts where a force acts and points as it acts on the first of the two solids: on a
    body rather than a tool, on a tool rather than the ground.
    """
    contacts = engine.contacts(world)
    pair, point, force = contacts.pair, contacts.point, contacts.force
    first, last = pair.min(axis=1, initial=10**6), pair.max(axis=1, initial=0)
    force = np.where((pair[:, 0] > pair[:, 1])[:, None], -force, force)
    if particles:
        return [Arrow(p, FORCE_SCALE * f) for p, f in zip(point, force, strict=True)]
    arrows = []
    for a, b in sorted(set(zip(first.tolist(), last.tolist(), strict=True))):
        chosen = (first == a) & (last == b)
        pressing = np.linalg.norm(force[chosen], axis=1) + 1e-9
        middle = pressing @ point[chosen] / pressing.sum()
        arrows.append(Arrow(middle, FORCE_SCALE * force[chosen].sum(axis=0)))
    return arrows


def _particles(engine: World, solid: int, shape: object) -> Particles | None:
    """What a solid touches with; None if that is nothing, or the shape itself."""
    positions, radius = engine.samples(solid)
    return None if isinstance(shape, Sphere) or not len(positions) else Particles(positions, radius)


def _stem(radius: float, tip: Array, upright: Array, solid: int) -> Item:
    """The rod that a finger with a ball as its tip hangs from, for a person to see a finger.

    Nothing touches it. In pictures of solids it counts as the tip.
    """
    half = 0.5 * STEM
    place = tip + np.array([0.0, 0.0, half])
    return Item(Capsule(SLENDER * radius, half), place, upright, ARM_COLOR, solid=solid)


def _arm(gripper: Gripper, near: Array, far: Array, upright: Array, solid: int) -> list[Item]:
    """Fingers that hang from a bar with a post, for a person to see a gripper.

    Nothing touches them. In pictures of solids they count as the near pad, `solid`.
    """
    pad = 0.5 * gripper.shape.width
    hand, up = 0.5 * (near + far), np.array([0.0, 0.0, 1.0])
    length = 0.5 * (ABOVE - pad - BAR)  # half a finger's
    half = 0.5 * max(gripper.distance, NARROWEST) + BEYOND
    finger, bar = Box((THIN, THIN, length)), Box((1.5 * THIN, half, BAR))
    post = Box((1.5 * THIN, 1.5 * THIN, POST))
    parts = [(finger, near + (pad + length) * up), (finger, far + (pad + length) * up)]
    parts += [(bar, hand + ABOVE * up), (post, hand + (ABOVE + BAR + POST) * up)]
    return [Item(shape, place, upright, ARM_COLOR, solid=solid) for shape, place in parts]
