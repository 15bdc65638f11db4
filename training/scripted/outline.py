"""Pushes a block of any outline: where the finger should touch it, by direction."""

from functools import lru_cache
from typing import NamedTuple

import numpy as np

from physics import Part
from rigid_envs.tasks.block import Block
from rigid_envs.tasks.finger import Finger
from rigid_envs.tasks.push import Push

Array = np.ndarray

# number of directions around a block; steps of the search for the contact
_DIRECTIONS, _STEPS = 360, 60
# m, distance from the block at which the finger comes down; m, tolerance of that place
_GAP, _ASIDE = 0.006, 0.012
# m, sideways deviation from its line at which a pushing finger starts again
_OFF = 0.02
# m, distance from the goal at which the finger stops pushing
_DONE = 0.02
# score bonus near the finger's current place; rad and m within which a place counts as near
_STAY, _NEARBY, _CLOSE = 0.3, 0.5, 0.02


class Outline(NamedTuple):
    """Where a finger that moves along the ground to a block's centre of mass first touches it.

    Attributes:
        angles: [k] rad, directions around the block, in the block's frame.
        reach: [k] m, distance between the centres of block and finger at contact.
        alignment: [k] cosine of the angle between the finger's motion and the face.
        height: m, height of the block's centre above the ground.
        top: m, height of the block above the ground.
    """

    angles: Array
    reach: Array
    alignment: Array
    height: float
    top: float


@lru_cache(maxsize=8)
def outline(block: Block) -> Outline:
    """The outline of a compound's parts at the height of its centre."""
    parts = [part for part in getattr(block.shape, "parts", ()) if isinstance(part, Part)]

    def distance(points: Array) -> Array:
        return np.asarray(np.min([part.distance(points) for part in parts], axis=0))

    angles = 2.0 * np.pi / _DIRECTIONS * np.arange(_DIRECTIONS)
    ways = np.stack([np.cos(angles), np.sin(angles), np.zeros(_DIRECTIONS)], axis=1)
    reach = np.full(_DIRECTIONS, block.radius + Finger.RADIUS)
    for _ in range(_STEPS):  # sphere tracing: each step is as long as the free distance
        reach -= np.maximum(distance(reach[:, None] * ways) - Finger.RADIUS, 0.0)
    at, step = reach[:, None] * ways, 1e-5 * np.eye(3)[:2]
    normal = np.stack([distance(at + s) - distance(at - s) for s in step], axis=1)
    alignment = np.sum(normal * ways[:, :2], axis=1) / np.sqrt(np.sum(normal**2, axis=1))
    top = max(float(part.ends[0][:, 2].max()) + part.ends[1] for part in parts)
    return Outline(angles, reach, alignment, block.height, block.height + top)


def push_by_outline(
    finger: Array, block: Array, yaw: Array, direction: Array, distance: Array, shape: Outline
) -> Array:
    """Next position of the finger [n, 3] m to push a block along a direction.

    The finger pushes towards the centre of mass, from the place that is most nearly behind the
    block and where the face is most nearly perpendicular to the push. There it neither slips nor
    turns the block much; later steps correct what remains.

    Args:
        finger: [n, 3] m.
        block: [n, 3] m, its centre.
        yaw: [n] rad, of the block.
        direction: [n, 2] unit vectors.
        distance: [n] m to the goal.
        shape: Outline of the block.
    """
    from_block = finger[:, :2] - block[:, :2]
    far = np.sqrt(np.sum(from_block**2, axis=1))
    level = max(shape.height, Finger.RADIUS + 0.002)
    low = finger[:, 2] < level + 0.012

    places = shape.angles + yaw[:, None]
    score = -np.cos(places) * direction[:, :1] - np.sin(places) * direction[:, 1:] + shape.alignment
    now = np.arctan2(from_block[:, 1], from_block[:, 0])
    deviation = np.abs(np.mod(places - now[:, None] + np.pi, 2.0 * np.pi) - np.pi)
    close = low & (far < shape.reach.max() + _CLOSE)
    score += _STAY * (close[:, None] & (deviation < _NEARBY))
    best = np.argmax(score, axis=1)
    angle, reach = places[np.arange(len(places)), best], shape.reach[best]

    way = -np.stack([np.cos(angle), np.sin(angle)], axis=1)
    along = np.sum(from_block * way, axis=1)
    aside = from_block - along[:, None] * way
    behind = (along < -0.6 * reach) & (np.sqrt(np.sum(aside**2, axis=1)) < _OFF)
    place = block[:, :2] - (reach + _GAP)[:, None] * way
    over = np.sqrt(np.sum((finger[:, :2] - place) ** 2, axis=1)) < _ASIDE

    target, travel = np.empty_like(finger), shape.top + Finger.RADIUS + 0.012
    target[:, :2], target[:, 2] = place, travel
    rising = ~behind & (finger[:, 2] < travel - 0.01)
    target[rising, :2] = finger[rising, :2]
    target[over & ~low, 2] = level
    pushing = behind & low
    stride = np.clip(0.6 * distance, 0.004, 0.5 * Push.finger.stride)[:, None]
    steered = finger[:, :2] + stride * way - 0.8 * aside
    target[pushing, :2], target[pushing, 2] = steered[pushing], level
    solved = distance < _DONE
    target[solved] = finger[solved]
    return target
