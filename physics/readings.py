"""What a World can be asked: its state, energies, contacts and limits."""

import math
from typing import Any

import numpy as np

from physics.analysis import energies, field_limits, joints, readouts
from physics.analysis.failures import failure
from physics.analysis.lane_queries import LaneQueries
from physics.analysis.solids import Solids
from physics.granular.queries import GranularQueries
from physics.manybody.queries import CrowdQueries
from physics.model.contacts import Contacts
from physics.model.features import Features
from physics.scene.fidelity import Fidelity
from physics.scene.scene import Scene
from physics.scene.validation import array, integer, text
from physics.step.readout import Readout
from physics.step.simulation import Simulation, read_only

Array = np.ndarray


class Readings:
    """The part of `World` that only reads.

    Attributes:
        scene: what is in each world.
        fidelity: of the simulation.
        count: number of worlds.
    """

    scene: Scene
    fidelity: Fidelity
    count: int
    _simulation: Simulation
    _queries: LaneQueries | CrowdQueries | GranularQueries
    _solids: Solids

    def _refresh(self) -> None:
        """Computes candidates and forces of a state that was set from outside."""
        if not self._simulation.refresh():
            raise failure(self._simulation)

    @property
    def features(self) -> Features:
        """What this scene needs. A special kernel has just this, a general one more."""
        return self._simulation.needed

    @property
    def kernel(self) -> str:
        """Which kernel advances the worlds: "special" or "general", see `World`."""
        simulation = self._simulation
        needed = simulation.needed._replace(wrench=simulation.features.wrench)
        return "special" if simulation.features == needed else "general"

    @property
    def time(self) -> Array:
        """[count] s: a read-only view of the state; copy it to keep it."""
        return read_only(self._simulation.state.world["time"])

    @property
    def steps(self) -> Array:
        """[count] steps that the adaptive integrator took since the state was set: read-only.

        Tries that it rejected don't count.

        Raises:
            ValueError: another integrator, whose steps are equal: `advance(time)` takes as few as
                are no longer than `Fidelity.substep`.
        """
        if self.fidelity.integrator != "adaptive":
            raise ValueError(
                'steps are counted with Fidelity(integrator="adaptive"); '
                f"{self.fidelity.integrator!r} takes equal steps of at most Fidelity.substep"
            )
        return read_only(self._simulation.state.pace["accepted"])

    @property
    def position(self) -> Array:
        """[count, bodies, 3] m, centres of mass: a read-only view of the state."""
        return read_only(self._simulation.state.dynamic["position"][:, : self._simulation.bodies])

    @property
    def orientation(self) -> Array:
        """[count, bodies, 4] unit quaternions x y z w, w >= 0: a read-only view of the state."""
        return read_only(
            self._simulation.state.dynamic["orientation"][:, : self._simulation.bodies]
        )

    @property
    def linear_velocity(self) -> Array:
        """[count, bodies, 3] m/s, world frame."""
        momentum = self._simulation.state.dynamic["momentum"][:, : self._simulation.bodies]
        return read_only(momentum * self._simulation.of_bodies("inverse_mass")[..., None])

    @property
    def angular_velocity(self) -> Array:
        """[count, bodies, 3] rad/s, world frame."""
        return read_only(self._simulation.angular_velocity())

    @property
    def drive_position(self) -> Array:
        """[count, drives, 3] m: a read-only view of the state."""
        return read_only(self._simulation.state.dynamic["position"][:, self._simulation.bodies :])

    @property
    def drive_velocity(self) -> Array:
        """[count, drives, 3] m/s, world frame."""
        bodies = self._simulation.bodies
        inverse = self._simulation.base.dynamic["inverse_mass"][bodies:]
        momentum = self._simulation.state.dynamic["momentum"][:, bodies:]
        return read_only(momentum * inverse[:, None])

    @property
    def drive_reference(self) -> Array:
        """[count, drives, 3] m, set points of the servos: a read-only view of the state."""
        return read_only(self._simulation.state.dynamic["reference"][:, self._simulation.bodies :])

    def read(self) -> Readout:
        """All poses and velocities and the drives' set points now; drives after the bodies.

        Read-only, and not changed by later steps.
        """
        return self._simulation.readout()

    def force(self) -> Array:
        """[count, bodies, 3] N, net force on each body now: weight, fields, contacts, wrenches."""
        self._refresh()
        return readouts.force(self._simulation)

    def torque(self) -> Array:
        """[count, bodies, 3] N m, net torque on each body about its centre now, world frame."""
        self._refresh()
        return readouts.torque(self._simulation)

    @property
    def linear_acceleration(self) -> Array:
        """[count, bodies, 3] m/s^2 of the centres of mass now, world frame."""
        self._refresh()
        return readouts.linear_acceleration(self._simulation)

    @property
    def angular_acceleration(self) -> Array:
        """[count, bodies, 3] rad/s^2 now, world frame."""
        self._refresh()
        return readouts.angular_acceleration(self._simulation)

    def inertia(self) -> Array:
        """[count, bodies, 3, 3] kg m^2, inertia tensors about the centres in the world frame."""
        return readouts.inertia(self._simulation)

    def inertia_rate(self) -> Array:
        """[count, bodies, 3, 3] kg m^2/s, time derivative of `inertia`."""
        return readouts.inertia_rate(self._simulation)

    def point_velocity(self, body: int | str, point: Any) -> Array:
        """[count, 3] m/s, velocity of a point that is fixed to a body, world frame.

        Args:
            body: index or name.
            point: in the body frame, m, [3] or [count, 3].
        """
        index = self.scene.body_index(body)
        return readouts.point_velocity(
            self._simulation, index, array("point", point, (self.count, 3))
        )

    def point_acceleration(self, body: int | str, point: Any) -> Array:
        """[count, 3] m/s^2, acceleration of a point as of `point_velocity`, world frame."""
        index = self.scene.body_index(body)
        checked = array("point", point, (self.count, 3))
        self._refresh()
        return readouts.point_acceleration(self._simulation, index, checked)

    def joint_position(self) -> Array:
        """[count, joints] rad of hinges, m of sliders, zero in the scene's pose; NaN of others."""
        return joints.positions(self._simulation)

    def joint_velocity(self) -> Array:
        """[count, joints] rad/s of hinges, m/s of sliders; NaN of others."""
        return joints.velocities(self._simulation)

    def joint_error(self) -> Array:
        """[count, joints] the largest violation of each joint's constraints, m or rad."""
        return joints.errors(self._simulation)

    def kinetic_energy(self) -> Array:
        """[count] J of the bodies, translation and rotation."""
        return energies.kinetic_energy(self._simulation)

    def potential_energy(self) -> Array:
        """[count] J of the bodies: gravity, zero at the origin, springs to points and attractors.

        An attractor's energy is zero infinitely far away for an exponent above 1, else at its
        position; for an exponent of 1 it is strength * mass * ln(r / 1 m).
        """
        return energies.potential_energy(self._simulation)

    def elastic_energy(self) -> Array:
        """[count] J stored in the normal springs of contacts now.

        With the impulse law that of overlaps at rest; what an instantaneous collision leaves of an
        overlap has stored nothing.

        Springs of friction are not counted: while a contact slides, their force has no potential.
        """
        self._refresh()
        return self._queries.elastic_energy()

    def drive_energy(self) -> Array:
        """[count, drives] J, kinetic energy of each drive."""
        return energies.drive_energy(self._simulation)

    def drive_work(self) -> Array:
        """[count, drives] J, work of each drive's servo since the state was set or reset.

        The sum over the kicks of the integrator, exact to round-off: energy of bodies, drives and
        contacts rises by no more. A gripper's work is the sum of those of its fingers.

        Raises:
            ValueError: the World was built without `measure_work`.
        """
        return energies.drive_work(self._simulation)

    def linear_momentum(self) -> Array:
        """[count, 3] kg m/s of the bodies."""
        return energies.linear_momentum(self._simulation)

    def angular_momentum(self) -> Array:
        """[count, 3] kg m^2/s of the bodies about the origin."""
        return energies.angular_momentum(self._simulation)

    def penetration(self) -> Array:
        """[count] m, deepest penetration now; 0 where nothing touches."""
        self._refresh()
        return self._queries.penetration()

    def contacts(self, world: int = 0) -> Contacts:
        """What touches what in one world, where and how hard."""
        self._refresh()
        return self._queries.contacts(self._world_index(world), self.scene.solid_names)

    def index(self, name: str) -> int:
        """Index of the solid with this name: bodies, then drives, then statics, in scene order.

        A gripper's fingers are called "name[0]" and "name[1]". A solid without a name of its own is
        called by its kind and index, as "body 0".

        Raises:
            TypeError, ValueError: there is no solid of this name; the message lists them.
        """
        return self._solids.index("name", text("name", name))

    def samples(self, solid: int | str) -> tuple[Array, float | Array]:
        """Points with which a solid touches others: [n, 3] m in its frame, and their radius in m.

        For a Compound whose samples have different radii, their radii [n]. A solid without samples,
        such as the ground, has none.

        Args:
            solid: its index or name, see `index`.
        """
        return self._queries.samples(self._solids.index("solid", solid))

    def first_touch(self, first: int | str, second: int | str) -> Array:
        """[count] s, when two solids first touched since their state was set; NaN before.

        Args:
            first: index or name of a solid, see `index`.
            second: another.
        """
        pair = self._solids.pair(first, second)
        self._refresh()
        return self._queries.first_touch(*pair)

    def first_touch_position(self, first: int | str, second: int | str) -> Array:
        """[count, 3] m, position of a solid when it first touched another; NaN before.

        Args:
            first: index or name of the solid, see `index`.
            second: another solid, with a larger index.
        """
        one, other = self._solids.pair(first, second)
        if one > other:
            raise ValueError(
                f"first must come before second, whose position isn't stored: got {first!r} and "
                f"{second!r}"
            )
        self._refresh()
        return self._queries.first_touch_position(one, other)

    def normal_force(self, first: int | str, second: int | str) -> Array:
        """[count] N, sum of the normal forces between two solids; arguments as `first_touch`."""
        pair = self._solids.pair(first, second)
        self._refresh()
        return self._queries.normal_force(*pair)

    def largest_stable_step(self, world: int = 0) -> float:
        """Largest stable step in s with a world's present contacts; inf if nothing limits it."""
        self._refresh()
        simulation, index = self._simulation, self._world_index(world)
        contacts = self._queries.largest_stable_step(index)
        fields, _ = field_limits.longest_step(
            self.scene, simulation.model.of_world(index), self.fidelity.integrator
        )
        # squared frequencies add at most
        return (
            1.0 / math.sqrt(1.0 / contacts**2 + 1.0 / fields**2) if fields < math.inf else contacts
        )

    @property
    def nbytes(self) -> int:
        """Bytes of state per world, with the model where worlds have their own parameters."""
        own = self._simulation.model.nbytes if self.features.per_world_parameters else 0
        return (self._simulation.state.nbytes + self._simulation.hidden_nbytes + own) // self.count

    def _world_index(self, world: int) -> int:
        index = integer("world", world, low=0)
        if index >= self.count:
            raise ValueError(f"world must be below {self.count}, got {world!r}")
        return index
