"""A controller for PushT: a model of slow pushing chooses where and how to push.

The friction of a slow slider on the ground is described by an ellipsoidal limit surface: a force f
at a point p moves the slider by (f, (p x f) / c^2) per unit, in x, y and yaw, where c is a radius
of the slider (Lynch, Maekawa & Tanie, Manipulation and active sensing by pushing using tactile
feedback, IROS 1992). A finger that moves as the slider at p does not slip, if f lies within the
friction cone.
"""

from functools import cache
from typing import NamedTuple

import numpy as np

from rigid_envs.tasks.coverage import BAR, STEM, uncovered
from rigid_envs.tasks.finger import Finger
from rigid_envs.tasks.goals import distance
from rigid_envs.tasks.push_t import (
    FRICTION,
    GRAVITY,
    GYRATION,
    MASS,
    PushT,
    pose_distance,
    turn_between,
)

Array = np.ndarray

_SPACING = 0.01  # m, between the places from which to push
_ANGLES = np.radians([-18.0, 0.0, 18.0])  # rad, of the force from the normal; friction allows 26
_RADIUS = 0.9 * GYRATION  # m, c in the model
_LENGTHS = np.array([0.004, 0.008, 0.015, 0.025, 0.04, 0.06, 0.09])  # m, of a push
_GAP = 0.008  # m, between finger and T on the way to a place
_TRAVEL = 1.5  # what a metre of travel costs, as a factor on the pose error
_DETOUR = 1.1  # how much longer a way along the T counts than a straight one
_CLOSE = 0.008  # m, from the place of contact at which a push starts
# m, of a push against the whole friction of the T. The servo's force is M omega v; with two thirds
# of the friction the T creeps instead of being thrown ahead
_SERVO = Finger.MASS * PushT.finger.drive().frequency  # N s/m
_LEAD = 2.0 / 3.0 * FRICTION * MASS * GRAVITY / _SERVO * PushT.frame
_DONE = 0.095  # part of the goal that is not covered at which the finger rests


class Places(NamedTuple):
    """Where a finger can touch the T, in the T's frame, and the way from place to place.

    Attributes:
        contact: [k, 2] m, of the finger's centre at contact.
        ways: [w, 2] m, points of a way around the T, counterclockwise.
        entry: [k], index of the way's point that is opposite each place.
        along: [w, k] m, what the way from each of its points to each place counts.
        motion: [k, angles, 3] of the T per unit of push: x, y, yaw.
        push: [k, angles, 2] unit vectors, direction of the finger.
        lead: [k, angles] m, by which a finger that pushes is ahead of where it is: its servo's
            force is that of the friction.
    """

    contact: Array
    ways: Array
    entry: Array
    along: Array
    motion: Array
    push: Array
    lead: Array


@cache
def places() -> Places:
    """The places around the T."""
    (middle, right, half), (low_middle, inner, low_half) = BAR, STEM
    top, under, bottom = middle + half, middle - half, low_middle - low_half
    corners = np.array([
        [right, under], [right, top], [-right, top], [-right, under],
        [-inner, under], [-inner, bottom], [inner, bottom], [inner, under],
    ])  # fmt: skip
    convex = np.array([True, True, True, True, False, True, True, False])
    room = Finger.RADIUS + _GAP
    points, normals, ways, entry = [], [], [], []
    for i, corner in enumerate(corners):
        side = corners[(i + 1) % len(corners)] - corner
        length = float(np.hypot(*side))
        along = side / length
        normal = np.array([-along[1], along[0]])  # inwards
        before = corner - corners[i - 1]
        if convex[i]:
            ways.append(corner + room * (before / np.hypot(*before) - along))
        for share in (np.arange(round(length / _SPACING)) + 0.5) / round(length / _SPACING):
            point = corner + share * side
            if _clearance(point - (Finger.RADIUS + 1e-6) * normal) >= Finger.RADIUS:
                entry.append(len(ways))
                ways.append(point - room * normal)
                points.append(point)
                normals.append(normal)
    way, point, normal = np.array(ways), np.array(points), np.array(normals)
    step = np.sqrt(np.sum((np.roll(way, -1, axis=0) - way) ** 2, axis=1))
    at = np.cumsum(step) - step
    along_way = np.abs(at[:, None] - at[entry])
    along_way = _DETOUR * np.minimum(along_way, step.sum() - along_way)

    c, s = np.cos(_ANGLES)[:, None], np.sin(_ANGLES)[:, None]
    across = np.stack([-normal[:, 1], normal[:, 0]], axis=1)
    force = c * normal[:, None] + s * across[:, None]  # [k, angles, 2]
    turn = (point[:, None, 0] * force[..., 1] - point[:, None, 1] * force[..., 0]) / _RADIUS**2
    lever = np.stack([-point[:, 1], point[:, 0]], axis=1)[:, None]
    push = force + turn[..., None] * lever
    length = np.sqrt(np.sum(push**2, axis=2, keepdims=True))
    motion = np.concatenate([force, turn[..., None]], axis=2) / length
    contact = point - Finger.RADIUS * normal
    lead = _LEAD / np.sqrt(1.0 + (_RADIUS * turn) ** 2)  # by the limit surface
    return Places(contact, way, np.array(entry), along_way, motion, push / length, lead)


def _clearance(points: Array) -> Array:
    """Distance [...] m of points [..., 2] in the T's frame from the T."""
    found = np.full(points.shape[:-1], np.inf)
    for middle, half_width, half_height in (BAR, STEM):
        out = np.abs(points - (0.0, middle)) - (half_width, half_height)
        found = np.minimum(found, np.sqrt(np.sum(np.maximum(out, 0.0) ** 2, axis=-1)))
    return found


def _free(start: Array, ends: Array) -> Array:
    """Which ways [n, k] from start [n, 2] to ends [k, 2] pass the T without touching it."""
    free = np.ones((len(start), len(ends)), dtype=bool)
    way = ends - start[:, None]  # [n, k, 2]
    way = np.where(np.abs(way) < 1e-9, 1e-9, way)
    for middle, half_width, half_height in (BAR, STEM):
        room = np.array([half_width, half_height]) + Finger.RADIUS - 0.002
        from_middle = (start - (0.0, middle))[:, None]
        a, b = (-room - from_middle) / way, (room - from_middle) / way
        enters = np.minimum(a, b).max(axis=2)
        leaves = np.maximum(a, b).min(axis=2)
        free &= (enters > leaves) | (leaves < 0.0) | (enters > 1.0)
    return free


def push_t(observation: dict[str, Array]) -> Array:
    """Goes to the place from which a push brings the T nearest to its goal, and pushes.

    Args:
        observation: Of PushT.

    Returns:
        [n, 2] actions within ±1.
    """
    values = observation["observation"].astype(float)
    goal = observation["desired_goal"].astype(float)
    pose, own = values[:, 4:8], values[:, 11:13]  # the finger is observed in the T's frame
    n = np.arange(len(values))
    known = places()

    # the goal in the T's frame
    offset = goal[:, :2] - pose[:, :2]
    x, y = _turned(offset, pose[:, 2], -pose[:, 3]).T
    turn = turn_between(goal, pose)
    after = _errors(x, y, turn, known.motion)  # [n, k, angles, lengths]
    length = np.argmin(after, axis=3)
    least = after.min(axis=3)
    to_way = np.sqrt(np.sum((own[:, None] - known.ways) ** 2, axis=2))
    to_way = np.where(_free(own, known.ways), to_way, np.inf)
    around = (to_way[:, :, None] + known.along).min(axis=1)  # [n, k]
    to_contact = np.sqrt(np.sum((own[:, None] - known.contact) ** 2, axis=2))
    touching = to_contact < _CLOSE
    far = np.where(touching, to_contact, np.minimum(around, 1.0) + _GAP)
    now = pose_distance(x, y, turn)
    score = least + (_TRAVEL * now[:, None] * far)[:, :, None]
    score = np.where(least < 0.9 * now[:, None, None], score, least + 1.0)
    best = np.argmin(score.reshape(len(n), -1), axis=1)
    place, angle = np.divmod(best, len(_ANGLES))

    pushes = touching[n, place]
    # to the first point of the way that can be reached on a straight line
    way = np.argmin(to_way + known.along[:, place].T, axis=1)
    target = known.ways[way]
    arrived = (way == known.entry[place]) & (to_way[n, way] < 0.004)
    target[arrived] = known.contact[place[arrived]]
    stride = np.clip(0.35 * _LENGTHS[length[n, place, angle]], 0.0015, 0.012)
    stride += known.lead[place, angle]
    pushed = known.contact[place] + stride[:, None] * known.push[place, angle]
    target[pushes] = pushed[pushes]
    move = _turned(target - own, pose[:, 2], pose[:, 3])
    move[distance(pose, goal, uncovered) < _DONE] = 0.0
    return np.clip(move / PushT.finger.stride, -1.0, 1.0)


def _turned(v: Array, c: Array, s: Array) -> Array:
    """Vectors [n, 2], turned by angles with cosines and sines [n]."""
    return np.stack([c * v[:, 0] - s * v[:, 1], s * v[:, 0] + c * v[:, 1]], axis=1)


def _errors(x: Array, y: Array, turn: Array, motion: Array) -> Array:
    """Pose errors [n, k, angles, lengths] m after pushes.

    The T moves along an arc: its velocity and rate of turn are constant in its own frame.
    """
    a = motion[..., 2, None] * _LENGTHS  # [k, angles, lengths] rad
    small = np.abs(a) < 1e-6
    safe = np.where(small, 1.0, a)
    p = np.where(small, 1.0, np.sin(safe) / safe) * _LENGTHS
    q = np.where(small, 0.0, (1.0 - np.cos(safe)) / safe) * _LENGTHS
    dx = p * motion[..., 0, None] - q * motion[..., 1, None]
    dy = q * motion[..., 0, None] + p * motion[..., 1, None]
    shape = (len(x), 1, 1, 1)
    x, y, turn = x.reshape(shape), y.reshape(shape), turn.reshape(shape)
    return pose_distance(x - dx, y - dy, turn - a)
