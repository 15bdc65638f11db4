"""What a world looks like: its solids, goal and contact forces as items that a renderer draws."""

from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from physics import Box, Compound, Cylinder, Gripper, Mesh, Part, Sphere, Static, Torus
from physics import Particles as ParticleShape
from physics.rotation import multiply, rotate
from rigid_envs.rendering.view import BODY_COLORS, Arrow, Color, Item, Marker, Particles

if TYPE_CHECKING:
    from rigid_envs.episodes.runner import Runner

Array = np.ndarray

DRIVE_COLOR = (92, 98, 110)
ARM_COLOR = (150, 156, 166)
STATIC_COLOR = (170, 170, 165)
UPRIGHT = np.array([0.0, 0.0, 0.0, 1.0])
# m of arrow to a newton
FORCE_SCALE = 0.03
# of a gripper's mechanism in m: its fingers' half thickness, how far the bar is above the hand and
# how far it reaches beyond the fingers, half the bar's height, half the length of the post on it,
# and the least distance of fingers that the bar is made for
THIN, ABOVE, BEYOND, BAR, POST, NARROWEST = 0.004, 0.06, 0.01, 0.006, 0.02, 0.1


class Solid(NamedTuple):
    """A solid as the scene describes it.

    Attributes:
        shape: of the size that it has in its world.
        position: [3] m.
        orientation: [4] quaternion x, y, z, w.
        color: red, green, blue in 0..255.
        balls: what it touches with, if that is to be drawn.
    """

    shape: Any
    position: Array
    orientation: Array
    color: Color
    balls: Particles | None = None


def solids(runner: "Runner", world: int, *, particles: bool = False) -> list[Solid]:
    """Bodies, drives and statics of one world but the ground, and grippers' arms.

    Args:
        runner: whose worlds.
        world: index of the world.
        particles: whether to add what the solids touch with.
    """
    engine, scene = runner.world, runner.world.scene
    sizes = np.ones(len(scene.bodies))
    if engine.features.per_world_parameters:
        sizes = engine.parameters.size[world]
    found: list[Solid] = []
    for i, body in enumerate(scene.bodies):
        shape = body.shape if sizes[i] == 1.0 else body.shape.scaled(float(sizes[i]))
        pose = engine.position[world, i], engine.orientation[world, i]
        balls = _particles(runner, i, body.shape) if particles else None
        found.append(Solid(shape, *pose, BODY_COLORS[i % len(BODY_COLORS)], balls))
    tools, first = engine.drive_position[world], len(scene.bodies)
    for i, drive in enumerate(scene.driven_bodies):
        balls = _particles(runner, first + i, drive.shape) if particles else None
        turn = np.array(drive.orientation)
        found.append(Solid(drive.shape, tools[i], turn, DRIVE_COLOR, balls))
    for i, static in enumerate(scene.statics):
        if isinstance(static, Static):
            pose = np.array(static.position), np.array(static.orientation)
            solid = first + len(scene.driven_bodies) + i
            balls = _particles(runner, solid, static.shape) if particles else None
            found.append(Solid(static.shape, *pose, STATIC_COLOR, balls))
    for i, gripper in scene.grippers:
        found += _arm(gripper, tools[i], tools[i + 1])
    return found


def items(runner: "Runner", world: int, *, particles: bool = False) -> list[Item]:
    """The solids of one world as items for the painter, as particles if asked for."""
    drawn = solids(runner, world, particles=particles)
    return [item for solid in drawn for item in _items(*solid)]


def _items(
    shape: object, position: Array, orientation: Array, color: Color, balls: Particles | None
) -> list[Item]:
    """A solid as an item; a compound as one for each part, each with the balls nearest to it.

    A mesh is a box of faint lines around balls along its surface, particles are one around them; a
    torus is a ring of balls.
    """
    if isinstance(shape, Torus):
        ring = shape.particles(0.25 * shape.minor_radius)
        disc = Cylinder(shape.reach, shape.minor_radius)
        drawn = balls or Particles(ring.positions, ring.radius)
        return [Item(disc, position, orientation, color, drawn)]
    if isinstance(shape, ParticleShape):
        half = np.abs(shape.points).max(axis=0) + shape.radius
        drawn = Particles(shape.points, shape.radius)
        return [Item(Box(tuple(half)), position, orientation, color, drawn)]
    if isinstance(shape, Mesh):
        samples = shape.samples(shape.width / 8.0, shape.width / 16.0)
        drawn = balls or Particles(samples.positions, samples.radius)
        box = Box(shape.surface(0.0).parameters)
        return [Item(box, position, orientation, color, drawn)]
    if not isinstance(shape, Compound):
        return [Item(shape, position, orientation, color, balls)]
    found, nearest = [], np.zeros(0)
    if balls is not None:
        apart = [part.distance(balls.positions) for part in shape.parts]  # type: ignore[union-attr]
        nearest = np.argmin(apart, axis=0)
    for k, part in enumerate(shape.parts):
        assert isinstance(part, Part)
        own = None
        if balls is not None:
            mine, radius = nearest == k, np.broadcast_to(balls.radius, len(nearest))
            own = Particles(part.inward(balls.positions[mine]), radius[mine])
        place = position + rotate(orientation, np.array(part.position))
        turn = multiply(orientation, np.array(part.orientation))
        found.append(Item(part.shape, place, turn, color, own))
    return found


def markers(runner: "Runner", world: int) -> list[Marker]:
    """Goal and other markers of one world, as its task defines them."""
    goal = runner.goals[world].astype(float)
    return list(runner.task.markers(runner.world, world, goal))


def forces(runner: "Runner", world: int, *, particles: bool = False) -> list[Arrow]:
    """The contact forces of one world: of each two solids the sum, or of each of their points.

    An arrow starts where a force acts and points as it acts on the first of the two solids: on a
    body rather than a tool, on a tool rather than the ground.
    """
    contacts = runner.world.contacts(world)
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


def _particles(runner: "Runner", solid: int, shape: object) -> Particles | None:
    """What a solid touches with; None if that is nothing, or the shape itself."""
    positions, radius = runner.world.samples(solid)
    return None if isinstance(shape, Sphere) or not len(positions) else Particles(positions, radius)


def _arm(gripper: Gripper, near: Array, far: Array) -> list[Solid]:
    """Fingers that hang from a bar with a post: nothing solid, for a person to see a gripper."""
    pad = 0.5 * gripper.shape.width
    hand, up = 0.5 * (near + far), np.array([0.0, 0.0, 1.0])
    length = 0.5 * (ABOVE - pad - BAR)  # half a finger's
    apart = max(gripper.distance, float(far[1] - near[1]), NARROWEST)
    half = 0.5 * apart + BEYOND
    parts = [(Box((THIN, THIN, length)), end + (pad + length) * up) for end in (near, far)]
    parts.append((Box((1.5 * THIN, half, BAR)), hand + ABOVE * up))
    parts.append((Box((1.5 * THIN, 1.5 * THIN, POST)), hand + (ABOVE + BAR + POST) * up))
    return [Solid(shape, position, UPRIGHT, ARM_COLOR) for shape, position in parts]
