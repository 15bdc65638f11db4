"""Actions of the recordings: wandering hands, pushes and hits, from observations alone."""

from collections.abc import Callable

import numpy as np

Array = np.ndarray
Actor = Callable[[dict[str, Array], int], Array]
"""Takes observations of all worlds, and the number of the step; returns actions."""

AXIS_STEPS = 6  # of twelve: one axis at full action, then none


def along_axes(worlds: int, size: int) -> Actor:
    """World i moves along axis (i // 2) % 3, forward if i is even, for six steps, then rests."""
    actions = np.zeros((worlds, size))
    actions[np.arange(worlds), np.arange(worlds) // 2 % 3] = 1.0 - 2.0 * (np.arange(worlds) % 2)
    return lambda observations, step: actions if step < AXIS_STEPS else np.zeros_like(actions)


def wandering(worlds: int, size: int, low: Array, high: Array, seed: int) -> Actor:
    """Random actions that last one to five steps and turn back at the sides of a box.

    Args:
        worlds: how many.
        size: components of an action; those beyond three are 0.
        low: [3] m, lower corner of the box.
        high: [3] m, upper corner of the box.
        seed: of the actions.
    """
    rng = np.random.default_rng(seed)
    held, left = np.zeros((worlds, 3)), np.zeros(worlds)

    def act(observations: dict[str, Array], step: int) -> Array:
        hand = observations["observation"][:, :3]
        new = left <= 0
        left[new] = rng.integers(1, 6, new.sum())
        scale = rng.choice([0.1, 0.3, 1.0, 2.0], (new.sum(), 1))
        held[new] = np.clip(scale * rng.normal(size=(new.sum(), 3)), -1.0, 1.0)
        held[...] = np.where(hand < low, np.abs(held), np.where(hand > high, -np.abs(held), held))
        left[...] -= 1
        actions = np.zeros((worlds, size))
        actions[:, :3] = np.clip(held + 0.05 * rng.normal(size=held.shape), -1.0, 1.0)
        return actions

    return act


PRESSES = (0.0, -0.1, -0.2, -0.5, -1.0)
ALONG = (0.1, 0.2, 0.5, 1.0)
GRIPS = tuple(-0.1 * (i + 1) for i in range(10))


def pressing(worlds: int, size: int) -> Actor:
    """Lowers hands onto the table, then moves them along y while they press on it.

    World i presses with PRESSES[i % 5] and moves with ALONG[i // 5 % 4].
    """
    down = np.array(PRESSES)[np.arange(worlds) % len(PRESSES)]
    along = np.array(ALONG)[np.arange(worlds) // len(PRESSES) % len(ALONG)]

    def act(observations: dict[str, Array], step: int) -> Array:
        actions = np.zeros((worlds, size))
        actions[:, 2] = -0.5 if step < 12 else down
        actions[:, 1] = along if step >= 15 else 0.0
        return actions

    return act


def sliding(worlds: int, size: int) -> Actor:
    """Lowers hands onto the table, then moves them along x, slowly along y, as they press on it.

    World i presses with PRESSES[i % 5] and moves along y with 0.5 ALONG[i // 5 % 4].
    """
    down = np.array(PRESSES)[np.arange(worlds) % len(PRESSES)]
    along = 0.5 * np.array(ALONG)[np.arange(worlds) // len(PRESSES) % len(ALONG)]

    def act(observations: dict[str, Array], step: int) -> Array:
        actions = np.zeros((worlds, size))
        actions[:, 0] = -0.8 if step < 6 else 0.8 if step >= 12 else 0.0
        actions[:, 1] = along if step >= 12 else 0.0
        actions[:, 2] = 0.0 if step < 6 else -0.8 if step < 11 else down
        return actions

    return act


def gripping(worlds: int, size: int) -> Actor:
    """Lowers open hands, then closes them while they go down and press on the table.

    World i closes its fingers a step earlier if i is odd, and presses with GRIPS[i // 2 % 10].
    """
    down = np.array(GRIPS)[np.arange(worlds) // 2 % len(GRIPS)]
    early = np.arange(worlds) % 2

    def act(observations: dict[str, Array], step: int) -> Array:
        actions = np.zeros((worlds, size))
        actions[:, 2] = -0.7 if step < 3 else -0.1 if step < 5 else down
        actions[:, 3] = np.where(step + early < 7, 1.0, -1.0)
        return actions

    return act


def pushing(
    worlds: int, size: int, at: int, safe: float, low: float, gap: float, stop: float, seed: int
) -> Actor:
    """Lifts the hand, moves it behind the object, lowers it and pushes the object to the goal.

    Args:
        worlds: how many.
        size: components of an action.
        at: first component of the object's position in the observation.
        safe: m, height at which the hand passes over the object.
        low: m, height at which it pushes.
        gap: m, how far behind the object's centre the hand is lowered.
        stop: m, distance from the goal at which the push ends.
        seed: of heights, gains and noise.
    """
    rng = np.random.default_rng(seed)
    phase, height = np.zeros(worlds, dtype=int), low + 0.025 * rng.random(worlds)
    gain = 6.0 + 9.0 * rng.random((worlds, 1))

    def act(observations: dict[str, Array], step: int) -> Array:
        hand = observations["observation"][:, :3]
        body, goal = observations["observation"][:, at : at + 3], observations["desired_goal"]
        offset = (goal - body)[:, :2]
        length = np.linalg.norm(offset, axis=1, keepdims=True)
        ahead = offset / (length + 1e-9)
        behind = body[:, :2] - gap * ahead
        away = np.linalg.norm(behind - hand[:, :2], axis=1)
        actions = np.zeros((worlds, size))
        first, second, third = phase == 0, phase == 1, phase == 2
        over = first & (hand[:, 2] > safe - 0.025)
        actions[first, 2] = 10.0 * (safe - hand[first, 2])
        actions[over, :2] = 20.0 * (behind - hand[:, :2])[over]
        actions[second, :2] = 20.0 * (behind - hand[:, :2])[second]
        actions[second, 2] = 15.0 * (height - hand[:, 2])[second]
        touch = body[:, :2] + ahead * np.minimum(length, 0.05) - 0.04 * ahead
        push = third & (length[:, 0] > stop)
        actions[push, :2] = (gain * (touch - hand[:, :2]))[push]
        actions[third, 2] = 10.0 * (height - hand[:, 2])[third]
        phase[first & (away < 0.01)] = 1
        phase[second & (np.abs(height - hand[:, 2]) < 0.006)] = 2
        return np.clip(actions + 0.05 * rng.normal(size=actions.shape), -1.0, 1.0)

    return act


def hitting(worlds: int, size: int, at: int, seed: int) -> Actor:
    """Moves the hand around the object and then through it, in random directions, and rises.

    It hits after 1 to 5 cm of run-up, up to 1 cm off the centre, 0 to 15 mm above the height at
    which it rests on the table.

    Args:
        worlds: how many.
        size: components of an action.
        at: first component of the object's position in the observation.
        seed: of directions and speeds.
    """
    rng = np.random.default_rng(seed)
    angle = 0.9 * (2.0 * rng.random(worlds) - 1.0)
    ahead = np.stack([np.cos(angle), np.sin(angle)], axis=1)
    speed, phase = 0.3 + 0.7 * rng.random((worlds, 1)), np.zeros(worlds, dtype=int)
    aside = rng.uniform(-0.01, 0.01, (worlds, 1))
    from_center = aside * np.stack([-ahead[:, 1], ahead[:, 0]], axis=1)
    run_up, height = rng.uniform(0.06, 0.1, (worlds, 1)), rng.uniform(0.4195, 0.4345, worlds)

    def act(observations: dict[str, Array], step: int) -> Array:
        hand, body = observations["observation"][:, :3], observations["observation"][:, at : at + 3]
        body = body[:, :2] + from_center
        behind = body - run_up * ahead
        away = np.linalg.norm(behind - hand[:, :2], axis=1)
        actions = np.zeros((worlds, size))
        first, second = phase == 0, phase == 1
        # around the object, not through it
        side = np.sum((hand[:, :2] - body) * ahead, axis=1) > -0.05
        turned = np.stack([-ahead[:, 1], ahead[:, 0]], axis=1)
        lateral = np.sum((hand[:, :2] - body) * turned, axis=1)
        sign = np.where(lateral > 0.0, 1.0, -1.0)[:, None]
        way = np.where(
            (side & (np.abs(lateral) < 0.07))[:, None],
            10.0 * sign * turned,
            20.0 * (np.where(side[:, None], behind + 0.08 * sign * turned, behind) - hand[:, :2]),
        )  # fmt: skip
        actions[first, :2] = way[first]
        actions[second, :2] = (speed * ahead)[second]
        actions[:, 2] = 20.0 * (height - hand[:, 2])
        actions[phase > 6, 2] = 1.0
        phase[first & (away < 0.012)] = 1
        hit = np.linalg.norm(hand[:, :2] - body, axis=1) < 0.05
        phase[(phase == 1) & hit] = 2
        phase[phase >= 2] += 1
        actions[(phase >= 2) & (phase < 4), :2] = (speed * ahead)[(phase >= 2) & (phase < 4)]
        return np.clip(actions, -1.0, 1.0)

    return act
