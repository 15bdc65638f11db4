"""What can be asked of worlds of many bodies about their contacts."""

import math
from typing import Any

import numpy as np

from physics.analysis.contact_queries import ContactQueries
from physics.analysis.diagnostics import samples
from physics.compiler.jit import LANES, aligned_zeros
from physics.manybody.reports import TOUCH, ReportArrays, make_touching
from physics.manybody.simulation import CrowdSimulation
from physics.model.contacts import ContactTable
from physics.model.impulse_rows import CONTACT_ROW
from physics.spring.contact_loop import REPORT

Array = np.ndarray


# columns of TOUCH that a table of contacts has too
_SAME = ("point", "normal", "penetration", "force", "first_touch", "weight")


class CrowdQueries(ContactQueries):
    """Contacts of worlds of many bodies, with states that are up to date."""

    _simulation: CrowdSimulation

    def _solid(self, places: Array) -> Array:
        """Indices of solids: bodies, drives, then statics."""
        body = self._simulation.mechanisms.body
        beyond = len(body) - len(self._simulation.mechanisms.place)
        return np.where(places < len(body), body[np.minimum(places, len(body) - 1)],
                        places - beyond)  # fmt: skip

    def _touching(self, world: int) -> Array:
        """Rows of TOUCH of a world."""
        simulation = self._simulation
        simulation.place(world)
        crowd, pairs = simulation.arrays(world)
        slots = int(simulation.kinds.pair_kind["slot_count"].max(initial=0))
        if simulation.state.world["diverged"][world]:
            return np.zeros(0, TOUCH)
        arrays = ReportArrays(
            rows=aligned_zeros(slots, REPORT),
            points=aligned_zeros(slots, CONTACT_ROW),
            found=np.zeros(8 * simulation.bodies, TOUCH),
        )
        state = simulation.state._replace(world=simulation.state.world[world : world + 1])
        while True:
            count = make_touching(simulation.features)(
                simulation.kinds.model, state, simulation.working_memory(), crowd, pairs, arrays
            )
            if count <= len(arrays.found):
                return arrays.found[:count]
            arrays = arrays._replace(found=np.zeros(count, TOUCH))

    def table(self, worlds: Array) -> ContactTable:
        """What touches in the worlds [n] of these indices."""
        touching = [self._touching(int(world)) for world in worlds]
        found = np.concatenate(touching)
        rows = self._simulation.kinds.model.half_pair
        return ContactTable(
            world=np.repeat(worlds, [len(rows) for rows in touching]),
            pair=self._solid(np.stack([found["owner"], found["surface"]], axis=-1)),
            **{name: found[name] for name in _SAME},
            stiffness=rows["stiffness"][found["half_pair"]],
            kind=found["half_pair"],
            coefficients=rows,
        )

    def samples(self, solid: int) -> tuple[Array, float | Array]:
        """Points with which a solid touches others, see `World.samples`."""
        kinds = self._simulation.kinds
        kind = kinds.of_solid[solid]
        for other in np.flatnonzero(kinds.pair[kind] >= 0):
            row = kinds.pair_kind[kinds.pair[kind, other]]
            first, last = row["first_half_pair"], row["first_half_pair"] + row["half_pair_count"]
            model = kinds.model._replace(half_pair=kinds.model.half_pair[first:last])
            points, radius = samples(model, 0 if kind <= other else 1)
            if len(points):
                return points, radius
        return np.zeros((0, 3)), 0.0

    def normal_force(self, first: int, second: int) -> Array:
        """[count] N between two solids in the last step; 0 where they aren't near each other.

        With time control impacts within the step count, unless the two have left each other since.
        """
        # without time control, those of a pair that has left each other's reach are out of date
        timed = self._simulation.kinds.features.finds_impacts
        return np.array([
            sum(
                float(row["previous_normal_force"][lane])
                for row in rows if timed or row["count"][lane] > 0
            )
            for rows, lane in self._of_pair(first, second)
        ], dtype=float)  # fmt: skip

    def first_touch(self, first: int, second: int) -> Array:
        """[count] s, when two solids first touched since they are near each other; NaN before."""
        return np.array([
            float(rows[0]["first_touch"][lane]) if len(rows) else math.nan
            for rows, lane in self._of_pair(first, second)
        ])  # fmt: skip

    def first_touch_position(self, first: int, second: int) -> Array:
        """Not recorded here.

        Raises:
            ValueError: always.
        """
        raise ValueError(
            "first_touch_position is not recorded in a world of "
            f"{self._simulation.bodies} bodies; World.contacts has the points of all contacts"
        )

    def _of_pair(self, first: int, second: int) -> list[tuple[Any, int]]:
        """Of each world the half-pairs of a pair, none if the two aren't near, and the lane."""
        simulation = self._simulation
        kinds, place = simulation.kinds, simulation.mechanisms.place
        beyond = len(simulation.mechanisms.body) - len(place)
        at = {s: int(place[s]) if s < len(place) else s + beyond for s in (first, second)}
        places = [at[s] for s in sorted(at, key=lambda s: (kinds.of_solid[s], at[s]))]
        found: list[tuple[Any, int]] = []
        for world in range(simulation.count):
            home = simulation.home(world, *places)
            if home < 0:
                found.append(([], 0))
                continue
            pairs = simulation.arrays(world)[1]
            b, start = home // LANES, pairs.first_work[home // LANES]
            count = kinds.pair_kind[pairs.kind[b]]["half_pair_count"]
            found.append((pairs.work[start : start + count], home % LANES))
        return found

    def can_touch(self, first: int, second: int) -> bool:
        """Whether two solids are of kinds that can touch."""
        kinds = self._simulation.kinds
        return first != second and kinds.pair[kinds.of_solid[first], kinds.of_solid[second]] >= 0
