"""Randomisation: what differs from episode to episode beside starts and goals.

Every body has a mass, friction, restitution and size of its own in each episode, drawn evenly from
ranges, and so has the noise of the controls. Draws are counters hashed, as starts are: a world's
depend on its seed and episode alone.
"""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from physics import Parameters, Scene, World
from physics.scene.validation import choice, number
from rigid_envs.episodes.draws import normal, uniform

Array = np.ndarray

NOISE = "noise"
# name, unit, and the factor's base: mass and size are factors of the scene's own
NAMES = (*Parameters._fields, NOISE)
FACTORS = ("mass", "size")
# streams of draws: starts have 0, and the noise of step k has NOISE_STREAM + k
_STREAM, _NOISE_STREAM = 1, 2


class Randomization:
    """Ranges and draws of `count` worlds; each world may have ranges of its own.

    Args:
        scene: what is in each world.
        count: of worlds.
        ranges: by name, (low, high) or a number: "mass" and "size" as factors of the scene's,
            "friction" and "restitution" of the bodies' material, and "noise", the standard
            deviation of what is added to each component of an action. What isn't named is as in
            the scene, and no noise.
        sizes: least and largest factor of sizes that the task takes; None if it takes no other.

    Raises:
        TypeError, ValueError: an unknown name, or no such range.
    """

    def __init__(
        self, scene: Scene, count: int, ranges: Any, sizes: tuple[float, float] | None
    ) -> None:
        """Draws nothing yet: all worlds are as in the scene."""
        self._own = Parameters.of(scene)
        self._bodies, self._sizes = len(scene.bodies), sizes
        given = self.check(ranges)
        self.names = tuple(name for name in NAMES if name in given)
        self._default = self._row(given)
        self._ranges = np.tile(self._default, (count, 1, 1))
        own = np.concatenate([*(values[0] for values in self._own), [0.0]])
        self._drawn = np.tile(own, (count, 1))
        self._observed = [
            column for column, (name, _) in enumerate(self._columns()) if name in self.names
        ]

    def _columns(self) -> list[tuple[str, str]]:
        """Name of a parameter, and what it is of, for every column of the draws."""
        bodies = [(name, f"body {i} {name}") for name in NAMES[:-1] for i in range(self._bodies)]
        return [*bodies, (NOISE, "control noise")]

    def check(self, ranges: Any) -> dict[str, tuple[float, float]]:
        """Ranges by name, (low, high) each."""
        if ranges is None:
            return {}
        if not isinstance(ranges, Mapping):
            raise TypeError(f"randomize must be a dict of name: (low, high), got {ranges!r}")
        checked = {}
        for name, value in ranges.items():
            choice("randomize", name, NAMES)
            field = f"randomize[{name!r}]"
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
        """Refuses sizes that the task isn't laid out for."""
        if self._sizes is None:
            raise ValueError(f"{field}: this task is laid out for bodies of one size, leave it out")
        least, most = self._sizes
        if ends[0] < least or ends[1] > most:
            limits = f"within {least:g} and {most:g}" if least > 0.0 else f"at most {most:g}"
            raise ValueError(f"{field} must be {limits} in this task, got {ends}")

    def _row(self, ranges: Mapping[str, tuple[float, float]]) -> Array:
        """[columns, 2] low and high of every draw."""
        ends = []
        for which in (0, 1):
            columns = [
                np.zeros(self._bodies) + ranges[name][which] * (own[0] if name in FACTORS else 1.0)
                if name in ranges
                else own[0]
                for name, own in zip(NAMES[:-1], self._own, strict=True)
            ]
            noise = ranges[NOISE][which] if NOISE in ranges else 0.0
            ends.append(np.concatenate([*columns, [noise]]))
        return np.stack(ends, axis=-1)

    def _split(self, columns: Array) -> dict[str, Array]:
        """[n, bodies] of each parameter, by name, from [n, columns]."""
        parts = np.split(columns[:, :-1], len(NAMES) - 1, axis=1) if self._bodies else []
        return dict(zip(NAMES[:-1], parts, strict=False))

    def needs_varied(self, ranges: Mapping[str, Any]) -> bool:
        """Whether worlds come to differ in more than noise."""
        return any(name != NOISE for name in ranges)

    def check_step(self, world: World, ranges: Mapping[str, tuple[float, float]]) -> None:
        """Refuses ranges that the step of a varied world is too long for."""
        low, high = (self._split(end[None]) for end in np.moveaxis(self._row(ranges), -1, 0))
        world.check_parameters({name: (low[name][0], high[name][0]) for name in low})

    def set_ranges(self, mask: Array, ranges: Mapping[str, tuple[float, float]] | None) -> None:
        """Gives the worlds of a mask other ranges; the first ones if None."""
        self._ranges[mask] = self._default if ranges is None else self._row(ranges)

    def check_observed(self, ranges: Mapping[str, tuple[float, float]]) -> None:
        """Refuses ranges that go beyond the first ones: these bound what is observed."""
        row = self._row(ranges)
        for column in self._observed:
            (low, high), (least, most) = row[column], self._default[column]
            if low < least or high > most:
                name, what = self._columns()[column]
                raise ValueError(
                    f"randomize[{name!r}] in options must stay within the environment's own, which "
                    f"bounds the observation: {what} would be within {low:g} and {high:g}, not "
                    f"{least:g} and {most:g}"
                )

    def draw(self, world: World, mask: Array, seeds: Array, episodes: Array) -> None:
        """Draws for the episodes [chosen] of the worlds of a mask, and writes what is drawn."""
        ranges = self._ranges[mask]
        draws = uniform(seeds, episodes, ranges.shape[1], _STREAM)
        drawn = ranges[..., 0] + (ranges[..., 1] - ranges[..., 0]) * draws
        self._drawn[mask] = np.minimum(drawn, ranges[..., 1])  # which round-off might pass
        if world.features.varied:
            world.set_parameters(**self._split(self._drawn[mask]), worlds=mask)

    @property
    def noisy(self) -> bool:
        """Whether any world's controls have noise."""
        return bool(self._drawn[:, -1].any())

    def disturb(self, actions: Array, seeds: Array, episodes: Array, steps: Array) -> Array:
        """Actions [count, actions] with the noise of each world's step [count]."""
        found = normal(seeds, episodes, actions.shape[1], _NOISE_STREAM + steps)
        return np.clip(actions + self._drawn[:, -1:] * found, -1.0, 1.0)

    @property
    def bounds(self) -> tuple[tuple[str, str, float, float], ...]:
        """Name, unit, low and high of what can be observed, as a task's bounds."""
        columns, found = self._columns(), []
        for column in self._observed:
            name, what = columns[column]
            low, high = (float(end) for end in self._default[column])
            found.append((what, "kg" if name == "mass" else "", low, high))
        return tuple(found)

    @property
    def observed(self) -> Array:
        """[count, n] what was drawn of what `bounds` names."""
        return self._drawn[:, self._observed]

    def get_state(self) -> dict[str, Array]:
        """Ranges and draws of all worlds."""
        return {"ranges": self._ranges.copy(), "drawn": self._drawn.copy()}

    def set_state(self, state: Mapping[str, Array]) -> None:
        """Takes ranges and draws back to what `get_state` gave."""
        self._ranges[:], self._drawn[:] = state["ranges"], state["drawn"]
