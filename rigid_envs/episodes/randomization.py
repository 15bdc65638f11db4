"""Randomisation: parameters of bodies and control noise that are drawn for each episode.

In each episode, every body gets its own mass, friction, restitution and size, drawn uniformly from
ranges, and the world its own standard deviation of control noise. The draws are counter-based, as
those of starts are: they depend only on a world's seed and episode.
"""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from physics import Parameters, Scene, World
from physics.scene.validation import choice, number
from rigid_envs.episodes.draws import normal, uniform

Array = np.ndarray
Ranges = dict[str, tuple[float, float]]

NOISE = "noise"
NAMES = (*Parameters._fields, NOISE)
FACTORS = ("mass", "size")  # given as factors of the values in the scene
# streams of random numbers: starts use 0, and the noise of step k uses _NOISE_STREAM + k
_PARAMETER_STREAM, _NOISE_STREAM = 1, 2


class Randomization:
    """Ranges and drawn values of `count` worlds; each world may have its own ranges.

    Args:
        scene: what each world contains.
        count: number of worlds.
        ranges: (low, high) or a number by name. "mass" and "size" are factors of the values in the
            scene, "friction" and "restitution" are values of the bodies' material, and "noise" is
            the standard deviation of what is added to each component of an action. What `ranges`
            does not name keeps its value from the scene, and there is no noise.
        size_range: smallest and largest factor of sizes that the task supports; None if it supports
            only the sizes of the scene.

    Raises:
        TypeError, ValueError: an unknown name, or an invalid range.
    """

    def __init__(
        self, scene: Scene, count: int, ranges: Any, size_range: tuple[float, float] | None
    ) -> None:
        """Draws nothing yet: all worlds have the values of the scene."""
        self._scene_values = Parameters.of(scene)
        self._bodies, self._size_range = len(scene.bodies), size_range
        checked = self.check(ranges)
        self.names = tuple(name for name in NAMES if name in checked)
        self._default = self._limits(checked)
        self._ranges = np.tile(self._default, (count, 1, 1))
        values = np.concatenate([*(values[0] for values in self._scene_values), [0.0]])
        self._drawn = np.tile(values, (count, 1))
        self.has_noise = False
        self._observed = [
            column for column, (name, _) in enumerate(self._columns()) if name in self.names
        ]

    def _columns(self) -> list[tuple[str, str]]:
        """Name and description of the parameter in each column of the drawn values."""
        bodies = [(name, f"body {i} {name}") for name in NAMES[:-1] for i in range(self._bodies)]
        return [*bodies, (NOISE, "control noise")]

    def check(self, ranges: Any) -> Ranges:
        """Ranges as (low, high) by name.

        Raises:
            TypeError, ValueError: an unknown name, or an invalid range.
        """
        if ranges is None:
            return {}
        if not isinstance(ranges, Mapping):
            raise TypeError(f"randomize must be a dict of name: (low, high), got {ranges!r}")
        checked = {}
        for name, value in ranges.items():
            choice("randomize", name, NAMES)
            field = f"randomize[{name!r}]"
            if name != NOISE and not self._bodies:
                raise ValueError(
                    f"{field}: this task has no bodies, got {value!r}; only {NOISE!r} can be drawn"
                )
            if isinstance(value, Sequence | np.ndarray) and not isinstance(value, str):
                if len(value) != 2:
                    raise ValueError(f"{field} must be (low, high) or a number, got {value!r}")
                ends = number(f"{field} low", value[0]), number(f"{field} high", value[1])
            else:
                ends = (number(field, value),) * 2
            positive = name in FACTORS
            low, high = ends
            if low < 0.0 or (positive and low == 0.0) or (name == "restitution" and high > 1.0):
                wanted = "above 0" if positive else "at least 0"
                wanted += " and at most 1" if name == "restitution" else ""
                raise ValueError(f"{field} must be {wanted}, got {value!r}")
            if low > high:
                raise ValueError(
                    f"{field} must be (low, high) with low at most high, got {value!r}"
                )
            if name == "size":
                self._check_sizes(field, ends)
            checked[name] = (low, high)
        return checked

    def _check_sizes(self, field: str, ends: tuple[float, float]) -> None:
        """Raises ValueError for sizes that the task does not support."""
        if self._size_range is None:
            raise ValueError(f"{field}: this task supports only the sizes of its scene; remove it")
        least, most = self._size_range
        if ends[0] < least or ends[1] > most:
            limits = f"within {least:g} and {most:g}" if least > 0.0 else f"at most {most:g}"
            raise ValueError(f"{field} must be {limits} in this task, got {ends}")

    def _limits(self, ranges: Mapping[str, tuple[float, float]]) -> Array:
        """Low and high [columns, 2] of each column of the drawn values."""
        ends = []
        for which in (0, 1):
            columns = [
                np.zeros(self._bodies)
                + ranges[name][which] * (values[0] if name in FACTORS else 1.0)
                if name in ranges
                else values[0]
                for name, values in zip(NAMES[:-1], self._scene_values, strict=True)
            ]
            noise = ranges[NOISE][which] if NOISE in ranges else 0.0
            ends.append(np.concatenate([*columns, [noise]]))
        return np.stack(ends, axis=-1)

    def _split(self, columns: Array) -> dict[str, Array]:
        """Values [n, bodies] of each parameter by name, from columns [n, columns]."""
        parts = np.split(columns[:, :-1], len(NAMES) - 1, axis=1) if self._bodies else []
        return dict(zip(NAMES[:-1], parts, strict=False))

    def needs_per_world_parameters(self, ranges: Mapping[str, Any]) -> bool:
        """Whether these ranges randomise anything other than the control noise."""
        return any(name != NOISE for name in ranges)

    def check_step(self, world: World, ranges: Mapping[str, tuple[float, float]]) -> None:
        """Raises ValueError for ranges in which the time step would not be stable."""
        low, high = (self._split(end[None]) for end in np.moveaxis(self._limits(ranges), -1, 0))
        try:
            world.check_parameters({name: (low[name][0], high[name][0]) for name in low})
        except ValueError as error:
            raise ValueError(f"randomize={dict(ranges)}: {error}") from None

    def set_ranges(self, mask: Array, ranges: Mapping[str, tuple[float, float]] | None) -> None:
        """Sets the ranges of the worlds of the mask; None restores those of the constructor."""
        self._ranges[mask] = self._default if ranges is None else self._limits(ranges)

    def check_observed(self, ranges: Mapping[str, tuple[float, float]]) -> None:
        """Raises ValueError for ranges outside those of the constructor.

        Those are the bounds of the observation.
        """
        limits = self._limits(ranges)
        for column in self._observed:
            (low, high), (least, most) = limits[column], self._default[column]
            if low < least or high > most:
                name, what = self._columns()[column]
                raise ValueError(
                    f"randomize[{name!r}] in options must stay within the range that the "
                    f"environment was made with, which bounds the observation: {what} is bounded "
                    f"by {least:g} and {most:g}, got {low:g} to {high:g}"
                )

    def draw(self, world: World, mask: Array, seeds: Array, episodes: Array) -> None:
        """Draws values for the worlds of the mask and writes them to `world`.

        Args:
            world: the worlds.
            mask: [count] bool; n of its entries are true.
            seeds: [n] seeds of these worlds.
            episodes: [n] numbers of their episodes.
        """
        ranges = self._ranges[mask]
        draws = uniform(seeds, episodes, ranges.shape[1], _PARAMETER_STREAM)
        drawn = ranges[..., 0] + (ranges[..., 1] - ranges[..., 0]) * draws
        self._drawn[mask] = np.minimum(drawn, ranges[..., 1])  # round-off might exceed it
        self._look_for_noise()
        if world.features.per_world_parameters:
            world.set_parameters(**self._split(self._drawn[mask]), worlds=mask)

    def add_noise(self, actions: Array, seeds: Array, episodes: Array, steps: Array) -> Array:
        """Actions [count, actions] with the noise of each world's step [count]."""
        noise = normal(seeds, episodes, actions.shape[1], _NOISE_STREAM + steps)
        return np.clip(actions + self._drawn[:, -1:] * noise, -1.0, 1.0)

    @property
    def bounds(self) -> tuple[tuple[str, str, float, float], ...]:
        """(name, unit, low, high) of each value that can be observed, as in a task's bounds."""
        columns, found = self._columns(), []
        for column in self._observed:
            name, what = columns[column]
            low, high = (float(end) for end in self._default[column])
            found.append((what, "kg" if name == "mass" else "", low, high))
        return tuple(found)

    @property
    def observed(self) -> Array:
        """Drawn values [count, n] of what `bounds` names."""
        return self._drawn[:, self._observed]

    def get_state(self) -> dict[str, Array]:
        """Ranges and drawn values of all worlds."""
        return {"ranges": self._ranges.copy(), "drawn": self._drawn.copy()}

    def set_state(self, state: Mapping[str, Array]) -> None:
        """Restores ranges and drawn values from `get_state`."""
        self._ranges[:], self._drawn[:] = state["ranges"], state["drawn"]
        self._look_for_noise()

    def _look_for_noise(self) -> None:
        self.has_noise = bool(self._drawn[:, -1].any())
