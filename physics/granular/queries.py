"""What can be asked of heaps of particle bodies about their contacts."""

import math

import numpy as np

from physics.analysis.contact_system import ContactSystem
from physics.granular.simulation import GranularSimulation
from physics.model.contacts import Contacts

Array = np.ndarray


class GranularQueries:
    """Contacts of heaps of particle bodies, with states that are up to date."""

    def __init__(self, simulation: GranularSimulation) -> None:
        """`simulation`: of the worlds."""
        self._simulation = simulation

    def penetration(self) -> Array:
        """[count] m, deepest penetration now; 0 where nothing touches."""
        return self._simulation.penetration()

    def elastic_energy(self) -> Array:
        """Not computed here.

        Raises:
            ValueError: always.
        """
        raise ValueError(
            "elastic_energy is computed in worlds side by side only, got a world of "
            f"{self._simulation.bodies} bodies"
        )

    def contacts(self, world: int, names: tuple[str, ...]) -> Contacts:
        """The touching points of one world, whose solids have these names."""
        return self._simulation.contacts(world)

    def samples(self, solid: int) -> tuple[Array, float | Array]:
        """The balls of a body, see `World.samples`; none of a static."""
        body, points = self._simulation.particles
        own = points[body == solid]
        return own[:, :3].copy(), (float(own[0, 3]) if len(own) else 0.0)

    def can_touch(self, first: int, second: int) -> bool:
        """Whether two solids can touch: not a solid and itself, nor two statics."""
        return first != second and min(first, second) < self._simulation.bodies

    def normal_force(self, first: int, second: int) -> Array:
        """[count] N between two solids now."""
        forces = []
        for world in range(self._simulation.count):
            found = self._simulation.contacts(world)
            ends = np.sort(found.pair, axis=1)
            between = (ends == sorted((first, second))).all(axis=1)
            forces.append(np.sum(found.force * found.normal, axis=1)[between].sum())
        return np.array(forces)

    def first_touch(self, first: int, second: int) -> Array:
        """Not recorded here.

        Raises:
            ValueError: always.
        """
        raise self._not_recorded("first_touch")

    def first_touch_position(self, first: int, second: int) -> Array:
        """Not recorded here.

        Raises:
            ValueError: always.
        """
        raise self._not_recorded("first_touch_position")

    def _not_recorded(self, name: str) -> ValueError:
        return ValueError(
            f"{name} is not recorded in a heap of {self._simulation.bodies} bodies of particles; "
            "World.contacts has the points of all contacts"
        )

    def largest_stable_step(self, world: int) -> float:
        """Largest stable step in s with a world's present contacts; inf if nothing limits it."""
        simulation, found = self._simulation, self._simulation.contacts(world)
        if not len(found.pair):
            return math.inf
        classes = simulation.classes()[found.pair]
        _, example, kind = np.unique(classes, axis=0, return_index=True, return_inverse=True)
        rows = []
        for n in example.tolist():
            row = simulation.coefficients(int(found.pair[n, 0]), int(found.pair[n, 1]))
            rows.append({**row, "pair_mass": 1.0 / row["inverse_mass"]})
        weights = np.array([row["weight"] for row in rows])[kind.ravel()]
        return ContactSystem(
            simulation.state.dynamic[world], simulation.base.dynamic, found.pair, found.point,
            found.normal, weights, [{**row, "rolling": 0.0, "spinning": 0.0} for row in rows],
            kind.ravel(), True, simulation.fidelity.friction == "viscous",
        ).largest_stable_step()  # fmt: skip
