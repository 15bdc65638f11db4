"""Stages of a task, each of which pays once those before it are complete."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from physics.scene.validation import instance, number, positive
from rigid_envs.tasks.rewards import OF_GOALS
from rigid_envs.wrappers.rule import Goals, Rule, Terms

Array = np.ndarray


@dataclass(frozen=True)
class Stage:
    """A part of the way to the goal.

    Args:
        term: "distance" or "success" of the goals, or a raw term of the info.
        start: the term's value at which the stage begins to pay.
        done: the value at which it is complete, above or below `start`.
        weight: what a step costs until the stage begins, and no longer when it is complete.
    """

    term: str
    start: float
    done: float
    weight: float = 1.0

    def __post_init__(self) -> None:
        """Checks the fields."""
        instance("Stage.term", self.term, str)
        for field in ("start", "done"):
            object.__setattr__(self, field, number(f"Stage.{field}", getattr(self, field)))
        if self.start == self.done:
            raise ValueError(f"Stage.done must differ from Stage.start, got {self.done!r} for both")
        object.__setattr__(self, "weight", positive("Stage.weight", self.weight))

    def progress(self, value: Array) -> Array:
        """0 to 1, [...]."""
        return np.clip((value - self.start) / (self.done - self.start), 0.0, 1.0)


@dataclass(frozen=True)
class StagedReward(Rule):
    """Stages of which each pays once those before it are complete, in place of the reward.

    r' = sum_i weight_i (progress_i [all stages before i are complete] - 1), progress from 0 to 1.
    So a step costs what is still to be done, and nothing where all is: an episode that ends when
    solved loses nothing by it. A solved step counts as complete in all stages, whatever the tool
    does, lest it pay to hold on to an early one. One stage of "success" is the sparse reward.
    Info: `stages_done`, the number of complete stages plus the progress of the next;
    `unstaged_reward`.

    Args:
        stages: in their order; end with one of "success", or nearly solved pays as much.
    """

    stages: Sequence[Stage]

    judges = True
    advice = (
        "HER moves the goal, and with it what a term of the info would be: take stages of "
        f"{list(OF_GOALS)} alone, or leave StagedReward out"
    )

    def __post_init__(self) -> None:
        """Checks the fields."""
        instance("stages", self.stages, list, tuple)
        if not self.stages:
            raise ValueError("stages must be one Stage at least, got none")
        for i, stage in enumerate(self.stages):
            instance(f"stages[{i}]", stage, Stage)
        object.__setattr__(self, "stages", tuple(self.stages))

    @property
    def reads(self) -> tuple[str, ...]:
        """Terms of the info, each once."""
        return tuple(dict.fromkeys(s.term for s in self.stages if s.term not in OF_GOALS))

    @property
    def of_goal(self) -> bool:
        """A task's terms may depend on its goal."""
        return bool(self.reads)

    def pay(self, reward: Array, goals: Goals, terms: Terms) -> tuple[Array, Terms]:
        """See the class."""
        success = goals.success()
        known = {"success": success, "distance": -goals.distance(), **terms}
        paid, done = np.zeros_like(reward), np.zeros_like(reward)
        reached = np.ones_like(success)  # whether all stages so far are complete
        for stage in self.stages:
            progress = np.where(success, 1.0, stage.progress(known[stage.term]))
            progress = np.where(reached, progress, 0.0)
            paid, done = paid + stage.weight * (progress - 1.0), done + progress
            reached = progress >= 1.0
        return paid, {"stages_done": done, "unstaged_reward": reward}
