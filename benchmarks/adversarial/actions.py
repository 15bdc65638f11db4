"""Hostile actions: what a policy at its worst could command, and resets at bad moments."""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from rigid_envs import Runner

Array = np.ndarray

TURN = 0.15  # probability that a component changes sides in a step
# modes of `ramming`, and the largest number of steps for which a world keeps one
RAM, PRESS, CORNER, SQUEEZE, SHAKE, MODES = range(6)
LONGEST = 20
CLOSE = 0.02  # m, offset that commands a full action; a hand this close to a body closes
# probability of a reset in a step: of a world in which a drive touches a body, and of any other
RESET_IN_CONTACT, RESET = 0.2, 0.01


class Commands(NamedTuple):
    """What is done in a step.

    Attributes:
        actions: [count, actions] within [-1, 1].
        resets: [count] bool, worlds that are reset in the middle of their episode.
    """

    actions: Array
    resets: Array


Source = Callable[[], Commands]


def random_actions(runner: Runner, draw: np.random.Generator) -> Source:
    """Independent actions, uniform in [-1, 1]."""
    shape, never = (runner.count, len(runner.task.actions)), np.zeros(runner.count, dtype=bool)
    return lambda: Commands(draw.uniform(-1.0, 1.0, shape), never)


def bang_bang(runner: Runner, draw: np.random.Generator) -> Source:
    """Actions of -1 and 1; each component changes sides now and then."""
    actions = np.ones((runner.count, len(runner.task.actions)))
    never = np.zeros(runner.count, dtype=bool)

    def source() -> Commands:
        nonlocal actions
        actions = np.where(draw.random(actions.shape) < TURN, -actions, actions)
        return Commands(actions, never)

    return source


def ramming(runner: Runner, draw: np.random.Generator) -> Source:
    """Drives against bodies, the ground and the limits of their workspace and grip.

    Each world keeps one of five modes for a while: ram the nearest body from above, press on the
    ground, push into a corner of the workspace, squeeze the nearest body, shake at full action. A
    gripper opens and closes against its limits.
    """
    count, size = runner.count, len(runner.task.actions)
    bodies, left = len(runner.world.scene.bodies), np.zeros(count, dtype=int)
    mode, sign = np.zeros(count, dtype=int), np.ones((count, size))
    never = np.zeros(count, dtype=bool)

    def source() -> Commands:
        nonlocal sign
        new = left <= 0
        mode[new] = draw.integers(MODES, size=int(new.sum()))
        left[new] = draw.integers(1, LONGEST + 1, size=int(new.sum()))
        sign = np.where(new[:, None], draw.choice([-1.0, 1.0], size=(count, size)), sign)
        left[:] -= 1
        position = runner.world.read().position
        hand = position[:, bodies:].mean(axis=1)
        offsets = position[:, :bodies] - hand[:, None]
        nearest = np.argmin(np.sum(offsets**2, axis=2), axis=1)
        offset = offsets[np.arange(count), nearest]
        actions = np.clip(offset / CLOSE, -1.0, 1.0)
        near = np.abs(offset).max(axis=1) < CLOSE
        over = np.abs(offset[:, :2]).max(axis=1) < CLOSE
        actions[(mode == RAM) & over, 2] = -1.0
        # comes from above, and does not push the body away
        actions[(mode == SQUEEZE) & ~over, 2] = 1.0
        for which in (PRESS, CORNER, SHAKE):
            actions = np.where((mode == which)[:, None], sign[:, :3], actions)
        actions[mode == PRESS, 2] = -1.0
        if size > 3:
            grip = np.where(mode == SQUEEZE, np.where(near, -1.0, 1.0), sign[:, 3])
            actions = np.column_stack([actions, grip])
        sign = np.where((mode == SHAKE)[:, None], -sign, sign)
        return Commands(actions, never)

    return source


def resets_in_contact(runner: Runner, draw: np.random.Generator) -> Source:
    """As `ramming`, and resets in the middle of episodes, mostly of worlds in contact."""
    ram, world, count = ramming(runner, draw), runner.world, runner.count
    bodies, drives = len(world.scene.bodies), len(world.scene.driven_bodies)
    pairs = [(body, bodies + drive) for body in range(bodies) for drive in range(drives)]

    def source() -> Commands:
        touches = np.zeros(count, dtype=bool)
        for pair in pairs:
            touches |= world.normal_force(*pair) > 0.0
        chance = np.where(touches, RESET_IN_CONTACT, RESET)
        return Commands(ram().actions, draw.random(count) < chance)

    return source


ACTIONS: dict[str, Callable[[Runner, np.random.Generator], Source]] = {
    "random": random_actions,
    "bang-bang": bang_bang,
    "ramming": ramming,
    "resets": resets_in_contact,
}
