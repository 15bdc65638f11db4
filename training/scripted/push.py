"""A controller for Push with all of its options."""

import numpy as np

from physics import Compound
from physics.rotation import yaw as yaw_of
from rigid_envs.tasks.block import HALF, Block
from rigid_envs.tasks.finger import Finger
from rigid_envs.tasks.push import POST_RADIUS, POSTS, Push
from training.scripted.outline import outline, push_by_outline

Array = np.ndarray

# m, height of the finger above the ground at which it moves over the cube without contact
_TRAVEL = 2.0 * HALF + Finger.RADIUS + 0.02
# m, distance of the finger from the cube's centre at which a push starts; m, tolerance sideways
_BEHIND, _ASIDE = 1.5 * HALF + Finger.RADIUS + 0.005, 0.012
# m, distance from the goal at which the finger stops pushing
_DONE = 0.02
# m, least distance between the centres of cube and post; m, look-ahead for posts
_ROOM, _AHEAD = 0.048, 0.1
# m, distance from the goal at which the cube is turned to its yaw; rad, tolerance of the yaw
_NEAR, _TURNED = 0.035, 0.12
# m, tolerance of the position for a cube at its yaw
_REACHED = 0.043
# m, largest offset of the finger from the middle of a face, to turn the cube; m, offset per rad
_LEVER, _GAIN = 0.011, 0.03


def push(
    observation: dict[str, Array], obstacles: int = 0, block: str | Compound = "cube"
) -> Array:
    """Moves over the cube to the side opposite the goal, down, and pushes towards the goal.

    A finger that has slipped off the line rises and comes down behind the cube again. A goal with
    a yaw is recognised by its size.

    Args:
        observation: Of Push with any options.
        obstacles: Number of posts, which is not observed.
        block: The pushed block, which is not observed either.

    Returns:
        [n, 3] actions within ±1.
    """
    pushed = Block.of(block)
    size = pushed.radius / (np.sqrt(2.0) * HALF)
    values = observation["observation"].astype(float)
    finger, cube = values[:, 0:3], values[:, 6:9]
    achieved, desired = (observation[f"{k}_goal"].astype(float) for k in ("achieved", "desired"))
    to_goal = (desired - achieved)[:, :2]
    distance = np.sqrt(np.sum(to_goal**2, axis=1, keepdims=True))
    direction = to_goal / np.maximum(distance, 1e-9)
    if obstacles:
        direction = _avoid_posts(cube[:, :2], direction, distance, POSTS[:obstacles], size)
    if not pushed.cube:
        yaw = yaw_of(values[:, 9:13])
        target = push_by_outline(finger, cube, yaw, direction, distance[:, 0], outline(pushed))
    elif desired.shape[1] > 3:
        yaw, goal_yaw = (0.25 * np.arctan2(goal[:, 4], goal[:, 3]) for goal in (achieved, desired))
        target = _push_by_faces(
            finger, cube, yaw, goal_yaw, direction, distance[:, 0], POSTS[:obstacles]
        )
    else:
        target = _push_straight(finger, cube, direction, distance)
    return np.clip((target - finger) / Push.finger.stride, -1.0, 1.0)


def _push_straight(finger: Array, cube: Array, direction: Array, distance: Array) -> Array:
    """Next position of the finger [n, 3] m to push the cube along a direction."""
    from_cube = finger[:, :2] - cube[:, :2]
    along = np.sum(from_cube * direction, axis=1)
    aside = from_cube - along[:, None] * direction
    off = np.sqrt(np.sum(aside**2, axis=1))

    low = finger[:, 2] < HALF + 0.02
    behind = (along < -0.8 * (HALF + Finger.RADIUS)) & (off < 2.0 * _ASIDE)
    place = cube[:, :2] - _BEHIND * direction
    over = np.sqrt(np.sum((finger[:, :2] - place) ** 2, axis=1)) < _ASIDE

    target = np.empty_like(finger)
    target[:, :2], target[:, 2] = place, _TRAVEL
    rising = ~behind & (finger[:, 2] < _TRAVEL - 0.01)
    target[rising, :2] = finger[rising, :2]
    descending = over & ~low
    target[descending, 2] = HALF
    pushing = behind & low
    # slower near the goal, and back onto the line through the cube's centre
    stride = np.clip(0.6 * distance[:, 0], 0.004, 0.025)[:, None]
    steered = finger[:, :2] + stride * direction - 0.8 * aside
    target[pushing, :2], target[pushing, 2] = steered[pushing], HALF
    solved = distance[:, 0] < _DONE
    target[solved] = finger[solved]
    return target


def _avoid_posts(
    cube: Array, direction: Array, distance: Array, posts: Array, size: float
) -> Array:
    """The free direction [n, 2] nearest to `direction`: no post is in the way.

    `size`: width of the block relative to the cube.
    """
    room, beyond = (
        POST_RADIUS + size * (_ROOM - POST_RADIUS),
        size * (_BEHIND - Finger.RADIUS) + Finger.RADIUS,
    )
    turns = np.pi / 24.0 * np.arange(-24, 24)
    turned = np.stack([np.cos(turns), np.sin(turns)], axis=1)  # [turns, 2]
    across = np.stack([-direction[:, 1], direction[:, 0]], axis=1)
    ways = turned[:, :1] * direction[:, None] + turned[:, 1:] * across[:, None]  # [n, turns, 2]
    free = np.ones(ways.shape[:2], dtype=bool)
    for post in posts:
        to_post = post - cube
        now = np.sqrt(np.sum(to_post**2, axis=1, keepdims=True))
        along = np.sum(ways * to_post[:, None], axis=2)
        nearest = np.clip(along, 0.0, np.minimum(distance, _AHEAD))[..., None] * ways
        passing = np.sqrt(np.sum((to_post[:, None] - nearest) ** 2, axis=2))
        free &= passing >= np.minimum(room, now - 1e-9)
        free &= _finger_fits(cube[:, None] - beyond * ways, post)
    best = np.argmin(np.where(free, 0.0, 10.0) + np.abs(turns), axis=1)
    return ways[np.arange(len(ways)), best]


def _finger_fits(places: Array, post: Array) -> Array:
    """Whether a finger at positions [..., 2] m does not touch a post."""
    return np.sqrt(np.sum((places - post) ** 2, axis=-1)) > POST_RADIUS + Finger.RADIUS + 0.002


def _push_by_faces(
    finger: Array,
    cube: Array,
    yaw: Array,
    goal_yaw: Array,
    direction: Array,
    distance: Array,
    posts: Array,
) -> Array:
    """Next position of the finger [n, 3] m to bring the cube to a goal and a yaw.

    The finger pushes perpendicular to a face. It turns the cube by an offset from the face's
    middle: first towards the direction to the goal, and near the goal to the desired yaw.
    """
    worlds = np.arange(len(cube))
    error = np.mod(goal_yaw - yaw + np.pi / 4.0, np.pi / 2.0) - np.pi / 4.0
    normals = yaw[:, None] + np.pi / 2.0 * np.arange(4)
    normals = np.stack([np.cos(normals), np.sin(normals)], axis=2)  # [n, 4, 2]
    tangents = np.stack([-normals[..., 1], normals[..., 0]], axis=2)
    from_cube = (finger - cube)[:, None, :2]
    x, y = np.sum(from_cube * normals, axis=2), np.sum(from_cube * tangents, axis=2)
    low = finger[:, 2] < HALF + 0.02
    behind = (x < -0.8 * (HALF + Finger.RADIUS)) & (np.abs(y) < HALF + 0.004) & low[:, None]
    score = np.sum(normals * direction[:, None], axis=2) + 0.25 * behind
    for post in posts:
        score -= 2.0 * ~_finger_fits(cube[:, None, :2] - _BEHIND * normals, post)
    face = np.argmax(score, axis=1)
    normal, tangent, behind = normals[worlds, face], tangents[worlds, face], behind[worlds, face]
    x, y = x[worlds, face], y[worlds, face]

    near = distance < _NEAR
    bearing = np.arctan2(np.sum(direction * tangent, axis=1), np.sum(direction * normal, axis=1))
    lever = -np.clip(_GAIN * np.where(near, error, bearing), -_LEVER, _LEVER)
    place = cube[:, :2] - _BEHIND * normal + lever[:, None] * tangent
    over = np.sqrt(np.sum((finger[:, :2] - place) ** 2, axis=1)) < _ASIDE

    target = np.empty_like(finger)
    target[:, :2], target[:, 2] = place, _TRAVEL
    rising = ~behind & (finger[:, 2] < _TRAVEL - 0.01)
    target[rising, :2] = finger[rising, :2]
    descending = over & ~behind
    target[descending, 2] = HALF
    stride = np.where(near, 0.012, np.clip(0.6 * distance, 0.004, 0.025))
    stride *= np.clip(1.2 - np.abs(y - lever) / 0.015, 0.0, 1.0)
    steered = finger[:, :2] + stride[:, None] * normal + (lever - y)[:, None] * tangent
    target[behind, :2], target[behind, 2] = steered[behind], HALF
    solved = (distance < _REACHED) & (np.abs(error) < _TURNED)
    target[solved] = finger[solved]
    return target
