"""The base class of twins in which the hand grasps."""

from typing import Any, ClassVar

import numpy as np

from physics import Readout, World
from physics.scene.validation import number
from rigid_envs.tasks.grasping.grasps import grasp_terms, start_near_grasps
from rigid_envs.twins.twin import Twin

Array = np.ndarray


class GraspingTwin(Twin):
    """A twin in which the hand grasps.

    Args:
        shaped: see `Twin`.
        near_grasp_start_prob: probability that an episode begins with the open hand around or just
            above the object; for training.

    Attributes:
        hand: the hand, with the methods `position`, `opening`, `pads` and `place`.
        half: m, half the width of the object.
        closed: part of the starts around the object in which the fingers already touch it.
    """

    hand: ClassVar[Any]
    half: ClassVar[float]
    closed: ClassVar[float] = 0.0

    def __init__(self, shaped: bool = False, near_grasp_start_prob: float = 0.0) -> None:
        """Checks the probability."""
        super().__init__(shaped)
        self.near_grasp_start_prob = number(
            "near_grasp_start_prob", near_grasp_start_prob, low=0.0, high=1.0
        )

    def start_near_grasps(
        self,
        world: World,
        mask: Array,
        draws: Array,
        body: Array | int = 0,
        possible: Array | bool = True,
    ) -> None:
        """Moves the hand around a body in some worlds, see the function of this name.

        Args:
            world: the worlds.
            mask: [count] bool, those that have been reset; n of them.
            draws: [n, NEAR_GRASP_DRAWS] uniform in [0, 1).
            body: [n] its index.
            possible: [n] whether there is room for the fingers.
        """
        probability = np.where(possible, self.near_grasp_start_prob, 0.0)
        chosen, position = start_near_grasps(
            world, mask, draws, probability, self.hand.pads, self.half, body, self.closed
        )
        if len(position):
            self.hand.place(world, chosen, position)

    def grasp_terms(self, now: Readout, position: Array) -> dict[str, Array]:
        """Terms of the object at `position` [count, 3] m, see the function of this name."""
        return grasp_terms(self.hand.position(now), self.hand.opening(now), position, self.half)
