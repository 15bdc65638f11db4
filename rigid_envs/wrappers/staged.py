"""A reward in stages: each stage pays once all stages before it are complete."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from physics.scene.validation import instance, number, positive
from rigid_envs.tasks.rewards import GOAL_TERMS
from rigid_envs.wrappers.rule import Goals, Rule, Terms

Array = np.ndarray


@dataclass(frozen=True)
class Stage:
    """One stage on the way to the goal.

    Args:
        term: "distance", "success" or the name of a raw term in the info.
        start: value of the term at which the progress of the stage is 0.
        done: value of the term at which the progress is 1; above or below `start`.
        weight: what each step costs while the progress is 0.
    """

    term: str
    start: float
    done: float
    weight: float = 1.0

    def __post_init__(self) -> None:
        """Checks the arguments."""
        if instance("Stage.term", self.term, str) == "time":
            raise ValueError("Stage.term must not be 'time', which is 1 in every step")
        for field in ("start", "done"):
            object.__setattr__(self, field, number(f"Stage.{field}", getattr(self, field)))
        if self.start == self.done:
            raise ValueError(f"Stage.done must differ from Stage.start, got {self.done!r} for both")
        object.__setattr__(self, "weight", positive("Stage.weight", self.weight))

    def progress(self, value: Array) -> Array:
        """Progress [...] from 0 to 1."""
        return np.clip((value - self.start) / (self.done - self.start), 0.0, 1.0)


@dataclass(frozen=True)
class StagedReward(Rule):
    """Replaces the reward by stages, each of which pays once all before it are complete.

    r' = sum_i weight_i (progress_i [all stages before i are complete] - 1), with progress from 0 to
    1. The reward is 0 where all stages are complete and negative elsewhere, so terminating an
    episode on success loses nothing. In a solved step, all stages count as complete: otherwise,
    staying in an early stage might pay. A single stage of "success" is the sparse reward.
    Info: `stages_done`, the number of complete stages plus the progress of the next one; and
    `unstaged_reward`, r.

    Args:
        stages: the stages in order. End with a stage of "success": otherwise, almost solving the
            task pays as much as solving it.
    """

    stages: Sequence[Stage]

    needs_success = True
    her_advice = (
        "HER changes the goal, and with it the value that the term would have. Use only stages of "
        f"{[name for name in GOAL_TERMS if name != 'time']}, or remove StagedReward"
    )

    def __post_init__(self) -> None:
        """Checks the arguments."""
        instance("stages", self.stages, list, tuple)
        if not self.stages:
            raise ValueError("stages must contain at least one Stage, got none")
        for i, stage in enumerate(self.stages):
            instance(f"stages[{i}]", stage, Stage)
        object.__setattr__(self, "stages", tuple(self.stages))

    @property
    def info_terms(self) -> tuple[str, ...]:
        """The terms that do not follow from the goals, each once."""
        return tuple(dict.fromkeys(s.term for s in self.stages if s.term not in GOAL_TERMS))

    @property
    def depends_on_goal(self) -> bool:
        """A task's terms may depend on its goal."""
        return bool(self.info_terms)

    def apply(self, reward: Array, goals: Goals, terms: Terms) -> tuple[Array, Terms]:
        """See the class."""
        success = goals.success()
        known = {"success": success, "distance": -goals.distance(), **terms}
        total, done = np.zeros_like(reward), np.zeros_like(reward)
        complete = np.ones_like(success)  # whether all stages so far are complete
        for stage in self.stages:
            progress = np.where(success, 1.0, stage.progress(known[stage.term]))
            progress = np.where(complete, progress, 0.0)
            total, done = total + stage.weight * (progress - 1.0), done + progress
            complete = progress >= 1.0
        return total, {"stages_done": done, "unstaged_reward": reward}
