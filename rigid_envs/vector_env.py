"""The vector environment: many worlds in one Gymnasium VectorEnv, with no Python loop over them."""

from collections.abc import Sequence
from typing import Any

import gymnasium as gym
import numpy as np
from gymnasium.vector import AutoresetMode, VectorEnv
from gymnasium.vector.utils import batch_space

from physics import Fidelity
from physics.scene.validation import choice, integer
from rigid_envs.episodes.arguments import argument_names, make_task
from rigid_envs.episodes.checks import KEEP_SEED, check_seed
from rigid_envs.episodes.pixels import pixel_settings
from rigid_envs.episodes.runner import Observation, Runner
from rigid_envs.rendering.camera import Camera
from rigid_envs.rendering.pictures import FPS, RENDER_MODES, Pictures
from rigid_envs.tasks import Task
from rigid_envs.tasks.rewards import Reward, describe_info

Array = np.ndarray


class RigidVectorEnv(VectorEnv[Observation, Array, Array]):
    """A task in `num_envs` worlds.

    After `reset(seed=s)`, world i is bitwise identical to a single environment after
    `reset(seed=s + i)`.

    Args:
        task: name, class or object of a task.
        num_envs: number of worlds.
        reward_type: "sparse" (-1 or 0) or "dense" (shaped).
        fidelity: "fast", "balanced", "accurate", "solid" or a physics.Fidelity.
        render_mode: None, "rgb_array" (one frame per world) or "human" (a grid of frames).
        width: of a world's frame in pixels.
        height: of a world's frame in pixels.
        camera: where frames are taken from: "task", "follow", "front", "side", "back" or "top", a
            dict with position, target (m) or field_of_view (degrees), or a Camera; the task's own
            if None. With "follow" frames follow the achieved goal; pixels that are observed do not.
        show_forces: draw contact forces.
        show_particles: draw the collision samples of the solids in their outlines.
        render_worlds: largest number of worlds to draw; the first ones are drawn. If None, all of
            them with "rgb_array", 16 with "human".
        max_episode_steps: number of steps after which an episode is truncated; the task's number if
            None, no limit if -1.
        terminate_on_success: whether success terminates an episode.
        autoreset_mode: NEXT_STEP, SAME_STEP or DISABLED, see gymnasium.vector.AutoresetMode.
        threads: number of threads among which the worlds are divided; all cores if None.
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
        width: int = 480,
        height: int = 480,
        camera: Any = None,
        show_forces: bool = False,
        show_particles: bool = False,
        render_worlds: int | None = None,
        max_episode_steps: int | None = None,
        terminate_on_success: bool = False,
        autoreset_mode: str | AutoresetMode = AutoresetMode.NEXT_STEP,
        threads: int | None = None,
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
        """Builds the worlds. Call `reset` to start episodes."""
        self.num_envs = integer("num_envs", num_envs, low=1)
        self.render_mode = render_mode
        self.autoreset_mode = _autoreset_mode(autoreset_mode)
        self.metadata = {**type(self).metadata, "autoreset_mode": self.autoreset_mode}
        own = make_task(task, arguments, argument_names(RigidVectorEnv))
        try:
            self._runner = Runner(
                own,
                self.num_envs,
                reward_type,
                fidelity,
                threads,
                max_episode_steps,
                terminate_on_success,
                randomize,
                observe_parameters,
                observe_task_guide,
                pixel_settings(obs_type, pixels, pixel_size, frame_stack, camera),
                kernel,
                obs_type == "flat",
            )
        except MemoryError as error:
            raise MemoryError(f"num_envs={self.num_envs}: {error}") from None
        self._pictures = Pictures(
            self._runner, render_mode, width, height, camera, show_forces, show_particles,
            render_worlds, obs_type.startswith("pixels"),
        )  # fmt: skip
        self._ended = np.zeros(self.num_envs, dtype=bool)
        self.single_observation_space = self._runner.observation_space
        self.single_action_space = self._runner.action_space
        self.observation_space = batch_space(self.single_observation_space, self.num_envs)
        self.action_space = batch_space(self.single_action_space, self.num_envs)

    @property
    def np_random_seed(self) -> tuple[int, ...]:  # type: ignore[override]
        """Seed of each world; -1 of one that has had none yet."""
        return tuple(self._runner.seeds.tolist())

    @property
    def task(self) -> Task:
        """The task."""
        return self._runner.task

    @property
    def camera(self) -> Camera:
        """Where frames are taken from; it can be set as that of `RigidEnv`."""
        return self._pictures.camera

    @camera.setter
    def camera(self, camera: Any) -> None:
        self._pictures.look(camera)

    @property
    def runner(self) -> Runner:
        """The runner that plays the episodes."""
        return self._runner

    def reset(
        self,
        *,
        seed: int | list[int | None] | None = None,
        options: dict[str, Any] | None = None,
    ) -> tuple[Observation, dict[str, Any]]:
        """Starts episodes in all worlds, or in some of them.

        Args:
            seed: an integer s gives world i the seed s + i. A list gives each world its own seed;
                where it is None, and in all worlds if seed is None, the world starts its next
                episode. A world that has never had a seed draws one.
            options: {"reset_mask": [num_envs] bool} selects the worlds to reset.
                {"randomize": ranges} replaces their ranges from this episode on; None restores
                those of the constructor.

        Raises:
            TypeError, ValueError: an invalid seed, an unknown option, or an invalid mask. No state
                has changed then.
        """
        mask, seeds = self._reset_mask(options), self._seeds(seed)
        super().reset(seed=None if seeds[0] == KEEP_SEED else int(seeds[0]))
        missing = self._runner.unseeded & (seeds == KEEP_SEED)
        if (missing & mask).any():
            fresh = int(self.np_random.integers(2**31)) + np.arange(self.num_envs)
            seeds = np.where(missing, fresh, seeds)
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
                f'options accepts only "reset_mask" and "randomize", got {sorted(options)}'
            )
        if mask is None:
            return np.ones(self.num_envs, dtype=bool)
        mask = np.asarray(mask)
        expected = (
            f"reset_mask must be bools of shape ({self.num_envs},), at least one of them True"
        )
        if mask.dtype != bool:
            raise TypeError(f"{expected}, got {mask.dtype}")
        if mask.shape != (self.num_envs,) or not mask.any():
            raise ValueError(f"{expected}, got {mask.sum()} of shape {mask.shape}")
        return mask

    def _seeds(self, seed: int | list[int | None] | None) -> Array:
        """Seeds [num_envs]; KEEP_SEED where none is given."""
        if seed is None:
            return np.full(self.num_envs, KEEP_SEED)
        if isinstance(seed, int | np.integer):
            return check_seed("seed", seed) + np.arange(self.num_envs)
        if not isinstance(seed, list | tuple | np.ndarray) or len(seed) != self.num_envs:
            raise ValueError(
                f"seed must be None, an int, or a list of {self.num_envs} of them, got {seed!r}"
            )
        return np.array(
            [KEEP_SEED if s is None else check_seed(f"seed[{i}]", s) for i, s in enumerate(seed)]
        )

    def step(self, actions: Array) -> tuple[Observation, Array, Array, Array, dict[str, Any]]:
        """Advances every world by one step of 40 ms.

        Raises:
            ValueError: the actions have another shape or contain NaN. No state has changed then.
            gymnasium.error.ResetNeeded: the environment has not been reset yet; or, in DISABLED
                mode, worlds have ended and not been reset.
            SimulationDiverged: a world has diverged. The other worlds are unaffected.
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
            # this step resets the worlds that ended in the last step
            observation, reward, terminated, truncated, info = self._runner.step(
                actions, self._ended
            )
            self._ended = terminated | truncated
            return observation, reward, terminated, truncated, _with_masks(info, self.num_envs)

        observation, reward, terminated, truncated, info = self._runner.step(actions)
        ended = terminated | truncated
        if self.autoreset_mode == AutoresetMode.DISABLED:
            self._ended = ended
            return observation, reward, terminated, truncated, _with_masks(info, self.num_envs)
        final: dict[str, Any] = {}
        if ended.any():
            final = self._final(observation, info, ended)
            self._runner.reset(ended)
            observation, info = self._runner.observe()
        infos = {**_with_masks(info, self.num_envs), **final}
        return observation, reward, terminated, truncated, infos

    def _final(self, observation: Observation, info: dict[str, Array], ended: Array) -> Any:
        """Last observations and infos of the worlds that ended, with Gymnasium's names."""
        last = np.full(self.num_envs, None, dtype=object)
        for i in np.flatnonzero(ended):
            if isinstance(observation, dict):
                last[i] = {name: values[i] for name, values in observation.items()}
            else:
                last[i] = observation[i]
        final_info = {name: values.copy() for name, values in info.items()}
        final_info |= {f"_{name}": ended for name in info}
        return {
            "final_obs": last,
            "_final_obs": ended,
            "final_info": final_info,
            "_final_info": ended,
        }

    def call(self, name: str, *args: Any, **kwargs: Any) -> tuple[Any, ...]:
        """The result of a method, or an attribute, once for each world: all worlds share it."""
        found = getattr(self, name)
        return (found(*args, **kwargs) if callable(found) else found,) * self.num_envs

    def get_attr(self, name: str) -> tuple[Any, ...]:
        """An attribute, once for each world: all worlds share it."""
        return (getattr(self, name),) * self.num_envs

    def set_attr(self, name: str, values: Any) -> None:
        """Sets an attribute.

        Args:
            name: its name.
            values: one value, or a list or tuple of one for each world, all of them equal.

        Raises:
            ValueError: values differ, or there are not as many as worlds.
        """
        if isinstance(values, list | tuple):
            same = len(values) == self.num_envs and all(one == values[0] for one in values)
            if not same:
                raise ValueError(
                    f"values of {name!r} must be {self.num_envs} equal ones, as all worlds share "
                    f"the attribute; got {values!r}"
                )
            values = values[0]
        setattr(self, name, values)

    @property
    def reward(self) -> Reward:
        """Threshold and weights of the reward. Reward wrappers read it."""
        return self._runner.reward

    def compute_reward(self, achieved_goal: Array, desired_goal: Array, info: Any) -> Any:
        """The reward of pairs of goals; see `RigidEnv.compute_reward`."""
        return self._runner.compute_reward(achieved_goal, desired_goal, info)

    def compute_terminated(self, achieved_goal: Array, desired_goal: Array, info: Any) -> Any:
        """Whether a step terminates the episode; see `RigidEnv.compute_terminated`."""
        return self._runner.compute_terminated(achieved_goal, desired_goal)

    def compute_truncated(self, achieved_goal: Array, desired_goal: Array, info: Any) -> Any:
        """Whether a step left the bounds; see `RigidEnv.compute_truncated`."""
        return self._runner.compute_truncated(achieved_goal, info)

    def render(self) -> tuple[Array, ...] | None:
        """A frame [height, width, 3] uint8 of each world, or of the first `render_worlds`.

        "human" shows them in a grid. `rigid_envs.rendering.renderer.grid` tiles the frames.
        """
        if self.render_mode is None:
            gym.logger.warn('render() needs gym.make_vec(..., render_mode="rgb_array") or "human"')
            return None
        if self.render_mode == "human":
            self._pictures.show()
            return None
        return self._pictures.frames()

    def get_state(self) -> dict[str, Any]:
        """The complete state of all episodes; it can be pickled."""
        return {**self._runner.get_state(), "ended": self._ended.copy()}

    def set_state(self, state: dict[str, Any]) -> None:
        """Restores a state from `get_state`; the episodes then continue bitwise identically.

        Raises:
            ValueError: not such a state, or one of another scene, fidelity, count or version.
        """
        if not isinstance(state, dict) or "ended" not in state:
            raise ValueError(
                "state must come from get_state of a vector environment, got "
                f"{describe_info(state)}"
            )
        state = dict(state)
        ended = state.pop("ended")
        self._runner.set_state(state)
        self._ended = np.array(ended)

    def close_extras(self, **kwargs: Any) -> None:
        """Closes the window, if there is one; also called where the constructor has raised."""
        if hasattr(self, "_pictures"):
            self._pictures.close()


def _autoreset_mode(mode: str | AutoresetMode) -> AutoresetMode:
    if isinstance(mode, AutoresetMode):
        return mode
    names = {m.value: m for m in AutoresetMode} | {m.name: m for m in AutoresetMode}
    return names[choice("autoreset_mode", mode, names)]


def _with_masks(info: dict[str, Array], count: int) -> dict[str, Any]:
    """Adds Gymnasium's masks, which are true for all worlds."""
    everywhere = np.ones(count, dtype=bool)
    return {**info, **{f"_{name}": everywhere for name in info}}
