"""What can be read of worlds: poses, velocities, energies, contacts."""

from collections.abc import Callable

import numpy as np

from physics.analysis import diagnostics, stability
from physics.analysis.diagnostics import Contacts
from physics.jit import LANES
from physics.model.features import ISOTROPIC, Features
from physics.model.state import State
from physics.model.tables import Model
from physics.rotation import rotate, rotate_back
from physics.scene.fidelity import Fidelity
from physics.scene.scene import Scene
from physics.scene.validation import integer
from physics.step.readout import Readout

Array = np.ndarray


class Readings:
    """The reading half of a World, which makes all that is named here."""

    scene: Scene
    fidelity: Fidelity
    count: int
    _bodies: int
    _model: Model
    _base: Model
    _features: Features
    _state: State
    _table: Array
    _table_valid: bool
    _lent: bool
    _sides_between: dict[tuple[int, int], Array]
    _readout: Callable[[Model, State, Array], object]

    def _settle(self) -> None:
        """Brings candidates and forces up to a state that was set from outside."""
        raise NotImplementedError

    @property
    def _inverse_mass(self) -> Array:
        """Inverse masses of the bodies, [bodies] or of each world [count, bodies]."""
        return self._of_bodies("inverse_mass", np.arange(self.count))

    def _of_bodies(self, name: str, worlds: Array) -> Array:
        """A field of the model's bodies: [bodies, ...], or [n, bodies, ...] of varied worlds [n].

        Both go with an array [n, bodies, ...].
        """
        rows = self._model.mover[name]
        if self._model.mover.ndim == 1:
            return rows[: self._bodies]
        group, lane = np.divmod(worlds, LANES)
        return rows[group, ..., lane][:, : self._bodies]

    def _read(self, values: Array) -> Array:
        view = values[:]
        view.flags.writeable = False
        return view

    @property
    def features(self) -> Features:
        """What was compiled in for this scene."""
        return self._features

    @property
    def time(self) -> Array:
        """[count] s, read-only."""
        return self._read(self._state.world["time"])

    @property
    def position(self) -> Array:
        """[count, bodies, 3] m, centres of mass: a read-only view that follows the state."""
        return self._read(self._state.mover["position"][:, : self._bodies])

    @property
    def orientation(self) -> Array:
        """[count, bodies, 4] unit quaternions x y z w: a read-only view that follows the state."""
        return self._read(self._state.mover["orientation"][:, : self._bodies])

    @property
    def linear_velocity(self) -> Array:
        """[count, bodies, 3] m/s, world frame."""
        return self._read(
            self._state.mover["momentum"][:, : self._bodies] * self._inverse_mass[..., None]
        )

    @property
    def angular_velocity(self) -> Array:
        """[count, bodies, 3] rad/s, world frame."""
        momentum = self._state.mover["angular_momentum"][:, : self._bodies]
        turn = self._state.mover["orientation"][:, : self._bodies]
        inverse = self._of_bodies("inverse_inertia", np.arange(self.count))
        return self._read(self._spin(inverse, turn, momentum))

    def _spin(self, inverse_inertia: Array, orientation: Array, momentum: Array) -> Array:
        """Angular velocity [..., 3] of an angular momentum."""
        if self._features.rotation == ISOTROPIC:  # the same about every axis: no need to turn
            return np.asarray(inverse_inertia * momentum)
        turned = inverse_inertia * rotate_back(orientation, momentum)
        return np.asarray(rotate(orientation, turned))

    @property
    def drive_position(self) -> Array:
        """[count, tools, 3] m: a read-only view that follows the state."""
        return self._read(self._state.mover["position"][:, self._bodies :])

    @property
    def drive_velocity(self) -> Array:
        """[count, tools, 3] m/s, world frame."""
        inverse = self._base.mover["inverse_mass"][self._bodies :]
        return self._read(self._state.mover["momentum"][:, self._bodies :] * inverse[:, None])

    @property
    def drive_reference(self) -> Array:
        """[count, tools, 3] m, where the servos pull to: a read-only view of the state."""
        return self._read(self._state.mover["reference"][:, self._bodies :])

    def read(self) -> Readout:
        """All poses and velocities as they are now, drives after the bodies: read-only."""
        if not self._table_valid:
            self._table = np.empty_like(self._table) if self._lent else self._table
            self._readout(self._model, self._state, self._table)
            self._table_valid = True
        self._lent = True
        return Readout(self._read(self._table[..., : self.count].transpose(2, 0, 1)))

    def kinetic_energy(self) -> Array:
        """[count] J of the bodies, translation and rotation."""
        momentum = self._state.mover["momentum"][:, : self._bodies]
        inverse = self._inverse_mass
        axes = "wbi,wbi,b->w" if inverse.ndim == 1 else "wbi,wbi,wb->w"
        translation = np.einsum(axes, momentum, momentum, inverse)
        angular = self._state.mover["angular_momentum"][:, : self._bodies]
        rotation = np.einsum("wbi,wbi->w", angular, self.angular_velocity)
        return 0.5 * (translation + rotation)

    def potential_energy(self) -> Array:
        """[count] J of the bodies in the field of gravity, zero at the origin."""
        weight = self._of_bodies("weight", np.arange(self.count))
        axes = "wbi,bi->w" if weight.ndim == 2 else "wbi,wbi->w"
        return -np.einsum(axes, self._state.mover["position"][:, : self._bodies], weight)

    def linear_momentum(self) -> Array:
        """[count, 3] kg m/s of the bodies."""
        return self._state.mover["momentum"][:, : self._bodies].sum(axis=1)

    def angular_momentum(self) -> Array:
        """[count, 3] kg m^2/s of the bodies about the origin."""
        bodies = slice(0, self._bodies)
        orbital = np.cross(
            self._state.mover["position"][:, bodies], self._state.mover["momentum"][:, bodies]
        )
        return (orbital + self._state.mover["angular_momentum"][:, bodies]).sum(axis=1)

    def penetration(self) -> Array:
        """[count] m, deepest overlap now; 0 where nothing touches."""
        self._settle()
        return diagnostics.penetration(self._model, self._features, self._state)

    def contacts(self, world: int = 0) -> Contacts:
        """Who touches what in one world, where and how hard."""
        self._settle()
        return diagnostics.contacts(
            self._model, self._features, self._state, self._world_index(world)
        )

    def samples(self, solid: int) -> tuple[Array, float | Array]:
        """Points with which a solid touches others: [n, 3] m in its frame, and their radius in m.

        Of a Compound whose samples differ in it, their radii [n]. A solid that others only touch
        with theirs, as the ground, has none.

        Args:
            solid: its index, as in `first_touch`.
        """
        return diagnostics.samples(self._base, self._solid("solid", solid))

    def first_touch(self, first: int, second: int) -> Array:
        """[count] s, when two solids first touched since their state was set; NaN before.

        Args:
            first: index of a solid: bodies, then tools, then statics, each in scene order.
            second: another.
        """
        ends = self._pair(first, second)
        self._settle()
        return diagnostics.first_touch(self._state, self._sides_between[ends])

    def first_touch_position(self, first: int, second: int) -> Array:
        """[count, 3] m, where the centre of one of two solids was at their first touch; NaN before.

        Args:
            first: index of the solid whose position is told, as in `first_touch`.
            second: another, that comes after it.
        """
        ends = self._pair(first, second)
        if ends[0] > ends[1]:
            raise ValueError(
                f"first must come before second, whose position isn't kept: got {ends[0]} and "
                f"{ends[1]}"
            )
        self._settle()
        return diagnostics.first_touch_position(self._state, self._sides_between[ends])

    def pressing(self, first: int, second: int) -> Array:
        """[count] N, the sum of the normal forces between two solids, as in `first_touch`."""
        ends = self._pair(first, second)
        self._settle()
        return diagnostics.pressing(self._state, self._sides_between[ends])

    def _solid(self, name: str, value: int) -> int:
        """The index of a solid."""
        index = integer(name, value, low=0)
        last = len(self._base.mover) + len(self._base.static) - 1
        if index > last:
            raise ValueError(
                f"{name} must be the index of a solid, 0 to {last} (bodies, then tools, then "
                f"statics), got {value}"
            )
        return index

    def _pair(self, first: int, second: int) -> tuple[int, int]:
        """Two solids that can meet; the sides between them are then known."""
        if (first, second) in self._sides_between:
            return first, second
        ends = self._solid("first", first), self._solid("second", second)
        sides = np.flatnonzero(diagnostics.between(self._base, *ends))
        if not len(sides):
            raise ValueError(
                f"first and second must be solids that can meet, got {ends[0]} and {ends[1]}: "
                "one solid, two statics, or the fingers of a gripper never do"
            )
        self._sides_between[ends] = sides
        return ends

    def largest_stable_step(self, world: int = 0) -> float:
        """Largest stable step in s with the contacts that a world has now; inf without any."""
        self._settle()
        return stability.of_contacts(
            self._model, self._features, self._state, self._world_index(world)
        )

    @property
    def nbytes(self) -> int:
        """Bytes of state a world, beyond the shared model; of varied worlds with their own."""
        own = self._model.nbytes if self._features.varied else 0
        return (self._state.nbytes + own) // self.count

    def _world_index(self, world: int) -> int:
        index = integer("world", world, low=0)
        if index >= self.count:
            raise ValueError(f"world must be below {self.count}, got {world!r}")
        return index
