"""Terms of shaped rewards lead the hand where they say."""

import numpy as np
import pytest

from physics import World
from rigid_envs.twins.fetch.hand import RESTING
from rigid_envs.twins.fetch.push import FetchPush
from rigid_envs.twins.fetch.slide import ABOVE, FetchSlide
from rigid_envs.twins.fetch.task import BEHIND as FETCH_BEHIND
from rigid_envs.twins.panda.push import PandaPush
from rigid_envs.twins.panda.slide import PandaSlide
from rigid_envs.twins.panda.task import BEHIND as PANDA_BEHIND

FROM_GOAL = np.array([0.3, 0.05, 0.01, 1e-3])  # m


@pytest.mark.parametrize(
    ("twin", "gap", "height"),
    [
        (FetchPush, FETCH_BEHIND, None),
        (FetchSlide, FETCH_BEHIND, RESTING + ABOVE),
        (PandaPush, PANDA_BEHIND, None),
        (PandaSlide, PANDA_BEHIND, None),
    ],
)
def test_a_hand_behind_the_object_has_nothing_to_reach(twin, gap, height):
    """However near the goal, and whatever the goal's height: FetchSlide asked for up to 0.6 m."""
    task = twin(shaped=True)
    world = World(task.scene(), count=len(FROM_GOAL))
    achieved = task.achieved(world, world.read()).astype(float)
    desired = achieved + np.array([1.0, 0.0, 0.0]) * FROM_GOAL[:, None]
    desired[:, 2] += 0.01
    hand = achieved - np.array([gap, 0.0, 0.0])
    if height is not None:
        hand[:, 2] = height
    now = world.read()
    drive = now.position[:, -1:] + (hand - task.hand.position(now))[:, None]
    world.set_state(drive_position=drive)
    now = world.read()
    np.testing.assert_allclose(task.hand.position(now), hand, atol=1e-6)
    distance = np.sqrt(np.sum((achieved - desired) ** 2, axis=1))
    reach = task.guidance(world, now, achieved, desired, distance)["reach"]
    np.testing.assert_allclose(reach, 0.0, atol=1e-5)
