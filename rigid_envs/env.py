"""The single environment: one world as a Gymnasium environment."""

from collections.abc import Mapping, Sequence
from typing import Any

import gymnasium as gym
import numpy as np
from gymnasium.envs.registration import EnvSpec

from physics import Fidelity
from rigid_envs.episodes.arguments import argument_names, make_task
from rigid_envs.episodes.checks import check_seed
from rigid_envs.episodes.pixels import pixel_settings
from rigid_envs.episodes.runner import Observation, Runner
from rigid_envs.rendering.camera import Camera
from rigid_envs.rendering.pictures import FPS, RENDER_MODES, Pictures
from rigid_envs.tasks import Task
from rigid_envs.tasks.rewards import Reward

Array = np.ndarray


class RigidEnv(gym.Env[Observation, Array]):
    """A task in one world.

    Args:
        task: name, class or object of a task.
        reward_type: "sparse" (-1 or 0) or "dense" (shaped).
        fidelity: "fast", "balanced", "accurate", "solid" or a physics.Fidelity.
        render_mode: None, "rgb_array" or "human".
        width: of a frame in pixels.
        height: of a frame in pixels.
        camera: where frames are taken from: "task", "follow", "front", "side", "back" or "top", a
            dict with position, target (m) or field_of_view (degrees), or a Camera; the task's own
            if None. With "follow" frames follow the achieved goal; pixels that are observed do not.
        show_forces: draw contact forces.
        show_particles: draw the collision samples of the solids in their outlines.
        max_episode_steps: number of steps after which an episode is truncated; the task's number if
            None, no limit if -1. `gym.make` does not pass its own argument of this name on: it
            wraps the environment in a TimeLimit, which then replaces the task's number.
        terminate_on_success: whether success terminates an episode.
        randomize: ranges of parameters that are drawn for each episode, such as
            {"mass": (0.5, 2.0)}; see `rigid_envs.episodes.randomization.Randomization`.
        observe_parameters: append the drawn parameters to the observation.
        observe_task_guide: append the task's guide to the observation: what is left to do, computed
            from both goals. Do not use it with learners that relabel goals (HER): the guide would
            still show the original goal.
        obs_type: "state", "flat", "pixels" or "pixels+state". "flat" observes state, achieved goal
            and desired goal in this order in one array [n], for learners without dictionaries; it
            is a value of this argument because pictures can't be part of it. With pixels,
            `observation` is a picture [height, width, channels] uint8; the goals stay numbers, and
            are not drawn. With both, the state is observed as `state`.
        pixels: "rgb" (3 channels, the default), "depth", "segmentation", or a tuple of several.
        pixel_size: width and height of an observed picture, or (width, height); 84 by default.
        frame_stack: how many steps' pictures are stacked along the channels, the last step's last;
            1 by default.
        kernel: "special", "general", "auto" or None, see `physics.World`. With "auto", if no kernel
            that can advance a registered task has been compiled, its special one is.
        **arguments: arguments of the task, such as `blocks`.
    """

    metadata: dict[str, Any] = {"render_modes": list(RENDER_MODES), "render_fps": FPS}
    _spec: EnvSpec | None = None

    def __init__(
        self,
        task: str | type[Task] | Task = "push",
        reward_type: str = "sparse",
        fidelity: str | Fidelity = "balanced",
        render_mode: str | None = None,
        width: int = 480,
        height: int = 480,
        camera: Any = None,
        show_forces: bool = False,
        show_particles: bool = False,
        max_episode_steps: int | None = None,
        terminate_on_success: bool = False,
        randomize: Any = None,
        observe_parameters: bool = False,
        observe_task_guide: bool = False,
        obs_type: str = "state",
        pixels: str | Sequence[str] | None = None,
        pixel_size: int | tuple[int, int] | None = None,
        frame_stack: int | None = None,
        kernel: str | None = None,
        **arguments: Any,
    ) -> None:
        """Builds the world. Call `reset` to start an episode."""
        self.render_mode = render_mode
        self._runner = Runner(
            make_task(task, arguments, argument_names(RigidEnv)),
            1,
            reward_type,
            fidelity,
            1,
            max_episode_steps,
            terminate_on_success,
            randomize,
            observe_parameters,
            observe_task_guide,
            pixel_settings(obs_type, pixels, pixel_size, frame_stack, camera),
            kernel,
            obs_type == "flat",
        )
        self._limit_is_default = max_episode_steps is None
        self._pictures = Pictures(
            self._runner, render_mode, width, height, camera, show_forces, show_particles,
            pixels=obs_type.startswith("pixels"),
        )  # fmt: skip
        self.observation_space: Any = self._runner.observation_space
        self.action_space = self._runner.action_space

    @property
    def spec(self) -> EnvSpec | None:
        """Gymnasium's specification of the environment, which `gym.make` sets."""
        return self._spec

    @spec.setter
    def spec(self, spec: EnvSpec | None) -> None:
        self._spec = spec
        # gym.make limits episodes by a TimeLimit: without this line,
        # gym.make(id, max_episode_steps=200) would still end episodes after the task's number
        if spec is not None and self._limit_is_default:
            self._runner.max_episode_steps = None

    @property
    def task(self) -> Task:
        """The task."""
        return self._runner.task

    @property
    def camera(self) -> Camera:
        """Where frames are taken from.

        It can be set to what the argument `camera` takes; observed pictures stay as they are.
        """
        return self._pictures.camera

    @camera.setter
    def camera(self, camera: Any) -> None:
        self._pictures.look(camera)

    def camera_for(self, states: Sequence[dict[str, Any]]) -> Camera:
        """A camera from the side of the task's that sees some states from as near as it can.

        It sees what moves and goals in all of these states, and in the first one what carries the
        tool.

        Args:
            states: from `get_state`, as those of an episode. The environment's own state stays.

        Raises:
            TypeError, ValueError: no list, no states, or not such states.
        """
        if isinstance(states, Mapping):
            raise TypeError("states must be a list of states, got a single one")
        if not states:
            raise ValueError("states must be at least one, got none")
        now = self.get_state()
        try:
            points = []
            for n, state in enumerate(states):
                self.set_state(state)
                points.append(self._pictures.points(arms=n == 0))
        finally:
            self.set_state(now)
        return self._pictures.fitted(np.concatenate(points))

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Observation, dict[str, Any]]:
        """Starts an episode: the first one of a seed, or the next one.

        Args:
            seed: an integer from 0 to 2**62. Without a seed at the first reset, one is drawn.
            options: {"randomize": ranges} replaces the ranges from this episode on; None restores
                those of the constructor.

        Raises:
            TypeError, ValueError: an invalid seed, or an unknown option.
        """
        if set(options or {}) - {"randomize"}:
            raise ValueError(f'options accepts only "randomize", got {options!r}')
        seed = None if seed is None else check_seed("seed", seed)
        super().reset(seed=seed)
        if seed is None and not self._runner.seeded:
            seed = int(self.np_random.integers(2**31))
        seeds = None if seed is None else np.array([seed])
        self._runner.reset(np.ones(1, dtype=bool), seeds, options)
        observation, info = self._runner.observe()
        if self.render_mode == "human":
            self.render()
        return _first(observation), _first_info(info)

    def step(self, action: Array) -> tuple[Observation, float, bool, bool, dict[str, Any]]:
        """Advances by one step of 40 ms.

        Raises:
            ValueError: the action has another shape or contains NaN. No state has changed then.
            gymnasium.error.ResetNeeded: the environment has not been reset yet.
            SimulationDiverged: the world has diverged. `reset` starts a new episode.
        """
        if not self._runner.seeded:
            raise gym.error.ResetNeeded("reset() must be called before step()")
        action = np.asarray(action)
        if action.shape != self.action_space.shape:
            raise ValueError(
                f"action must have shape {self.action_space.shape}, got {action.shape}: {action!r}"
            )
        step = self._runner.step(action[None])
        if self.render_mode == "human":
            self.render()
        return (
            _first(step.observation),
            float(step.reward[0]),
            bool(step.terminated[0]),
            bool(step.truncated[0]),
            _first_info(step.info),
        )

    @property
    def reward(self) -> Reward:
        """Threshold and weights of the reward. Reward wrappers read it."""
        return self._runner.reward

    @property
    def distance_threshold(self) -> float:
        """Largest goal distance at which the task counts as solved; it can be set."""
        return self.task.distance_threshold

    @distance_threshold.setter
    def distance_threshold(self, threshold: float) -> None:
        self.task.distance_threshold = threshold

    @property
    def goal(self) -> Array:
        """The desired goal [goal] of the episode; a copy."""
        return self._runner.goals[0].copy()

    def compute_reward(self, achieved_goal: Array, desired_goal: Array, info: Any) -> Any:
        """The reward of pairs of goals, as HER needs it.

        Args:
            achieved_goal: [..., goal].
            desired_goal: [..., goal].
            info: the info of the step: a dict, or a sequence of dicts for a batch. The sparse
                reward ignores it.

        Returns:
            Rewards [...]; a NumPy float for a single pair.

        Raises:
            ValueError: with the dense reward, other goals than those of the step, or no info.
        """
        return self._runner.compute_reward(achieved_goal, desired_goal, info)

    def compute_terminated(self, achieved_goal: Array, desired_goal: Array, info: Any) -> Any:
        """Whether [...] a step with these goals [..., goal] terminates the episode.

        True where the goals count as success and `terminate_on_success` is set. `info` is ignored.
        """
        return self._runner.compute_terminated(achieved_goal, desired_goal)

    def compute_truncated(self, achieved_goal: Array, desired_goal: Array, info: Any) -> Any:
        """Whether [...] a step was truncated for another reason than the number of steps.

        True where `info`, the info of the step (a dict, or a sequence of dicts for a batch), has a
        true "out_of_bounds". Goals do not cause truncation, and the limit of steps is not included:
        neither goals nor info hold the number of steps.
        """
        return self._runner.compute_truncated(achieved_goal, info)

    def render(self) -> Array | None:
        """A frame [height, width, 3] uint8 with "rgb_array"; "human" draws the window."""
        if self.render_mode is None:
            gym.logger.warn(
                'render() needs a render mode: gym.make(..., render_mode="rgb_array") or "human"'
            )
            return None
        if self.render_mode == "human":
            self._pictures.show()
            return None
        return self._pictures.frames()[0]

    def get_state(self) -> dict[str, Any]:
        """The complete state of the episode; it can be pickled."""
        return self._runner.get_state()

    def set_state(self, state: dict[str, Any]) -> None:
        """Restores a state from `get_state`; the episode then continues bitwise identically.

        Raises:
            ValueError: not such a state, or one of another scene, fidelity or version.
        """
        self._runner.set_state(state)

    def close(self) -> None:
        """Closes the window, if there is one."""
        self._pictures.close()


def _first(observation: Observation) -> Observation:
    if not isinstance(observation, dict):
        return observation[0]
    return {name: values[0] for name, values in observation.items()}


def _first_info(info: dict[str, Array]) -> dict[str, Any]:
    return {name: values.item() if values.ndim == 1 else values[0] for name, values in info.items()}
