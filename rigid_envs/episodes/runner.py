"""The runner: a task on a world of any count. Both kinds of environment are thin adapters to it."""

import math
from typing import Any, NamedTuple

import numpy as np
from gymnasium import spaces

from physics import Fidelity, Parameters, Snapshot, World
from physics.jit import columns
from physics.scene.validation import choice, instance, integer
from rigid_envs.episodes.arguments import make_task, words
from rigid_envs.episodes.bounds import clip
from rigid_envs.episodes.draws import uniform
from rigid_envs.episodes.randomization import Randomization
from rigid_envs.episodes.task_checks import check_goals, check_terms, check_written
from rigid_envs.tasks import Task
from rigid_envs.tasks.goals import distance
from rigid_envs.tasks.rewards import GOALS_OF_TERMS, REWARD_TYPES, goals_of_terms

Array = np.ndarray
Observation = dict[str, Array]

STATE_VERSION = 2
# so that a seed plus a world's index is an int64 too
LARGEST_SEED = 2**62


class Step(NamedTuple):
    """What a step of all worlds gives.

    Attributes:
        observation: dict of [count, ...] float32.
        reward: [count].
        terminated, truncated: [count] bool.
        info: dict of [count] arrays, or [count, n].
    """

    observation: Observation
    reward: Array
    terminated: Array
    truncated: Array
    info: dict[str, Array]


class Runner:
    """Episodes of a task in `count` worlds.

    Args:
        task: a task's name or class, or a task.
        count: number of worlds.
        reward_type: "sparse" or "dense".
        fidelity: of the physics.
        threads: to share the worlds out over; all cores if None.
        max_episode_steps: truncate after so many steps; never if None.
        terminate_on_success: end an episode when it is solved.
        randomize: ranges of parameters that are drawn for each episode, see `Randomization`.
        observe_parameters: what `randomize` names is observed too.
        guided: what the task's `guide` writes is observed too.
        **arguments: of the task, where it is given by its name or class.
    """

    def __init__(
        self,
        task: str | type[Task] | Task,
        count: int,
        reward_type: str = "sparse",
        fidelity: str | Fidelity = "balanced",
        threads: int | None = None,
        max_episode_steps: int | None = None,
        terminate_on_success: bool = False,
        randomize: Any = None,
        observe_parameters: bool = False,
        guided: bool = False,
        **arguments: Any,
    ) -> None:
        """Builds the world; episodes begin with `reset`."""
        self.task = make_task(task, arguments, words(Runner))
        self.reward_type = choice("reward_type", reward_type, REWARD_TYPES)
        scene = self.task.scene()
        self.randomization = Randomization(scene, count, randomize, self.task.sizes)
        ranges = self.randomization.check(randomize)
        varied = self.randomization.needs_varied(ranges)
        self.world = World(scene, fidelity, count, threads, varied=varied)
        if varied:
            self.randomization.check_step(self.world, ranges)
        self.count = count
        if max_episode_steps is not None:
            max_episode_steps = integer("max_episode_steps", max_episode_steps, low=1)
        self.max_episode_steps = max_episode_steps
        if not isinstance(terminate_on_success, bool | np.bool_):
            raise TypeError(f"terminate_on_success must be a bool, got {terminate_on_success!r}")
        self.terminate_on_success = bool(terminate_on_success)
        reward = self.task.reward
        self.reward = reward.ending() if self.terminate_on_success else reward

        self.observe_parameters: bool = instance("observe_parameters", observe_parameters, bool)
        if self.observe_parameters and not self.randomization.bounds:
            raise ValueError(
                "observe_parameters needs randomize, whose ranges bound what is observed"
            )
        seen = self.randomization.bounds if self.observe_parameters else ()
        self.guided: bool = instance("guided", guided, bool)
        # last, so that indices hold
        guides = self.task.guides if self.guided else ()
        self.bounds = (*self.task.bounds, *seen, *guides)
        low, high = _limits(self.bounds)
        goal_low, goal_high = _limits(self.task.goal_bounds)
        self._low, self._high = np.append(low, goal_low), np.append(high, goal_high)
        self.observation_space = spaces.Dict(
            {
                "observation": spaces.Box(low, high, dtype=np.float32),
                "achieved_goal": spaces.Box(goal_low, goal_high, dtype=np.float32),
                "desired_goal": spaces.Box(goal_low, goal_high, dtype=np.float32),
            }
        )
        size = (len(self.task.actions),)
        self.action_space = spaces.Box(-1.0, 1.0, size, dtype=np.float32)

        self._seeds = np.zeros(count, dtype=np.int64)
        self._episodes = np.full(count, -1, dtype=np.int64)
        self._seeded = self._observed = False
        self._elapsed = np.zeros(count, dtype=np.int64)
        self._now = self.world.read()
        self._apart = np.zeros(count)
        self._goals = np.zeros((count, len(goal_low)), dtype=np.float32, order="F")

    def reset(
        self, mask: Array, seeds: Array | None = None, options: dict[str, Any] | None = None
    ) -> None:
        """Starts an episode in the worlds of the mask [count]: their next, or a seed's first.

        Args:
            mask: [count] bool.
            seeds: [count] non-negative; a world without a seed so far needs one.
            options: "randomize": ranges for these worlds from now on, in place of the runner's; its
                own again if None.

        Raises:
            TypeError, ValueError: bad ranges, or such that the step is too long for; nothing has
                changed then.
        """
        if options and "randomize" in options:
            self._randomize(mask, options["randomize"])
        if seeds is not None:
            self._seeds[mask] = seeds[mask]
            self._episodes[mask] = -1
        self._episodes[mask] += 1
        self._seeded = bool(np.all(self._episodes >= 0))
        self._elapsed[mask] = 0
        self.randomization.draw(self.world, mask, self._seeds[mask], self._episodes[mask])
        draws = uniform(self._seeds[mask], self._episodes[mask], self.task.draws)
        goals = self.task.start(self.world, mask, draws)
        self._goals[mask] = check_goals(self.task, "start", goals, len(draws))
        self._now = self.world.read()

    def _randomize(self, mask: Array, randomize: Any) -> None:
        """Gives the worlds of a mask ranges of their own."""
        if randomize is None:
            self.randomization.set_ranges(mask, None)
            return
        ranges = self.randomization.check(randomize)
        if self.observe_parameters:
            self.randomization.check_observed(ranges)
        if self.randomization.needs_varied(ranges):
            self._vary()
            self.randomization.check_step(self.world, ranges)
        self.randomization.set_ranges(mask, ranges)

    def _vary(self) -> None:
        """Lets worlds differ that were built alike; they carry on as they are, to the last bit."""
        alike = self.world
        if not alike.features.varied:
            count = self.count
            self.world = World(alike.scene, alike.fidelity, count, alike.threads, varied=True)
            own = Parameters.of(alike.scene, count)
            self.world.restore(alike.snapshot()._replace(parameters=own))

    @property
    def seeded(self) -> bool:
        """Whether every world has been reset."""
        return self._seeded

    @property
    def goals(self) -> Array:
        """Desired goals [count, goal]."""
        return self._goals

    def observe(self) -> tuple[Observation, dict[str, Array]]:
        """Observation, and what is told beside it: info, [count] each.

        With a dense reward, info["goals_of_terms"] [count, 2 goal] has the goals that the terms
        hold for, so that `compute_reward` can tell others.
        """
        now, split, seen = self._now, len(self.bounds), len(self.task.bounds)
        told = split - len(self.task.guides) if self.guided else split
        table = columns((len(self._low),), self.count, np.float32)
        values = table.T[: self.count]
        if not self._observed:
            table[...] = np.nan
        self.task.observe(self.world, now, values[:, :seen])
        if not self._observed:
            check_written(self.task, "observe", self.task.bounds, values[:, :seen])
        if self.observe_parameters:
            values[:, seen:told] = self.randomization.observed
        achieved, desired = values[:, split:], self._goals
        reached = self.task.achieved(self.world, now)
        achieved[...] = check_goals(self.task, "achieved", reached, self.count)
        if self.guided:
            self.task.guide(self.world, now, achieved, desired, values[:, told:split])
            if not self._observed:
                check_written(self.task, "guide", self.task.guides, values[:, told:split])
        outside = clip(table, self._low, self._high, self.count)
        self._apart = distance(achieved, desired)
        # as users expect them, a row for each world
        observation = {
            "observation": values[:, :split].copy(),
            "achieved_goal": achieved.copy(),
            "desired_goal": desired.copy(),
        }
        success: Array = self.reward.success(self._apart)
        terms = self.task.terms(self.world, now, achieved, desired, self._apart)
        if not self._observed:
            check_terms(self.task, terms, self.count)
        self._observed = True
        info: dict[str, Array] = {
            "is_success": success,
            "success": success,
            "out_of_bounds": outside,
            **terms,
        }
        if self.reward_type == "dense" and self.reward.of_task:
            info[GOALS_OF_TERMS] = goals_of_terms(achieved, desired)
        return observation, info

    def check_actions(self, actions: Any) -> Array:
        """Actions [count, actions] within [-1, 1].

        Raises:
            ValueError: a wrong shape, or NaN; nothing has moved then.
        """
        shape = (self.count, len(self.task.actions))
        try:
            array = np.asarray(actions, dtype=np.float64, order="F")
        except (TypeError, ValueError):
            raise ValueError(f"action must be numbers of shape {shape}, got {actions!r}") from None
        if array.shape != shape:
            raise ValueError(f"action must have shape {shape}, got {array.shape}")
        clipped = np.minimum(np.maximum(array, -1.0), 1.0)  # NaN stays NaN
        if math.isnan(np.add.reduce(clipped, axis=None)):  # quicker than to look at every number
            world, component = (int(i) for i in np.argwhere(np.isnan(array))[0])
            raise ValueError(
                f"action must be numbers within [-1, 1], got NaN in world {world}, component "
                f"{component} ({self.task.actions[component]})"
            )
        return clipped

    def step(self, actions: Any, begun: Array | None = None) -> Step:
        """Advances every world by a frame, or starts an episode in it.

        Args:
            actions: [count, actions] within [-1, 1].
            begun: mask [count] of the worlds that start their next episode in place of a frame.

        Raises:
            ValueError: see `check_actions`.
            SimulationDiverged: a world turned non-finite; the others are whole.
        """
        commands = self.check_actions(actions)
        if self.randomization.noisy:
            commands = self.randomization.disturb(
                commands, self._seeds, self._episodes, self._elapsed
            )
        self.task.act(self.world, self._now, commands)
        if begun is None or not begun.any():
            begun = None
        # first, as the other worlds advance even if one of them diverges
        self._elapsed += 1
        try:
            self.world.advance(self.task.frame, None if begun is None else ~begun)
        finally:
            self._now = self.world.read()
        if begun is not None:
            self.reset(begun)
        observation, info = self.observe()
        if self.reward_type == "sparse":
            rewards = self.reward.sparse(info["is_success"])
        else:
            rewards = self.reward.dense(info["is_success"], self._apart, info)
        if self.terminate_on_success:
            terminated = info["is_success"].copy()
        else:
            terminated = np.zeros(self.count, dtype=bool)
        truncated = info["out_of_bounds"].copy()
        if self.max_episode_steps is not None:
            truncated = truncated | (self._elapsed >= self.max_episode_steps)
        if begun is not None:
            rewards[begun] = 0.0
            terminated, truncated = terminated & ~begun, truncated & ~begun
        return Step(observation, rewards, terminated, truncated, info)

    def get_state(self) -> dict[str, Any]:
        """Everything that the episodes hold; `set_state` continues from it to the last bit."""
        return {
            "version": STATE_VERSION,
            "world": self.world.snapshot(),
            "seeds": self._seeds.copy(),
            "episodes": self._episodes.copy(),
            "elapsed": self._elapsed.copy(),
            "goals": self._goals.copy(),
            **self.randomization.get_state(),
        }

    def set_state(self, state: Any) -> None:
        """Takes all episodes back to what `get_state` gave.

        Raises:
            ValueError: not such a state, another version, or another scene, fidelity or count.
        """
        wanted = {"version", "world", "seeds", "episodes", "elapsed", "goals", "ranges", "drawn"}
        if not isinstance(state, dict) or set(state) != wanted:
            raise ValueError(f"state must be a dict with the keys {sorted(wanted)}, got {state!r}")
        if state["version"] != STATE_VERSION:
            raise ValueError(
                f"state has version {state['version']!r}, this is version {STATE_VERSION}"
            )
        saved = state["world"]
        if isinstance(saved, Snapshot) and saved.parameters is not None:
            self._vary()
        elif isinstance(saved, Snapshot) and self.world.features.varied:
            saved = saved._replace(parameters=Parameters.of(saved.scene, len(saved.state.world)))
        self.world.restore(saved)
        self.randomization.set_state(state)
        self._now = self.world.read()
        self._seeds[:], self._episodes[:] = state["seeds"], state["episodes"]
        self._elapsed[:], self._goals[:] = state["elapsed"], state["goals"]
        self._seeded = bool(np.all(self._episodes >= 0))


def check_seed(field: str, value: Any) -> int:
    """`value` as a seed."""
    seed = integer(field, value, low=0)
    if seed > LARGEST_SEED:
        raise ValueError(f"{field} must be at most 2**62, got {value!r}")
    return seed


def _limits(bounds: tuple[tuple[str, str, float, float], ...]) -> tuple[Array, Array]:
    """Low and high [n] of a task's bounds."""
    low = np.array([b[2] for b in bounds], dtype=np.float32)
    return low, np.array([b[3] for b in bounds], dtype=np.float32)
