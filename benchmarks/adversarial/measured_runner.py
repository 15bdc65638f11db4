"""Episodes with measured work of servos and, if asked for, hostile parameters of bodies.

Masses are 10^-3 to 10^3 times those of the scene, each exponent equally likely, but no lighter than
is accepted: a body is refused that a drive or a heavier body could press through what it lies on.
Friction, restitution and sizes are uniform. The ranges of sizes are the largest that all presets
accept:

- Push: a cube below 0.05 times its size is refused at `fast`, which would let it sink into the
  ground by its own width; above 2.5 the task refuses it, because the cube would touch the finger;
- Stack: sizes that differ by more than a factor of two are refused, because the smaller cube would
  fall between the samples of the larger;
- Throw: the task refuses others, because the fingers hold the ball.
"""

from typing import Any

import numpy as np

from physics.analysis.load_limits import LoadLimits
from rigid_envs import Runner
from rigid_envs.episodes.draws import uniform

Array = np.ndarray

PARAMETERS = ("scene", "random")
SIZES = {"push": (0.05, 2.5), "stack": (0.7, 1.4), "throw": (0.5, 1.75)}
DECADES = 3.0  # of the factor on masses, up and down
_HEAVY = 1e3  # times its mass, of a body that any preset accepts at these sizes
_MASS_STREAM = 1 << 20  # of random numbers; no step of an episode uses it for its noise


class MeasuredRunner(Runner):
    """Episodes of a task.

    Args:
        task: its name.
        preset: name of the fidelity.
        parameters: "scene" for those of the scene, "random" to draw them for each episode.
        count: number of worlds.
        threads: number of threads.
    """

    measures_work = True

    def __init__(self, task: str, preset: str, parameters: str, count: int, threads: int) -> None:
        """Builds the worlds."""
        self._draws_masses = parameters == "random"
        ranges = {"friction": (0.0, 10.0), "restitution": (0.0, 1.0), "size": SIZES[task]}
        ranges["mass"] = (_HEAVY, _HEAVY)
        randomize = ranges if self._draws_masses else None
        super().__init__(task, count, "dense", preset, threads, randomize=randomize)
        self._masses = np.array([body.mass for body in self.world.scene.bodies])
        self._loads = LoadLimits(self.world.scene, self.world.fidelity)

    def reset(
        self, mask: Array, seeds: Array | None = None, options: dict[str, Any] | None = None
    ) -> None:
        """Starts episodes, see `Runner.reset`, with their own masses."""
        super().reset(mask, seeds, options)
        if self._draws_masses and mask.any():
            bodies = len(self._masses)
            draws = uniform(self._seeds[mask], self._episodes[mask], bodies, _MASS_STREAM)
            factors = 10.0 ** (DECADES * (2.0 * draws - 1.0))
            drawn = self.world.parameters.pick(mask)._replace(mass=self._masses * factors)
            while True:  # a body that is made heavier presses harder on the others
                least = self._loads.least_masses(drawn)
                light = (drawn.mass < least * (1.0 - 1e-12)).any(axis=1)
                if not light.any():
                    break
                drawn.mass[light] = np.maximum(drawn.mass, least)[light]
            self.world.set_parameters(mass=drawn.mass, worlds=mask)

    def start_episode(self, seed: int, episode: int) -> None:
        """Starts an episode of a seed in all worlds."""
        everyone = np.ones(self.count, dtype=bool)
        self._seeds[:], self._episodes[:] = seed, episode - 1
        self.reset(everyone)

    @property
    def episodes(self) -> Array:
        """[count] number of each world's episode."""
        return self._episodes

    @property
    def elapsed(self) -> Array:
        """[count] steps since the episode began."""
        return self._elapsed

    def command(self, actions: Array) -> None:
        """Commands the drives without advancing."""
        self._now = self.world.read()
        self.task.act(self.world, self._now, self.check_actions(actions))
