"""Parameters: mass, friction, restitution and size of the bodies, for each world."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np

from physics.scene.parameter_ranges import RANGES
from physics.scene.scene import Scene
from physics.scene.validation import array, choice

Array = np.ndarray


class Parameters(NamedTuple):
    """The quantities that can differ between worlds of one scene.

    Attributes:
        mass: [n, bodies] kg, above 0.
        friction: [n, bodies], friction coefficient of the body's material, at least 0.
        restitution: [n, bodies], of the body's material, 0 to 1.
        size: [n, bodies], factor of every length of the body's shape, above 0; 1 is the shape in
            the scene.
    """

    mass: Array
    friction: Array
    restitution: Array
    size: Array

    @classmethod
    def of(cls, scene: Scene, count: int = 1) -> "Parameters":
        """The values of the scene, repeated for `count` worlds."""
        bodies = scene.bodies
        rows = (
            [b.mass for b in bodies],
            [b.material.friction for b in bodies],
            [b.material.restitution for b in bodies],
            [1.0 for _ in bodies],
        )
        return cls(*(np.tile(np.array(row, dtype=float), (count, 1)) for row in rows))

    def pick(self, worlds: Any) -> "Parameters":
        """The parameters of some worlds, selected by a mask, indices or a slice."""
        return Parameters(*(values[worlds] for values in self))


def check_values(given: Mapping[str, Any], worlds: Array, bodies: int) -> dict[str, Array]:
    """Checks new parameter values.

    Args:
        given: values by parameter name, broadcast to [n, bodies]; None for a parameter that keeps
            its values.
        worlds: [n] indices of the worlds that get the values; error messages name the world.
        bodies: number of bodies in each world.

    Returns:
        Arrays [n, bodies] by name, of the parameters that are not None.

    Raises:
        ValueError: values of another shape, not finite or out of range.
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
    """Checks ranges of parameters.

    Args:
        ranges: pairs (low, high) by parameter name; each end is broadcast to [1, bodies].
        own: [1, bodies], used as both ends of the parameters that `ranges` does not name.

    Returns:
        Low ends and high ends, [1, bodies] each.

    Raises:
        TypeError, ValueError: an unknown name; not a pair; an end out of range; low above high.
    """
    if not isinstance(ranges, Mapping):
        raise TypeError(f"ranges must be a dict of name: (low, high), got {ranges!r}")
    ends: list[dict[str, Array]] = [{}, {}]
    for name, pair in ranges.items():
        choice("ranges", name, RANGES)
        if not isinstance(pair, Sequence | np.ndarray) or isinstance(pair, str) or len(pair) != 2:
            raise TypeError(f"ranges[{name!r}] must be a pair (low, high), got {pair!r}")
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
    """Raises ValueError if one of the values [n, bodies] is out of the parameter's range.

    The message names the world if the indices [n] of the worlds are given.
    """
    wrong = RANGES[name].excludes(values)
    if wrong.any():
        row, body = (int(i) for i in np.argwhere(wrong)[0])
        where = f"body {body}" if worlds is None else f"body {body} of world {int(worlds[row])}"
        raise ValueError(f"{field} must be {RANGES[name]}, got {values[row, body]:g} for {where}")


def with_parameters(scene: Scene, p: Parameters) -> Scene:
    """A copy of the scene whose bodies have the parameters [1, bodies]."""
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
