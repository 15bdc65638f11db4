"""What can be asked of worlds of many bodies about their contacts."""

import math
from typing import Any

import numpy as np

from physics.analysis.contact_system import ContactSystem
from physics.analysis.diagnostics import Contacts, samples
from physics.compiler.jit import LANES, aligned_zeros
from physics.manybody.reports import TOUCH, ReportArrays, make_touching
from physics.manybody.simulation import CrowdSimulation
from physics.model.impulse_rows import CONTACT_ROW
from physics.spring.contact_loop import REPORT

Array = np.ndarray


class CrowdQueries:
    """Contacts of worlds of many bodies, with states that are up to date."""

    def __init__(self, simulation: CrowdSimulation) -> None:
        """`simulation`: of the worlds."""
        self._simulation = simulation

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

    def penetration(self) -> Array:
        """[count] m, deepest penetration now; 0 where nothing touches."""
        deepest = [
            self._touching(world)["penetration"].max(initial=0.0)
            for world in range(self._simulation.count)
        ]
        return np.array(deepest)

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
        found = self._touching(world)
        pair = np.stack([self._solid(found["owner"]), self._solid(found["surface"])], axis=-1)
        return Contacts(
            pair=pair,
            names=tuple((names[first], names[second]) for first, second in pair),
            point=found["point"].copy(),
            normal=found["normal"].copy(),
            penetration=found["penetration"].copy(),
            force=found["force"].copy(),
            first_touch=found["first_touch"].copy(),
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

    def largest_stable_step(self, world: int) -> float:
        """Largest stable step in s with a world's present contacts; inf if nothing limits it."""
        simulation = self._simulation
        found = self._touching(world)
        if simulation.features.impulse:  # contacts limit nothing, servos do
            found = found[:0]
        kinds, kind = np.unique(found["half_pair"], return_inverse=True)
        rows, ends = simulation.kinds.model.half_pair[kinds], [found["owner"], found["surface"]]
        return ContactSystem(
            simulation.state.dynamic[world], simulation.base.dynamic,
            self._solid(np.stack(ends, axis=-1)), found["point"], found["normal"], found["weight"],
            list(rows), kind, simulation.features.dashpot, simulation.features.viscous,
        ).largest_stable_step()  # fmt: skip
