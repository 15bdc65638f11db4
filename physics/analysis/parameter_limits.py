"""Checks before per-world parameters are used that the scene can be simulated with them."""

from functools import cached_property
from typing import Any

import numpy as np

from physics.analysis.load_limits import LoadLimits
from physics.analysis.step_limits import check_range, check_world
from physics.scene.fidelity import Fidelity
from physics.scene.parameters import Parameters
from physics.scene.scene import Scene

Array = np.ndarray


class ParameterLimits:
    """Checks parameters of a scene at a fidelity and stores the range that is known to be safe."""

    def __init__(self, scene: Scene, fidelity: Fidelity) -> None:
        """Starts without a safe range."""
        self._scene, self._fidelity = scene, fidelity
        self._safe: tuple[Parameters, Parameters] | None = None  # [1, bodies] each

    @cached_property
    def loads(self) -> LoadLimits:
        """The least masses of the bodies."""
        return LoadLimits(self._scene, self._fidelity)

    def check_range(self, low: Parameters, high: Parameters) -> None:
        """Checks a range of parameters and stores it as the safe range.

        Args:
            low: [1, bodies], low ends.
            high: [1, bodies], high ends.

        Raises:
            ValueError: the substep is too long for parameters in the range, or a body too light.
        """
        bodies = len(self._scene.bodies)
        least = np.eye(bodies, dtype=bool)  # each body at its least beside the heaviest others
        mass = np.where(least, low.mass, high.mass)
        size = np.repeat(low.size, bodies, axis=0)
        self.loads.check(Parameters.of(self._scene, bodies)._replace(mass=mass, size=size))
        check_range(self._scene, self._fidelity, low, high)
        self._safe = low, high

    def check(self, new: Parameters, worlds: Any) -> None:
        """Checks new parameters of some worlds.

        Args:
            new: [n, bodies].
            worlds: [n], indices of the worlds.

        Raises:
            ValueError: the substep is too long for the parameters of a world, or a body too light.
        """
        self.loads.check(new, worlds)
        low, high = (
            Parameters(*(end(values, axis=0, keepdims=True) for values in new))
            for end in (np.min, np.max)
        )
        if self._safe is not None:  # extend the safe range to the new parameters
            low = Parameters(*map(np.minimum, low, self._safe[0]))
            high = Parameters(*map(np.maximum, high, self._safe[1]))
            if all(map(np.array_equal, (*low, *high), (*self._safe[0], *self._safe[1]))):
                return
        try:  # the whole range first; it may fail for a combination that no world has
            check_range(self._scene, self._fidelity, low, high)
        except ValueError:
            for i, world in enumerate(worlds.tolist()):
                check_world(self._scene, self._fidelity, new.pick([i]), world)
        else:
            self._safe = low, high
