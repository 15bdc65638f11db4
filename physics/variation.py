"""Worlds that differ: masses, friction, restitution and sizes of their own."""

from collections.abc import Mapping
from typing import Any

import numpy as np

from physics.analysis.step_limits import check_range, check_world
from physics.model.build import vary
from physics.model.features import Features
from physics.model.pairs import Layout
from physics.model.tables import Model
from physics.readings import Readings
from physics.rotation import rotate, rotate_back
from physics.scene.fidelity import Fidelity
from physics.scene.parameters import Parameters, check_ranges, check_values
from physics.scene.scene import Scene

Array = np.ndarray


class Variation(Readings):
    """The half of a World that holds its parameters; a World makes all that is named here."""

    scene: Scene
    fidelity: Fidelity
    _model: Model
    _features: Features
    _layout: Layout | None
    _parameters: Parameters  # [count, bodies]; of worlds that are alike [1, bodies]
    _checked: tuple[Parameters, Parameters] | None  # [1, bodies] each: a range that is safe
    _everyone: Array
    _allow_unstable: bool

    def _mask(self, worlds: Any) -> Array:
        """A mask [count] of the worlds that are meant."""
        raise NotImplementedError

    def _forget(self, worlds: Array) -> None:
        """Clears what is hidden."""
        raise NotImplementedError

    @property
    def parameters(self) -> Parameters:
        """A copy of the bodies' parameters, [count, bodies] each."""
        shape = (self.count, self._bodies)
        return Parameters(*(np.broadcast_to(values, shape).copy() for values in self._parameters))

    def check_parameters(self, ranges: Mapping[str, Any]) -> None:
        """Refuses ranges that hold parameters which the step is too long for.

        The ends of the ranges are looked at: all bodies at one, and each in turn at the other.
        What `set_parameters` writes within ranges that were checked needs no check of its own.

        Args:
            ranges: low and high of "mass", "friction", "restitution" or "size": numbers, or
                [bodies] each. What isn't named is as in the scene.

        Raises:
            TypeError, ValueError: no such parameter, or no such range; a range that is unstable or
                lets a body sink, with what binds and the largest safe step.
        """
        low, high = check_ranges(ranges, Parameters.of(self.scene))
        if not self._allow_unstable:
            check_range(self.scene, self.fidelity, low, high)
        self._checked = low, high

    def set_parameters(
        self,
        *,
        mass: Any = None,
        friction: Any = None,
        restitution: Any = None,
        size: Any = None,
        worlds: Any = None,
    ) -> None:
        """Gives the chosen worlds parameters of their own, and clears what is hidden in them.

        Positions and velocities stay; `reset` and `set_state` then start from the new parameters
        to the last bit. `reset` keeps parameters, `snapshot` holds them.

        Args:
            mass: kg, [chosen, bodies] or what broadcasts to it, as the others.
            friction: of the bodies' material.
            restitution: of the bodies' material, 0 to 1.
            size: factor of every length of a body's shape, 1 as in the scene. A body keeps the
                samples that it has there, so sizes can't be worlds apart.
            worlds: mask [count] of the chosen worlds; all if None.

        Raises:
            ValueError: the World isn't `varied`; a wrong shape, a value out of its limits, or one
                that the step is too long for. The parameters are then as they were.
        """
        if self._layout is None:
            raise ValueError(
                "set_parameters needs worlds that may differ: build the World with varied=True"
            )
        mask = self._mask(worlds)
        chosen = np.flatnonzero(mask)
        given = {"mass": mass, "friction": friction, "restitution": restitution, "size": size}
        values = check_values(given, chosen, self._bodies)
        if not values or not len(chosen):
            return
        before = self._parameters.pick(mask)
        new = before._replace(**values)
        if not self._allow_unstable:
            self._check_new(new, chosen)
        rows = self._state.mover[mask, : self._bodies]  # a copy
        momentum, turning, orientation = (
            rows[name] for name in ("momentum", "angular_momentum", "orientation")
        )
        velocity = momentum * self._of_bodies("inverse_mass", chosen)[..., None]
        spin = self._spin(self._of_bodies("inverse_inertia", chosen), orientation, turning)
        self._write_parameters(mask, new)
        # velocities stay; where nothing bears on them their momenta do, to the last bit
        heavier = (new.mass != before.mass)[..., None]
        other = heavier | (new.size != before.size)[..., None]
        kept = velocity / self._of_bodies("inverse_mass", chosen)[..., None]
        rows["momentum"] = np.where(heavier, kept, momentum)
        kept = spin_momentum(self._of_bodies("inertia", chosen), orientation, spin)
        rows["angular_momentum"] = np.where(other, kept, turning)
        self._state.mover[mask, : self._bodies] = rows
        self._forget(mask)

    def _check_new(self, new: Parameters, worlds: Array) -> None:
        """Refuses parameters [n, bodies] of the worlds [n] that the step is too long for."""
        low, high = (
            Parameters(*(end(values, axis=0, keepdims=True) for values in new))
            for end in (np.min, np.max)
        )
        if self._checked is not None:  # and what lies between that range and these
            low = Parameters(*map(np.minimum, low, self._checked[0]))
            high = Parameters(*map(np.maximum, high, self._checked[1]))
            if all(map(np.array_equal, (*low, *high), (*self._checked[0], *self._checked[1]))):
                return
        try:  # all at once; should that fail, it may be for two that never meet
            check_range(self.scene, self.fidelity, low, high)
        except ValueError:
            for i, world in enumerate(worlds.tolist()):
                check_world(self.scene, self.fidelity, new.pick([i]), world)
        else:
            self._checked = low, high

    def _write_parameters(self, mask: Array, new: Parameters) -> None:
        """Writes parameters [n, bodies] of the worlds of a mask, and what follows from them."""
        assert self._layout is not None
        for mine, values in zip(self._parameters, new, strict=True):
            mine[mask] = values
        vary(self._model, self._layout, np.flatnonzero(mask), new)


def spin_momentum(inertia: Array, orientation: Array, spin: Array) -> Array:
    """L = R J0 R^T omega, [..., 3], of principal moments [..., 3]."""
    return rotate(orientation, inertia * rotate_back(orientation, spin))
