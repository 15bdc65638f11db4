"""How to push a block of any outline: where a finger touches it, and how squarely, by direction."""

from functools import lru_cache
from typing import NamedTuple

import numpy as np

from physics import Part
from rigid_envs.tasks.block import Block
from rigid_envs.tasks.push import FINGER, STRIDE

Array = np.ndarray

# places around a block that are looked at, and steps of a finger toward it
_PLACES, _STEPS = 360, 60
# m that a finger comes down from the block, and m of that place that will do
_GAP, _ASIDE = 0.006, 0.012
# m beside its line at which a finger that pushes begins anew
_OFF = 0.02
# m of the goal at which the finger stops pushing
_DONE = 0.02
# what being at a place is worth, rad beside it that count as there, and m of the block, likewise
_STAY, _THERE, _BESIDE = 0.3, 0.5, 0.02


class Outline(NamedTuple):
    """What a finger finds that comes along the ground toward a block's centre of mass.

    Attributes:
        angles: [k] rad, of the places that it comes from, in the block's frame.
        reach: [k] m, from the block's centre to the finger's where it touches.
        square: [k] cosine of the angle between its way and the face that it meets.
        height: m, of the block's centre over the ground.
        top: m, of the block over the ground.
    """

    angles: Array
    reach: Array
    square: Array
    height: float
    top: float


@lru_cache(maxsize=8)
def outline(block: Block) -> Outline:
    """The outline of a compound's parts at the height of its centre."""
    parts = [part for part in getattr(block.shape, "parts", ()) if isinstance(part, Part)]

    def distance(points: Array) -> Array:
        return np.asarray(np.min([part.distance(points) for part in parts], axis=0))

    angles = 2.0 * np.pi / _PLACES * np.arange(_PLACES)
    ways = np.stack([np.cos(angles), np.sin(angles), np.zeros(_PLACES)], axis=1)
    reach = np.full(_PLACES, block.radius + FINGER)
    for _ in range(_STEPS):  # as far as it can't meet anything
        reach -= np.maximum(distance(reach[:, None] * ways) - FINGER, 0.0)
    at, step = reach[:, None] * ways, 1e-5 * np.eye(3)[:2]
    normal = np.stack([distance(at + s) - distance(at - s) for s in step], axis=1)
    square = np.sum(normal * ways[:, :2], axis=1) / np.sqrt(np.sum(normal**2, axis=1))
    top = max(float(part.ends[0][:, 2].max()) + part.ends[1] for part in parts)
    return Outline(angles, reach, square, block.height, block.height + top)


def by_outline(finger: Array, block: Array, yaw: Array, ahead: Array, apart: Array,
               seen: Outline) -> Array:  # fmt: skip
    """Where the finger should be [n, 3] m next to push a block along a direction.

    Of all places around the block it pushes from the one that lies most nearly behind and is met
    most squarely, toward the centre of mass: then the finger neither slips nor turns it much.
    What the block's way is off, the next steps make good.

    Args:
        finger: [n, 3] m.
        block: [n, 3] m, its centre.
        yaw: [n] rad, of the block.
        ahead: [n, 2] unit vectors, where it is to go.
        apart: [n] m, how far.
        seen: its outline.
    """
    from_block = finger[:, :2] - block[:, :2]
    far = np.sqrt(np.sum(from_block**2, axis=1))
    level = max(seen.height, FINGER + 0.002)
    low = finger[:, 2] < level + 0.012

    places = seen.angles + yaw[:, None]
    score = -np.cos(places) * ahead[:, :1] - np.sin(places) * ahead[:, 1:] + seen.square
    now = np.arctan2(from_block[:, 1], from_block[:, 0])
    beside = np.abs(np.mod(places - now[:, None] + np.pi, 2.0 * np.pi) - np.pi)
    there = low & (far < seen.reach.max() + _BESIDE)
    score += _STAY * (there[:, None] & (beside < _THERE))
    best = np.argmax(score, axis=1)
    angle, reach = places[np.arange(len(places)), best], seen.reach[best]

    way = -np.stack([np.cos(angle), np.sin(angle)], axis=1)
    along = np.sum(from_block * way, axis=1)
    aside = from_block - along[:, None] * way
    behind = (along < -0.6 * reach) & (np.sqrt(np.sum(aside**2, axis=1)) < _OFF)
    place = block[:, :2] - (reach + _GAP)[:, None] * way
    over = np.sqrt(np.sum((finger[:, :2] - place) ** 2, axis=1)) < _ASIDE

    target, travel = np.empty_like(finger), seen.top + FINGER + 0.012
    target[:, :2], target[:, 2] = place, travel
    rising = ~behind & (finger[:, 2] < travel - 0.01)
    target[rising, :2] = finger[rising, :2]
    target[over & ~low, 2] = level
    pushing = behind & low
    stride = np.clip(0.6 * apart, 0.004, 0.5 * STRIDE)[:, None]
    steered = finger[:, :2] + stride * way - 0.8 * aside
    target[pushing, :2], target[pushing, 2] = steered[pushing], level
    solved = apart < _DONE
    target[solved] = finger[solved]
    return target
