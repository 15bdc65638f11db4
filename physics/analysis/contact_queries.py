"""What can be asked of contacts: readings of a table of what touches.

Their energy: a sample with the weight w that penetrates by d has the spring force w k d, and so the
energy w k d^2/2. Damping multiplies this force and stores nothing. The impulse law has such springs
where solids overlap, too: the soft contacts of `impulse.sweep`. But an instantaneous collision may
leave an overlap that it did not pay for, and the speed at which overlaps are pushed apart is
limited, so their sum is what such a world has only while it is at rest.

Springs of friction are not counted. Their force is what friction remembers: where a contact slides
it follows from the speed, not from a shear (see `spring.coulomb`), so it has no potential. A hand
that lands at 1 m/s charges them to the friction cone within two steps, with more energy than
friction has taken until then; the steps that follow do not return it. So a balance of energy
without them is too low where a contact sticks, and right again when it is released.

The energy of a world with contacts is exact between steps in the limit of short steps only. Kicks
and drifts take turns, so in a harmonic contact kinetic and elastic energy at the same time are not
constant in sum: it swings by a fraction (omega h)^2/4 of the elastic energy, 1/16 at a contact
resolution of 0.5. The sum is least at first contact and does not exceed that before it, see the
mean over the drift in `spring.hunt_crossley`.
"""

from abc import ABC, abstractmethod

import numpy as np

from physics.analysis.contact_system import ContactSystem
from physics.model.contacts import Contacts, ContactTable
from physics.step.simulation import Simulation

Array = np.ndarray


class ContactQueries(ABC):
    """Contacts of worlds whose states are up to date.

    Args:
        simulation: of the worlds.
    """

    def __init__(self, simulation: Simulation) -> None:
        self._simulation = simulation

    @abstractmethod
    def table(self, worlds: Array) -> ContactTable:
        """What touches in the worlds [n] of these indices."""

    @abstractmethod
    def samples(self, solid: int) -> tuple[Array, float | Array]:
        """Points with which a solid touches others, see `World.samples`."""

    @abstractmethod
    def can_touch(self, first: int, second: int) -> bool:
        """Whether two solids can touch."""

    @abstractmethod
    def normal_force(self, first: int, second: int) -> Array:
        """[count] N between two solids in the last step."""

    @abstractmethod
    def first_touch(self, first: int, second: int) -> Array:
        """[count] s, when two solids first touched; NaN before."""

    @abstractmethod
    def first_touch_position(self, first: int, second: int) -> Array:
        """[count, 3] m, position of the first of two solids then."""

    def contacts(self, world: int, names: tuple[str, ...]) -> Contacts:
        """The touching points of one world, whose solids have these names."""
        found = self.table(np.array([world]))
        return Contacts(
            pair=found.pair,
            names=tuple((names[first], names[second]) for first, second in found.pair),
            point=found.point,
            normal=found.normal,
            penetration=found.penetration,
            force=found.force,
            first_touch=found.first_touch,
        )

    def penetration(self) -> Array:
        """[count] m, deepest penetration now; 0 where nothing touches."""
        found, deepest = self._all(), np.zeros(self._simulation.count)
        np.maximum.at(deepest, found.world, found.penetration)
        return deepest

    def elastic_energy(self) -> Array:
        """[count] J stored in the springs of contacts now, see `World.elastic_energy`."""
        found = self._all()
        depth = np.maximum(found.penetration, 0.0)
        stored = 0.5 * found.weight * found.stiffness * depth * depth
        return np.bincount(found.world, stored, self._simulation.count)

    def _all(self) -> ContactTable:
        return self.table(np.arange(self._simulation.count))

    def largest_stable_step(self, world: int) -> float:
        """Largest stable step in s with a world's present contacts; inf if nothing limits it."""
        simulation = self._simulation
        features = simulation.needed
        # with impulses contacts limit nothing, servos do
        found = ContactTable.empty() if features.impulse else self.table(np.array([world]))
        kinds, kind = np.unique(found.kind, return_inverse=True)
        return ContactSystem(
            simulation.state.dynamic[world], simulation.model.of_world(world).dynamic, found.pair,
            found.point, found.normal, found.weight, [found.coefficients[n] for n in kinds], kind,
            features.dashpot, features.viscous,
        ).largest_stable_step()  # fmt: skip
