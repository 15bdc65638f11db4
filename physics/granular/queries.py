"""What can be asked of heaps of particle bodies about their contacts."""

import numpy as np

from physics.analysis.contact_queries import ContactQueries
from physics.granular.simulation import GranularSimulation
from physics.model.contacts import ContactTable

Array = np.ndarray


class GranularQueries(ContactQueries):
    """Contacts of heaps of particle bodies, with states that are up to date."""

    _simulation: GranularSimulation

    def table(self, worlds: Array) -> ContactTable:
        """What touches in the worlds [n] of these indices.

        The body with the smaller index is the first of a pair, whatever the order in the heap.
        """
        touching = [self._simulation.touching(int(world)) for world in worlds]
        found = np.concatenate(touching)
        classes = self._simulation.classes()
        ends = np.stack([found["owner"], found["other"]], axis=-1)
        turned = ends[:, 0] > ends[:, 1]
        kinds = np.concatenate([classes[ends], turned[:, None]], axis=1)
        _, example, kind = np.unique(kinds, axis=0, return_index=True, return_inverse=True)
        rows = [self._coefficients(*ends[n].tolist()) for n in example]
        weight, stiffness = (
            np.array([row[name] for row in rows])[kind.ravel()] for name in ("weight", "stiffness")
        )
        sign = np.where(turned, -1.0, 1.0)[:, None]
        return ContactTable(
            world=np.repeat(worlds, [len(rows) for rows in touching]),
            pair=np.sort(ends, axis=1),
            point=found["point"],
            normal=sign * found["normal"],
            penetration=found["penetration"],
            force=sign * found["force"],
            first_touch=np.full(len(found), np.nan),  # not recorded
            weight=weight,
            stiffness=stiffness,
            kind=kind.ravel(),
            coefficients=rows,
        )

    def _coefficients(self, owner: int, other: int) -> dict[str, float]:
        """Of the contacts of a body with another solid, by the names of HALF_PAIR."""
        row = self._simulation.coefficients(owner, other)
        loads = row["owner_shear_load"], row["surface_shear_load"]
        first, second = loads if owner < other else loads[::-1]
        return {
            **row, "owner_shear_load": first, "surface_shear_load": second,
            "pair_mass": 1.0 / row["inverse_mass"], "rolling": 0.0, "spinning": 0.0,
        }  # fmt: skip

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
        found = self._all()
        between = (found.pair == sorted((first, second))).all(axis=1)
        along = between * np.sum(found.force * found.normal, axis=1)
        return np.bincount(found.world, along, self._simulation.count)

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
