"""One world as a Gymnasium environment."""

from typing import Any

import gymnasium as gym
import numpy as np

from physics import Fidelity
from rigid_envs.episodes.arguments import make_task, words
from rigid_envs.episodes.runner import Observation, Runner, check_seed
from rigid_envs.rendering.pictures import FPS, RENDER_MODES, Pictures
from rigid_envs.tasks import Task
from rigid_envs.tasks.rewards import Reward

Array = np.ndarray


class RigidEnv(gym.Env[Observation, Array]):
    """A task in one world.

    Args:
        task: a task's name or class, or a task.
        reward_type: "sparse": -1 or 0; "dense": shaped.
        fidelity: "fast", "balanced", "accurate", "solid" or a physics.Fidelity.
        render_mode: None, "rgb_array" or "human".
        show_forces: draw contact forces.
        show_particles: draw what the solids touch with in place of their exact shapes.
        render_size: width and height of a picture in pixels.
        max_episode_steps: truncate after so many steps; None leaves that to gym.make's TimeLimit.
        terminate_on_success: end an episode when it is solved.
        randomize: ranges of parameters that are drawn for each episode, as {"mass": (0.5, 2.0)}:
            see `rigid_envs.episodes.randomization.Randomization`.
        observe_parameters: what `randomize` names is observed too.
        guided: what is left to do is observed too, as the task tells it from both goals. Not for
            learners that relabel goals (HER): they would read the goal that was.
        **arguments: of the task, as `blocks`.
    """

    metadata: dict[str, Any] = {"render_modes": list(RENDER_MODES), "render_fps": FPS}

    def __init__(
        self,
        task: str | type[Task] | Task = "push",
        reward_type: str = "sparse",
        fidelity: str | Fidelity = "balanced",
        render_mode: str | None = None,
        show_forces: bool = False,
        show_particles: bool = False,
        render_size: int = 480,
        max_episode_steps: int | None = None,
        terminate_on_success: bool = False,
        randomize: Any = None,
        observe_parameters: bool = False,
        guided: bool = False,
        **arguments: Any,
    ) -> None:
        """Builds the world; an episode begins with `reset`."""
        self.render_mode = render_mode
        self._runner = Runner(
            make_task(task, arguments, words(RigidEnv)),
            1,
            reward_type,
            fidelity,
            1,
            max_episode_steps,
            terminate_on_success,
            randomize,
            observe_parameters,
            guided,
        )
        self._pictures = Pictures(
            self._runner, render_mode, show_forces, show_particles, size=render_size
        )
        self.observation_space: Any = self._runner.observation_space
        self.action_space = self._runner.action_space

    @property
    def task(self) -> Task:
        """What is to be done in the world."""
        return self._runner.task

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Observation, dict[str, Any]]:
        """Starts an episode: the seed's first, or the next one.

        options["randomize"] gives other ranges from this episode on; None, the constructor's.

        Raises:
            TypeError, ValueError: a bad seed, an unknown option.
        """
        if set(options or {}) - {"randomize"}:
            raise ValueError(f'options knows only "randomize", got {options!r}')
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
        """Advances by a frame of 40 ms.

        Raises:
            ValueError: an action of the wrong shape or with NaN; the state is then as it was.
            gymnasium.error.ResetNeeded: before the first reset.
            SimulationDiverged: the state turned non-finite.
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
        """How goals and raw terms make the reward; wrappers ask it when goals agree."""
        return self._runner.reward

    def compute_reward(self, achieved_goal: Array, desired_goal: Array, info: Any) -> Any:
        """The reward of goals [..., goal]; see `rigid_envs.tasks.rewards.Reward.compute`.

        Raises:
            ValueError: with the dense reward, other goals than those of the info's step.
        """
        runner = self._runner
        return runner.reward.compute(runner.reward_type, achieved_goal, desired_goal, info)

    def render(self) -> Array | None:
        """A frame [480, 480, 3] uint8 in "rgb_array" mode; draws the window in "human" mode."""
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
        """Everything that the episode holds."""
        return self._runner.get_state()

    def set_state(self, state: dict[str, Any]) -> None:
        """Takes the episode back to what `get_state` gave, to the last bit."""
        self._runner.set_state(state)

    def close(self) -> None:
        """Closes the window, if any."""
        self._pictures.close()


def _first(observation: Observation) -> Observation:
    return {name: values[0] for name, values in observation.items()}


def _first_info(info: dict[str, Array]) -> dict[str, Any]:
    return {name: values.item() if values.ndim == 1 else values[0] for name, values in info.items()}
