"""The session: the worlds that a page shows, and what its controls do to them. It needs no page."""

import time
from collections import deque
from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np

from physics import Fidelity, SimulationDiverged
from physics.scene.fidelity import resolve
from rigid_envs.episodes.runner import Observation, Runner

Array = np.ndarray
Policy = Callable[[Observation], Array]
"""Takes observations, a dict of arrays [count, n]; returns actions [count, actions]."""

PLOTTED = 250  # steps of the reward plot, 10 s
MEASURED = 10  # steps after which a setting is worth a comparison
# steps that are timed in a row, of which the fastest counts because others may have waited for a
# core, and steps of the session after which they are timed again
TIMED, RETIMED = 10, 25


class Reading(NamedTuple):
    """What a setting costs and gains.

    Attributes:
        fidelity: of the worlds.
        mass: factor of the bodies' masses; None if they are those of the episodes.
        friction: of the bodies; None likewise.
        step_time: s of wall time that the engine takes for a step of one world; NaN if a world
            diverges.
        speed: simulated seconds of all worlds per second of wall time of the engine.
        penetrations: [count] m, deepest penetration in each world now.
        largest_step: s, largest stable substep with the contacts of the first world; inf if nothing
            limits it.
    """

    fidelity: Fidelity
    mass: float | None
    friction: float | None
    step_time: float
    speed: float
    penetrations: Array
    largest_step: float


class Session:
    """Episodes in the worlds of a runner, by a policy or random actions.

    Args:
        runner: whose worlds. They become worlds with per-world parameters.
        policy: chooses the actions; None for random ones.
        seed: of the first episodes and the random actions, at least 0.

    Attributes:
        observation: of the worlds now, what the policy gets.
        steps: number of steps since the last reset.
        paused: whether `advance` does nothing.
        error: what ended the simulation, until the next reset; empty while there is nothing.
        returns: [count] sum of the rewards of the running episodes.
        success: [count] bool, whether the worlds are solved now.
        finished: number of episodes that have ended since the last reset.
        solved: number of these that were solved at their end.
        return_sum: sum of their returns.
        before: the reading of the previous setting, None until a setting was changed.
    """

    def __init__(self, runner: Runner, policy: Policy | None = None, seed: int = 0) -> None:
        """Starts the first episodes."""
        self.runner, self.policy = runner, policy
        runner.use_per_world_parameters()
        self.paused = False
        self.mass: float | None = None
        self.friction: float | None = None
        self.before: Reading | None = None
        self._setting_steps = 0
        self._timed = np.nan, 0
        self._rewards: deque[tuple[float, float, float, float]] = deque(maxlen=PLOTTED)
        self.reset(seed)

    @property
    def fidelity(self) -> Fidelity:
        """The fidelity of the worlds."""
        return self.runner.world.fidelity

    def reset(self, seed: int) -> None:
        """Starts the first episode of the seeds seed, seed + 1, ... in the worlds.

        Settings of the session stay.
        """
        count, self._seed = self.runner.count, seed
        self.runner.reset(np.ones(count, dtype=bool), seed + np.arange(count))
        self._random = np.random.default_rng(seed)
        self.observation, info = self.runner.observe()
        self._ended = np.zeros(count, dtype=bool)
        self._rewards.clear()
        self.success, self.returns = info["is_success"], np.zeros(count)
        self.steps = self.finished = self.solved = 0
        self.return_sum, self.error = 0.0, ""

    def warm_up(self) -> None:
        """Compiles all that the session uses; its episodes begin again."""
        self.runner.prepare_fidelity(self.fidelity)
        self.step()
        self.reset(self._seed)

    def advance(self) -> None:
        """Advances by a step, unless the session is paused or has failed."""
        if not self.paused:
            self.step()

    def step(self) -> None:
        """Advances by a step. A world whose episode has ended starts its next one.

        If a world diverges, `error` says so and nothing advances until the next reset.
        """
        if self.error:
            return
        actions = self._actions()
        try:
            step = self.runner.step(actions, self._ended)
        except SimulationDiverged as error:
            self.error = str(error)
            return
        self.returns[self._ended] = 0.0
        self.observation, self.success = step.observation, step.info["is_success"]
        self.returns += step.reward
        self.steps += 1
        self._setting_steps += 1
        time_now = self.steps * self.runner.task.frame
        rewards = step.reward[~self._ended]  # what starts an episode has no reward yet
        if len(rewards):
            self._rewards.append((time_now, rewards.mean(), rewards.min(), rewards.max()))
        self._ended = ended = step.terminated | step.truncated
        self.finished += int(ended.sum())
        self.solved += int(self.success[ended].sum())
        self.return_sum += float(self.returns[ended].sum())

    def _actions(self) -> Array:
        if self.policy is not None:
            return self.policy(self.observation)
        return self._random.uniform(-1.0, 1.0, (self.runner.count, len(self.runner.task.actions)))

    def rewards(self) -> tuple[Array, Array, Array, Array]:
        """Time in s and mean, least and largest reward of the worlds, of the last steps [n]."""
        table = np.array(self._rewards, dtype=float).reshape(-1, 4)
        return table[:, 0], table[:, 1], table[:, 2], table[:, 3]

    def change_fidelity(self, fidelity: str | Fidelity) -> None:
        """Continues at another fidelity from the same positions and velocities.

        Raises:
            TypeError, ValueError: the engine can't simulate the scene with it; nothing has changed.
        """
        if resolve(fidelity) == self.fidelity:
            return
        self._timed = np.nan, 0  # what was timed while kernels were compiled doesn't count
        reading = self._reading_to_keep()
        self.runner.change_fidelity(fidelity)
        self._begin_setting(reading)

    def change_parameters(self, **parameters: float) -> None:
        """Gives all bodies another mass or friction, now and in the next episodes.

        Args:
            parameters: `mass`, a factor of the masses in the scene, or `friction`, of the bodies'
                material.

        Raises:
            TypeError, ValueError: the engine can't simulate the scene with it; nothing has changed.
        """
        given = {"mass": self.mass, "friction": self.friction, **parameters}
        chosen = {name: value for name, value in given.items() if value is not None}
        reading = self._reading_to_keep()
        self.runner.change_ranges(chosen)
        self.mass, self.friction = given["mass"], given["friction"]
        self._begin_setting(reading)

    def read(self) -> Reading:
        """What the present setting costs and gains."""
        runner = self.runner
        seconds, when = self._timed
        if np.isnan(seconds) or self._setting_steps >= when + RETIMED:
            seconds = self._time_engine()
            self._timed = seconds, self._setting_steps
        return Reading(
            self.fidelity,
            self.mass,
            self.friction,
            seconds / runner.count,
            runner.task.frame * runner.count / seconds,
            runner.world.penetration(),
            runner.world.largest_stable_step(),
        )

    def _reading_to_keep(self) -> Reading | None:
        # a slider that is dragged passes through settings that are never measured
        measured = self._setting_steps >= MEASURED and not self.error
        return self.read() if measured else self.before

    def _time_engine(self) -> float:
        """Wall time in s of a step of all worlds from their state now, which stays.

        The steps of the session aren't timed: between them the cores idle or draw, so that most of
        their time is that of waking up.
        """
        world, frame = self.runner.world, self.runner.task.frame
        saved, fastest = world.snapshot(), np.inf
        try:
            for _ in range(TIMED):
                start = time.perf_counter()
                world.advance(frame)
                fastest = min(fastest, time.perf_counter() - start)
        except SimulationDiverged:
            return np.nan
        finally:
            world.restore(saved)
        return float(fastest)

    def _begin_setting(self, before: Reading | None) -> None:
        self.before = before
        self._setting_steps, self._timed = 0, (np.nan, 0)

    def state(self) -> dict[str, Any]:
        """Numbers about the episodes, by the words that a page shows."""
        finished = max(self.finished, 1)
        return {
            "solved now": f"{int(self.success.sum())} of {self.runner.count}",
            "episodes ended": f"{self.finished:,}",
            "solved at their end": f"{self.solved / finished:.0%}" if self.finished else "–",
            "mean return": f"{self.return_sum / finished:.1f}" if self.finished else "–",
        }
