"""Many worlds as a Gymnasium vector environment, without any Python a world."""

from typing import Any

import gymnasium as gym
import numpy as np
from gymnasium.vector import AutoresetMode, VectorEnv
from gymnasium.vector.utils import batch_space

from physics import Fidelity
from physics.scene.validation import choice, integer
from rigid_envs.episodes.arguments import make_task, words
from rigid_envs.episodes.runner import Observation, Runner, check_seed
from rigid_envs.rendering.pictures import FPS, RENDER_MODES, Pictures
from rigid_envs.tasks import Task
from rigid_envs.tasks.rewards import Reward

Array = np.ndarray


class RigidVectorEnv(VectorEnv[Observation, Array, Array]):
    """A task in `num_envs` worlds.

    World i of reset(seed=s) behaves as the single environment reset with s + i, bit for bit.

    Args:
        task: a task's name or class, or a task.
        num_envs: number of worlds.
        reward_type: "sparse": -1 or 0; "dense": shaped.
        fidelity: "fast", "balanced", "accurate", "solid" or a physics.Fidelity.
        render_mode: None, "rgb_array" (a frame a world) or "human" (a grid of them).
        show_forces: draw contact forces.
        show_particles: draw what the solids touch with in place of their exact shapes.
        render_worlds: how many worlds to draw at most: the first ones.
        render_size: width and height of a world's picture in pixels.
        max_episode_steps: truncate after so many steps; never if None.
        terminate_on_success: end an episode when it is solved.
        randomize: ranges of parameters that are drawn for each episode, as {"mass": (0.5, 2.0)}:
            see `rigid_envs.episodes.randomization.Randomization`.
        observe_parameters: what `randomize` names is observed too.
        guided: what is left to do is observed too, as the task tells it from both goals. Not for
            learners that relabel goals (HER): they would read the goal that was.
        autoreset_mode: NEXT_STEP, SAME_STEP or DISABLED, as gymnasium.vector.AutoresetMode.
        threads: to share the worlds out over; all cores if None.
        **arguments: of the task, as `blocks`.
    """

    metadata: dict[str, Any] = {
        "render_modes": list(RENDER_MODES),
        "render_fps": FPS,
        "autoreset_mode": AutoresetMode.NEXT_STEP,
    }

    def __init__(
        self,
        task: str | type[Task] | Task = "push",
        num_envs: int = 1,
        reward_type: str = "sparse",
        fidelity: str | Fidelity = "balanced",
        render_mode: str | None = None,
        show_forces: bool = False,
        show_particles: bool = False,
        render_worlds: int = 16,
        render_size: int = 480,
        max_episode_steps: int | None = 50,
        terminate_on_success: bool = False,
        autoreset_mode: str | AutoresetMode = AutoresetMode.NEXT_STEP,
        threads: int | None = None,
        randomize: Any = None,
        observe_parameters: bool = False,
        guided: bool = False,
        **arguments: Any,
    ) -> None:
        """Builds the worlds; episodes begin with `reset`."""
        self.num_envs = integer("num_envs", num_envs, low=1)
        self.render_mode = render_mode
        self.autoreset_mode = _autoreset_mode(autoreset_mode)
        self.metadata = {**type(self).metadata, "autoreset_mode": self.autoreset_mode}
        self._runner = Runner(
            make_task(task, arguments, words(RigidVectorEnv)),
            self.num_envs,
            reward_type,
            fidelity,
            threads,
            max_episode_steps,
            terminate_on_success,
            randomize,
            observe_parameters,
            guided,
        )
        self._pictures = Pictures(
            self._runner, render_mode, show_forces, show_particles, render_worlds, render_size
        )
        self._ended = np.zeros(self.num_envs, dtype=bool)
        self.single_observation_space = self._runner.observation_space
        self.single_action_space = self._runner.action_space
        self.observation_space = batch_space(self.single_observation_space, self.num_envs)
        self.action_space = batch_space(self.single_action_space, self.num_envs)

    def reset(
        self,
        *,
        seed: int | list[int | None] | None = None,
        options: dict[str, Any] | None = None,
    ) -> tuple[Observation, dict[str, Any]]:
        """Starts episodes in all worlds, or in those of options["reset_mask"] [num_envs].

        options["randomize"] gives these worlds other ranges from now on; None, the constructor's.

        Raises:
            TypeError, ValueError: a bad seed, an unknown option, a mask of the wrong shape.
        """
        mask, seeds = self._reset_mask(options), self._seeds(seed)
        super().reset(seed=None if seeds is None else int(seeds[0]))
        if seeds is None and not self._runner.seeded:
            seeds = self._seeds(int(self.np_random.integers(2**31)))
        self._runner.reset(mask, seeds, options)
        self._ended &= ~mask
        observation, info = self._runner.observe()
        return observation, _with_masks(info, self.num_envs)

    def _reset_mask(self, options: dict[str, Any] | None) -> Array:
        options = dict(options or {})
        mask = options.pop("reset_mask", None)
        options.pop("randomize", None)
        if options:
            raise ValueError(
                f'options knows only "reset_mask" and "randomize", got {sorted(options)}'
            )
        if mask is None:
            return np.ones(self.num_envs, dtype=bool)
        mask = np.asarray(mask)
        if mask.dtype != bool or mask.shape != (self.num_envs,) or not mask.any():
            raise ValueError(
                f"reset_mask must be bools of shape ({self.num_envs},) with one true at least, "
                f"got {mask.dtype} of shape {mask.shape}"
            )
        return mask

    def _seeds(self, seed: int | list[int | None] | None) -> Array | None:
        if seed is None:
            return None
        if isinstance(seed, int | np.integer):
            return check_seed("seed", seed) + np.arange(self.num_envs)
        if not isinstance(seed, list | tuple | np.ndarray) or len(seed) != self.num_envs:
            raise ValueError(f"seed must be an int or {self.num_envs} of them, got {seed!r}")
        return np.array([check_seed(f"seed[{i}]", s) for i, s in enumerate(seed)])

    def step(self, actions: Array) -> tuple[Observation, Array, Array, Array, dict[str, Any]]:
        """Advances every world by a frame of 40 ms.

        Raises:
            ValueError: actions of the wrong shape or with NaN; the state is then as it was.
            gymnasium.error.ResetNeeded: before the first reset; in DISABLED mode, with worlds that
                ended and weren't reset.
            SimulationDiverged: a world turned non-finite; the others are whole.
        """
        if not self._runner.seeded:
            raise gym.error.ResetNeeded("reset() must be called before step()")
        if self.autoreset_mode == AutoresetMode.DISABLED and self._ended.any():
            worlds = np.flatnonzero(self._ended)
            raise gym.error.ResetNeeded(
                f"worlds {worlds[:8].tolist()}{'...' if len(worlds) > 8 else ''} have ended: call "
                'reset(options={"reset_mask": terminated | truncated}) first'
            )
        if self.autoreset_mode == AutoresetMode.NEXT_STEP:
            # this step is the reset of the worlds that ended in the last one
            observation, reward, terminated, truncated, info = self._runner.step(
                actions, self._ended
            )
            self._ended = terminated | truncated
            return observation, reward, terminated, truncated, _with_masks(info, self.num_envs)

        observation, reward, terminated, truncated, info = self._runner.step(actions)
        infos = info
        ended = terminated | truncated
        if self.autoreset_mode == AutoresetMode.DISABLED:
            self._ended = ended
            return observation, reward, terminated, truncated, _with_masks(infos, self.num_envs)
        final: dict[str, Any] = {}
        if ended.any():
            final = self._final(observation, info, ended)
            self._runner.reset(ended)
            observation, infos = self._runner.observe()
        infos = {**_with_masks(infos, self.num_envs), **final}
        return observation, reward, terminated, truncated, infos

    def _final(self, observation: Observation, info: dict[str, Array], ended: Array) -> Any:
        """Last observations and infos of the worlds that ended, by Gymnasium's names."""
        last = np.full(self.num_envs, None, dtype=object)
        for i in np.flatnonzero(ended):
            last[i] = {name: values[i] for name, values in observation.items()}
        final_info = {name: values.copy() for name, values in info.items()}
        final_info |= {f"_{name}": ended for name in info}
        return {
            "final_obs": last,
            "_final_obs": ended,
            "final_info": final_info,
            "_final_info": ended,
        }

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

    def render(self) -> tuple[Array, ...] | None:
        """A frame [480, 480, 3] uint8 of each of the first worlds; "human" shows them as a grid.

        At most `render_worlds` are drawn. `rigid_envs.rendering.renderer.grid` makes one
        picture of several frames.
        """
        if self.render_mode is None:
            gym.logger.warn('render() needs gym.make_vec(..., render_mode="rgb_array") or "human"')
            return None
        if self.render_mode == "human":
            self._pictures.show()
            return None
        return self._pictures.frames()

    def get_state(self) -> dict[str, Any]:
        """Everything that the episodes hold."""
        return {**self._runner.get_state(), "ended": self._ended.copy()}

    def set_state(self, state: dict[str, Any]) -> None:
        """Takes all episodes back to what `get_state` gave, to the last bit."""
        if not isinstance(state, dict) or "ended" not in state:
            raise ValueError(f"state must come from get_state, got {state!r}")
        state = dict(state)
        ended = state.pop("ended")
        self._runner.set_state(state)
        self._ended = np.array(ended)

    def close_extras(self, **kwargs: Any) -> None:
        """Closes the window, if any."""
        self._pictures.close()


def _autoreset_mode(mode: str | AutoresetMode) -> AutoresetMode:
    if isinstance(mode, AutoresetMode):
        return mode
    names = {m.value: m for m in AutoresetMode} | {m.name: m for m in AutoresetMode}
    return names[choice("autoreset_mode", mode, names)]


def _with_masks(info: dict[str, Array], count: int) -> dict[str, Any]:
    """Adds Gymnasium's masks: every entry holds for every world."""
    everywhere = np.ones(count, dtype=bool)
    return {**info, **{f"_{name}": everywhere for name in info}}
