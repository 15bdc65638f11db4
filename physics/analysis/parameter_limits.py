"""Per-world parameters that a fidelity's step is too long for are refused before they are used."""

from typing import Any

import numpy as np

from physics.analysis.step_limits import check_range, check_world
from physics.scene.fidelity import Fidelity
from physics.scene.parameters import Parameters
from physics.scene.scene import Scene

Array = np.ndarray


class ParameterLimits:
    """Checks parameters of a scene at a fidelity, and remembers the range that is known as safe."""

    def __init__(self, scene: Scene, fidelity: Fidelity) -> None:
        """Nothing is known yet."""
        self._scene, self._fidelity = scene, fidelity
        self._safe: tuple[Parameters, Parameters] | None = None  # [1, bodies] each

    def check_range(self, low: Parameters, high: Parameters, allow_unstable: bool) -> None:
        """Raises ValueError where the step is too long anywhere in a range [1, bodies]."""
        if not allow_unstable:
            check_range(self._scene, self._fidelity, low, high)
        self._safe = low, high

    def check(self, new: Parameters, worlds: Any) -> None:
        """Raises ValueError where the step is too long for parameters [n, bodies] of worlds [n]."""
        low, high = (
            Parameters(*(end(values, axis=0, keepdims=True) for values in new))
            for end in (np.min, np.max)
        )
        if self._safe is not None:  # and what lies between that range and these
            low = Parameters(*map(np.minimum, low, self._safe[0]))
            high = Parameters(*map(np.maximum, high, self._safe[1]))
            if all(map(np.array_equal, (*low, *high), (*self._safe[0], *self._safe[1]))):
                return
        try:  # all at once; should that fail, it may be for two that never meet
            check_range(self._scene, self._fidelity, low, high)
        except ValueError:
            for i, world in enumerate(worlds.tolist()):
                check_world(self._scene, self._fidelity, new.pick([i]), world)
        else:
            self._safe = low, high
