"""Parameters: mass, friction, restitution and size of the bodies, by world."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np

from physics.scene.parameter_ranges import RANGES
from physics.scene.scene import Scene
from physics.scene.validation import array, choice

Array = np.ndarray


class Parameters(NamedTuple):
    """What worlds of one scene may differ in, [n, bodies] each.

    Attributes:
        mass: kg.
        friction: of the body's material, at least 0.
        restitution: of the body's material, 0 to 1.
        size: factor of every length of the body's shape; 1 is the shape of the scene.
    """

    mass: Array
    friction: Array
    restitution: Array
    size: Array

    @classmethod
    def of(cls, scene: Scene, count: int = 1) -> "Parameters":
        """The scene's own, for `count` worlds."""
        bodies = scene.bodies
        rows = (
            [b.mass for b in bodies],
            [b.material.friction for b in bodies],
            [b.material.restitution for b in bodies],
            [1.0 for _ in bodies],
        )
        return cls(*(np.tile(np.array(row, dtype=float), (count, 1)) for row in rows))

    def pick(self, worlds: Any) -> "Parameters":
        """Those of the chosen worlds: a mask, indices or a slice."""
        return Parameters(*(values[worlds] for values in self))


def check_values(given: Mapping[str, Any], worlds: Array, bodies: int) -> dict[str, Array]:
    """Values [n, bodies] of the parameters that are given.

    Args:
        given: by name; None where one isn't given.
        worlds: [n] indices of the worlds that they are for.
        bodies: in each.

    Raises:
        ValueError: numbers of another shape, or one that is not finite or out of its limits.
    """
    checked = {}
    for name, value in given.items():
        if value is None:
            continue
        values = array(name, value, (len(worlds), bodies))
        _check_limits(name, name, values, worlds)
        checked[name] = values
    return checked


def check_ranges(ranges: Mapping[str, Any], own: Parameters) -> tuple[Parameters, Parameters]:
    """Low and high ends [1, bodies] of ranges by name; what isn't named is `own` [1, bodies].

    Raises:
        TypeError, ValueError: no such name, no two ends, ends out of their limits or in the wrong
            order.
    """
    if not isinstance(ranges, Mapping):
        raise TypeError(f"ranges must be a dict of name: (low, high), got {ranges!r}")
    ends: list[dict[str, Array]] = [{}, {}]
    for name, pair in ranges.items():
        choice("ranges", name, RANGES)
        if not isinstance(pair, Sequence | np.ndarray) or isinstance(pair, str) or len(pair) != 2:
            raise TypeError(f"ranges[{name!r}] must be two ends (low, high), got {pair!r}")
        for which, end, value in zip(("low", "high"), ends, pair, strict=True):
            values = array(f"ranges[{name!r}] {which}", value, own.mass.shape)
            _check_limits(f"ranges[{name!r}] {which}", name, values)
            end[name] = values
        wrong = ends[0][name] > ends[1][name]
        if wrong.any():
            body = int(np.argmax(wrong[0]))
            raise ValueError(
                f"ranges[{name!r}] must be (low, high) with low at most high, got "
                f"({ends[0][name][0, body]:g}, {ends[1][name][0, body]:g}) of body {body}"
            )
    return own._replace(**ends[0]), own._replace(**ends[1])


def _check_limits(field: str, name: str, values: Array, worlds: Array | None = None) -> None:
    """Refuses values [n, bodies], of the worlds [n] if any, out of a parameter's limits."""
    wrong = RANGES[name].excludes(values)
    if wrong.any():
        row, body = (int(i) for i in np.argwhere(wrong)[0])
        where = f"body {body}" if worlds is None else f"body {body} of world {int(worlds[row])}"
        raise ValueError(f"{field} must be {RANGES[name]}, got {values[row, body]:g} for {where}")


def with_parameters(scene: Scene, p: Parameters) -> Scene:
    """The scene with parameters [1, bodies] built in."""
    bodies = []
    for i, body in enumerate(scene.bodies):
        size = float(p.size[0, i])
        material = replace(
            body.material,
            friction=float(p.friction[0, i]),
            restitution=float(p.restitution[0, i]),
        )
        shape = body.shape if size == 1.0 else body.shape.scaled(size)
        mass = float(p.mass[0, i])
        bodies.append(replace(body, shape=shape, mass=mass, density=None, material=material))
    return replace(scene, bodies=tuple(bodies))
