"""What can be asked of worlds side by side about their contacts."""

import numpy as np

from physics.analysis import diagnostics
from physics.analysis.contact_queries import ContactQueries
from physics.model.contacts import ContactTable
from physics.step.simulation import Simulation

Array = np.ndarray


class LaneQueries(ContactQueries):
    """Contacts of worlds side by side, with states that are up to date."""

    def __init__(self, simulation: Simulation) -> None:
        """`simulation`: of the worlds."""
        super().__init__(simulation)
        self._between: dict[tuple[int, int], Array] = {}

    def table(self, worlds: Array) -> ContactTable:
        """What touches in the worlds [n] of these indices."""
        return diagnostics.table(self._simulation, worlds)

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
