"""The runner: episodes of a task in any number of worlds. Both environments are built on it."""

from collections.abc import Mapping
from contextlib import suppress
from typing import Any, NamedTuple

import numpy as np
from gymnasium import spaces

from physics import Fidelity, Parameters, Scene, SimulationDiverged, Snapshot, World
from physics.scene.fidelity import resolve
from physics.scene.validation import choice
from physics.step.kernel_choice import general_is_compiled, requested
from rigid_envs.catalog import NAMED_TASKS
from rigid_envs.episodes.arguments import argument_names, make_task
from rigid_envs.episodes.checks import KEEP_SEED, step_limit
from rigid_envs.episodes.columns import clip_actions
from rigid_envs.episodes.draws import uniform
from rigid_envs.episodes.observations import Observation, Observations
from rigid_envs.episodes.pixels import Pixels, PixelSettings
from rigid_envs.episodes.randomization import Randomization
from rigid_envs.episodes.task_checks import check_goals, check_terms
from rigid_envs.tasks import Task
from rigid_envs.tasks.rewards import REWARD_TYPES, STEP_GOALS, Reward, describe_info

Array = np.ndarray

STATE_VERSION = 2


class Step(NamedTuple):
    """The result of one step of all worlds.

    Attributes:
        observation: dict of arrays [count, ...], float32 or pixels.
        reward: [count].
        terminated: [count] bool.
        truncated: [count] bool.
        info: dict of arrays [count] or [count, n].
    """

    observation: Observation
    reward: Array
    terminated: Array
    truncated: Array
    info: dict[str, Array]


class Runner:
    """Episodes of a task in `count` worlds.

    Args:
        task: name, class or object of a task.
        count: number of worlds.
        reward_type: "sparse" or "dense".
        fidelity: name of a preset, or a physics.Fidelity.
        threads: number of threads among which the worlds are divided; all cores if None.
        max_episode_steps: number of steps after which an episode is truncated; the task's number if
            None, no limit if -1.
        terminate_on_success: whether success terminates an episode.
        randomize: ranges of parameters that are drawn for each episode, see `Randomization`.
        observe_parameters: append the drawn parameters to the observation.
        observe_task_guide: append the task's guide to the observation, see `Task.guide`.
        pixels: what pixels are observed; None if only the state is.
        kernel: see `rigid_envs.RigidEnv`.
        flat: whether state and goals are observed as one array.
        **arguments: arguments of the task, if it is given by name or class.

    Attributes:
        measures_work: whether the worlds sum up the work of servos; a subclass can set it.
    """

    measures_work = False

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
        observe_task_guide: bool = False,
        pixels: PixelSettings | None = None,
        kernel: str | None = None,
        flat: bool = False,
        **arguments: Any,
    ) -> None:
        """Builds the worlds. Call `reset` to start episodes."""
        self.task = make_task(task, arguments, argument_names(Runner))
        self.reward_type = choice("reward_type", reward_type, REWARD_TYPES)
        scene = self.task.scene()
        self.randomization = Randomization(scene, count, randomize, self.task.size_range)
        ranges = self.randomization.check(randomize)
        self._ranges = ranges
        per_world = self.randomization.needs_per_world_parameters(ranges)
        self._kernel = requested(kernel)
        self.world = self._worlds(scene, fidelity, count, threads, per_world)
        if per_world:
            self.randomization.check_step(self.world, ranges)
        self.count = count
        self.max_episode_steps = step_limit(self.task, max_episode_steps)
        if not isinstance(terminate_on_success, bool | np.bool_):
            raise TypeError(f"terminate_on_success must be a bool, got {terminate_on_success!r}")
        self.terminate_on_success = bool(terminate_on_success)
        self._rewards: tuple[Reward | None, Reward] = None, self.task.reward  # see `reward`
        self._has_task_terms = bool(self.reward.task_terms)

        self._pixels = Pixels(pixels, self.task, self.world) if pixels is not None else None
        self._observations = Observations(
            self.task, self.randomization, observe_parameters, observe_task_guide, self._pixels,
            pixels is not None and pixels.keeps_state, flat,
        )  # fmt: skip
        self.bounds, self.observation_space = self._observations.bounds, self._observations.space
        size = (len(self.task.actions),)
        self.action_space = spaces.Box(-1.0, 1.0, size, dtype=np.float32)

        self._seeds = np.zeros(count, dtype=np.int64)
        self._episodes = np.full(count, -1, dtype=np.int64)
        self._seeded = self._terms_checked = False
        self._elapsed = np.zeros(count, dtype=np.int64)
        self._now = self.world.read()
        self._goal_distance = np.zeros(count)
        self._goals = np.zeros(
            (count, len(self.task.goal_bounds)), dtype=self.task.dtype, order="F"
        )

    def _worlds(
        self,
        scene: Scene,
        fidelity: str | Fidelity,
        count: int,
        threads: int | None,
        per_world_parameters: bool,
    ) -> World:
        """The worlds of the episodes."""
        kernel, registered = self._kernel, type(self.task) in NAMED_TASKS.values()
        if kernel == "auto" and registered and not general_is_compiled(
            scene, resolve(fidelity), per_world_parameters
        ):  # fmt: skip
            kernel = "special"  # compiles in less time, if it isn't compiled yet
        return World(
            scene, fidelity, count, threads, per_world_parameters=per_world_parameters,
            measure_work=self.measures_work, kernel=kernel,
        )  # fmt: skip

    def reset(
        self, mask: Array, seeds: Array | None = None, options: dict[str, Any] | None = None
    ) -> None:
        """Starts an episode in the worlds of the mask: their next one, or the first one of a seed.

        Args:
            mask: [count] bool.
            seeds: [count] integers, KEEP_SEED where a world starts its next episode; None if all
                do. A world without a seed needs one.
            options: {"randomize": ranges} for these worlds from this episode on; None restores the
                ranges of the constructor.

        Raises:
            TypeError, ValueError: invalid ranges, or ranges in which the time step would not be
                stable. No state has changed then.
        """
        if options and "randomize" in options:
            self._randomize(mask, options["randomize"])
        if seeds is not None:
            given = mask & (seeds != KEEP_SEED)
            self._seeds[given] = seeds[given]
            self._episodes[given] = -1
        self._episodes[mask] += 1
        self._seeded = bool(np.all(self._episodes >= 0))
        self._elapsed[mask] = 0
        self.randomization.draw(self.world, mask, self._seeds[mask], self._episodes[mask])
        draws = uniform(self._seeds[mask], self._episodes[mask], self.task.draw_count)
        goals = self.task.start(self.world, mask, draws)
        self._goals[mask] = check_goals(self.task, "start", goals, len(draws))
        if self._pixels:
            self._pixels.started(mask)
        self._now = self.world.read()

    def _randomize(self, mask: Array, randomize: Any) -> None:
        """Gives the worlds of the mask their own ranges."""
        if randomize is None:
            self.randomization.set_ranges(mask, None)
            return
        ranges = self.randomization.check(randomize)
        if self._observations.parameters:
            self.randomization.check_observed(ranges)
        if self.randomization.needs_per_world_parameters(ranges):
            self.use_per_world_parameters()
            self.randomization.check_step(self.world, ranges)
        self.randomization.set_ranges(mask, ranges)

    def use_per_world_parameters(self) -> None:
        """Replaces identical worlds by worlds with per-world parameters, in the same state.

        Running episodes continue bitwise identically.
        """
        old = self.world
        if not old.features.per_world_parameters:
            self.world = self._worlds(old.scene, old.fidelity, self.count, old.threads, True)
            parameters = Parameters.of(old.scene, self.count)
            self.world.restore(old.snapshot()._replace(parameters=parameters))

    def change_ranges(self, randomize: Mapping[str, Any]) -> None:
        """Replaces some of the constructor's ranges in all worlds, at once and from then on.

        The running episodes continue with values drawn from the new ranges. Positions and
        velocities stay; the contacts of worlds with per-world parameters start again.

        Args:
            randomize: ranges or numbers by name, see `Randomization`.

        Raises:
            TypeError, ValueError: invalid ranges, or ranges in which the time step would not be
                stable. No state has changed then.
        """
        everyone = np.ones(self.count, dtype=bool)
        self._randomize(everyone, {**self._ranges, **randomize})
        self.randomization.draw(self.world, everyone, self._seeds, self._episodes)
        self._now = self.world.read()
        if self._pixels:
            self._pixels.changed()

    def change_fidelity(self, fidelity: str | Fidelity) -> None:
        """Replaces the worlds by worlds of another fidelity, with the episodes that are running.

        Positions, velocities, parameters, times and memory stay. Contacts start again, so the first
        touch of two solids that touch is now.

        Args:
            fidelity: name of a preset, or a physics.Fidelity.

        Raises:
            TypeError, ValueError: no such preset, or a fidelity with which the scene can't be
                simulated. No state has changed then.
        """
        old, per_world = self.world, self.world.features.per_world_parameters
        new = self._worlds(old.scene, fidelity, self.count, old.threads, per_world)
        if per_world:
            self.randomization.check_step(new, self._ranges)
            new.set_parameters(**old.parameters._asdict())
        new.set_state(
            position=old.position,
            orientation=old.orientation,
            linear_velocity=old.linear_velocity,
            angular_velocity=old.angular_velocity,
            drive_position=old.drive_position,
            drive_velocity=old.drive_velocity,
            time=old.time,
        )
        for name, numbers in old.snapshot().memory.items():
            new.memory(name, numbers.shape[1])[:] = numbers
        self.world, self._now = new, new.read()

    def prepare_fidelity(self, fidelity: str | Fidelity) -> None:
        """Compiles what the worlds of another fidelity need; nothing else changes.

        It may be called in another thread than the episodes run in.

        Raises:
            TypeError, ValueError: no such preset, or a fidelity with which the scene can't be
                simulated.
        """
        old = self.world
        new = self._worlds(
            old.scene, fidelity, self.count, old.threads, old.features.per_world_parameters
        )
        with suppress(SimulationDiverged):  # of the scene as it begins, which doesn't matter
            new.advance(self.task.frame)
        new.read()
        new.penetration()
        new.largest_stable_step()
        new.contacts(0)

    @property
    def seeds(self) -> Array:
        """[count] seed of each world; -1 of one that has had none yet."""
        return np.where(self._episodes < 0, -1, self._seeds)

    @property
    def seeded(self) -> bool:
        """Whether every world has been reset."""
        return self._seeded

    @property
    def unseeded(self) -> Array:
        """[count] bool, the worlds that have never been reset."""
        return self._episodes < 0

    @property
    def goals(self) -> Array:
        """Desired goals [count, goal]."""
        return self._goals

    @property
    def reward(self) -> Reward:
        """That of the task, which can be replaced, as these episodes use it."""
        given = self.task.reward
        if self._rewards[0] is not given:
            ends = self.terminate_on_success
            self._rewards = given, given.with_time_penalty() if ends else given
        return self._rewards[1]

    def observe(self) -> tuple[Observation, dict[str, Array]]:
        """Observation, and info with entries [count].

        With a dense reward, info["step_goals"] [count, 2 goal] holds the achieved and the desired
        goals for which the reward terms were computed. `compute_reward` compares them with the
        goals that it gets.
        """
        joins = self.reward_type == "dense" and self._has_task_terms
        observation, rows, achieved = self._observations.observe(
            self.world, self._now, self._goals, joins, self.reward.measure
        )
        self._goal_distance = rows.goal_distance
        success: Array = self.reward.success(self._goal_distance)
        terms = self.task.terms(self.world, self._now, achieved, self._goals, self._goal_distance)
        if not self._terms_checked:
            check_terms(self.task, terms, self.count)
        self._terms_checked = True
        info: dict[str, Array] = {
            "is_success": success,
            "success": success,
            "out_of_bounds": rows.outside,
            **terms,
        }
        if joins:
            info[STEP_GOALS] = rows.goals
        return observation, info

    def check_actions(self, actions: Any) -> Array:
        """Actions [count, actions], clipped to [-1, 1].

        Raises:
            ValueError: the actions have another shape or contain NaN.
        """
        shape = (self.count, len(self.task.actions))
        try:
            array = np.asarray(actions, dtype=np.float64, order="C")
        except (TypeError, ValueError):
            raise ValueError(f"action must be numbers of shape {shape}, got {actions!r}") from None
        if array.shape != shape:
            raise ValueError(f"action must have shape {shape}, got {array.shape}")
        clipped, missing = clip_actions(array)
        if missing >= 0:
            world, component = divmod(missing, shape[1])
            raise ValueError(
                f"action must be numbers within [-1, 1], got NaN in world {world}, component "
                f"{component} ({self.task.actions[component]})"
            )
        return clipped

    def step(self, actions: Any, reset_mask: Array | None = None) -> Step:
        """Advances every world by one step, or starts the next episode in it.

        Args:
            actions: [count, actions] within [-1, 1].
            reset_mask: [count] bool, the worlds that start their next episode instead of advancing.
                Their reward is 0.

        Raises:
            ValueError: invalid actions, see `check_actions`. No state has changed then.
            SimulationDiverged: a world has diverged. The other worlds are unaffected.
        """
        commands = self.check_actions(actions)
        if self.randomization.has_noise:
            commands = self.randomization.add_noise(
                commands, self._seeds, self._episodes, self._elapsed
            )
        if reset_mask is None or not reset_mask.any():
            reset_mask = None
        # before advancing: if one world diverges, the others have advanced all the same
        self._elapsed += 1
        try:
            going = None if reset_mask is None else ~reset_mask
            self.task.advance(self.world, self._now, commands, going)
        finally:
            self._now = self.world.read()
            if self._pixels:
                self._pixels.stepped()
        if reset_mask is not None:
            self.reset(reset_mask)
        observation, info = self.observe()
        if self.reward_type == "sparse":
            rewards = self.reward.sparse(info["is_success"])
        else:
            rewards = self.reward.dense(info["is_success"], self._goal_distance, info)
        if self.terminate_on_success:
            terminated = info["is_success"].copy()
        else:
            terminated = np.zeros(self.count, dtype=bool)
        outside = info["out_of_bounds"]
        if self.max_episode_steps is None:
            truncated = outside.copy()
        else:
            truncated = outside | (self._elapsed >= self.max_episode_steps)
        if reset_mask is not None:
            rewards[reset_mask] = 0.0
            terminated, truncated = terminated & ~reset_mask, truncated & ~reset_mask
        return Step(observation, rewards, terminated, truncated, info)

    def compute_reward(self, achieved: Array, desired: Array, info: Any) -> Any:
        """The reward [...] of goals [..., goal]; see `Reward.compute`."""
        self._check_goals(achieved_goal=achieved, desired_goal=desired)
        return self.reward.compute(self.reward_type, achieved, desired, info)

    def compute_terminated(self, achieved: Array, desired: Array) -> Any:
        """Whether [...] a step with these goals [..., goal] terminates the episode."""
        self._check_goals(achieved_goal=achieved, desired_goal=desired)
        success = self.reward.success(self.reward.distance(achieved, desired))
        terminated = np.logical_and(success, self.terminate_on_success)
        return terminated if terminated.ndim else bool(terminated)

    def _check_goals(self, **goals: Array) -> None:
        """Raises ValueError for goals of another size than the task's."""
        size = len(self.task.goal_bounds)
        for name, goal in goals.items():
            if (shape := np.shape(goal))[-1:] != (size,):
                raise ValueError(f"{name} must have shape [..., {size}], got {shape}")

    def compute_truncated(self, achieved: Array, info: Any) -> Any:
        """Whether [...] a step was truncated because it left the bounds of the observation.

        Only the info of the step shows this; without its entry "out_of_bounds" the result is False.
        """
        if info is None or isinstance(info, Mapping):
            outside = np.asarray((info or {}).get("out_of_bounds", False), dtype=bool)
        else:
            outside = np.array([one.get("out_of_bounds", False) for one in info], dtype=bool)
        shape = np.shape(achieved)[:-1]
        rows = outside.reshape(outside.shape + (1,) * (len(shape) - outside.ndim))
        return np.broadcast_to(rows, shape).copy() if shape else bool(outside)

    def get_state(self) -> dict[str, Any]:
        """The complete state of the episodes.

        After `set_state` with it, episodes continue bitwise identically.
        """
        pixels = {"pixels": self._pixels.get_state()} if self._pixels else {}
        return {
            "version": STATE_VERSION,
            "world": self.world.snapshot(),
            "seeds": self._seeds.copy(),
            "episodes": self._episodes.copy(),
            "elapsed": self._elapsed.copy(),
            "goals": self._goals.copy(),
            **self.randomization.get_state(),
            **pixels,
        }

    def set_state(self, state: Any) -> None:
        """Restores all episodes from `get_state`.

        Raises:
            ValueError: not such a state; or one with another version, scene, fidelity or count.
        """
        wanted = {"version", "world", "seeds", "episodes", "elapsed", "goals", "ranges", "drawn"}
        if self._pixels:
            wanted.add("pixels")
        if not isinstance(state, dict) or set(state) != wanted:
            raise ValueError(
                f"state must be a dict with the keys {sorted(wanted)}, got {describe_info(state)}"
            )
        if state["version"] != STATE_VERSION:
            raise ValueError(f"state must have version {STATE_VERSION}, got {state['version']!r}")
        if self._pixels:
            self._pixels.check_state(state["pixels"])
        saved = state["world"]
        if isinstance(saved, Snapshot) and saved.parameters is not None:
            self.use_per_world_parameters()
        elif isinstance(saved, Snapshot) and self.world.features.per_world_parameters:
            saved = saved._replace(parameters=Parameters.of(saved.scene, len(saved.state.world)))
        self.world.restore(saved)
        self.randomization.set_state(state)
        self._now = self.world.read()
        self._seeds[:], self._episodes[:] = state["seeds"], state["episodes"]
        self._elapsed[:], self._goals[:] = state["elapsed"], state["goals"]
        self._seeded = bool(np.all(self._episodes >= 0))
        if self._pixels:
            self._pixels.set_state(state["pixels"])
