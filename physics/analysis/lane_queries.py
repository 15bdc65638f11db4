"""What can be asked of worlds side by side about their contacts."""

import numpy as np

from physics.analysis import diagnostics, stability
from physics.analysis.contact_energy import elastic_energy
from physics.analysis.diagnostics import Contacts
from physics.step.simulation import Simulation

Array = np.ndarray


class LaneQueries:
    """Contacts of worlds side by side, with states that are up to date."""

    def __init__(self, simulation: Simulation) -> None:
        """`simulation`: of the worlds."""
        self._simulation = simulation
        self._between: dict[tuple[int, int], Array] = {}

    def penetration(self) -> Array:
        """[count] m, deepest penetration now; 0 where nothing touches."""
        simulation = self._simulation
        return diagnostics.penetration(simulation.model, simulation.features, simulation.state)

    def elastic_energy(self) -> Array:
        """[count] J stored in the springs of contacts now."""
        return elastic_energy(self._simulation)

    def contacts(self, world: int, names: tuple[str, ...]) -> Contacts:
        """The touching points of one world, whose solids have these names."""
        simulation = self._simulation
        return diagnostics.contacts(
            simulation.model, simulation.features, simulation.state, world, names
        )

    def samples(self, solid: int) -> tuple[Array, float | Array]:
        """Points with which a solid touches others, see `World.samples`."""
        return diagnostics.samples(self._simulation.base, solid)

    def _half_pairs(self, first: int, second: int) -> Array:
        """Half-pairs [n] between two solids."""
        found = self._between.get((first, second))
        if found is None:
            found = np.flatnonzero(diagnostics.between(self._simulation.base, first, second))
            self._between[first, second] = found
        return found

    def can_touch(self, first: int, second: int) -> bool:
        """Whether there are half-pairs between two solids."""
        return len(self._half_pairs(first, second)) > 0

    def normal_force(self, first: int, second: int) -> Array:
        """[count] N between two solids in the last step."""
        return diagnostics.normal_force(self._simulation.state, self._half_pairs(first, second))

    def first_touch(self, first: int, second: int) -> Array:
        """[count] s, when two solids first touched since their state was set; NaN before."""
        return diagnostics.first_touch(self._simulation.state, self._half_pairs(first, second))

    def first_touch_position(self, first: int, second: int) -> Array:
        """[count, 3] m, position of the first of two solids then."""
        half_pairs = self._half_pairs(first, second)
        return diagnostics.first_touch_position(self._simulation.state, half_pairs)

    def largest_stable_step(self, world: int) -> float:
        """Largest stable step in s with a world's present contacts; inf if nothing limits it."""
        simulation = self._simulation
        return stability.of_contacts(simulation.model, simulation.features, simulation.state, world)
