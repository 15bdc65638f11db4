"""The pairs of one world: found again when a body has moved as far as its margin allows."""

from typing import Any

import numpy as np

from physics.compiler.jit import LANES
from physics.manybody.extents import half_extents
from physics.manybody.homes import Homes, make_incidence, make_merge, make_settle, no_homes
from physics.manybody.kinds import Kinds
from physics.manybody.mechanisms import Mechanisms
from physics.manybody.near_pairs import Grid, grid_levels, make_near_pairs
from physics.manybody.repack import make_occupancy, make_repack, room_for
from physics.manybody.sorting import lexicographic_order, make_sort_pairs
from physics.manybody.tables import (
    DISPLACEMENT,
    IMPACTS,
    MOST_COLOURS,
    ROTATION_BOUND,
    Crowd,
    Pairs,
    bytes_with_room,
    copy_pairs,
    no_pairs,
    with_room,
)
from physics.model.free_memory import check_memory
from physics.scene.scene import Scene
from physics.scene.solids import Ground

Array = np.ndarray

# margin of a body as a fraction of its width: a wider one is left less often, and takes more pairs
NEAR_MARGIN = 0.25
# a fast body has a margin of so many steps
_STEPS = 4.0
# of the filled part of batches right after pairs have moved: below, they move again
_WORTH = 0.8


class PairLists:
    """Near pairs of one world and the arrays in which they live.

    Attributes:
        pairs: their arrays.
        found: [n] sorted, place of the first solid times the number of places plus the second's.
        homes: [n] of each.
    """

    def __init__(self, scene: Scene, kinds: Kinds, mechanisms: Mechanisms, blocks: int) -> None:
        """Without any pair yet; the arrays of what never changes."""
        self._kinds, self._bodies = kinds, blocks * LANES
        self._places = self._bodies + len(scene.statics)
        at = np.concatenate([mechanisms.place, self._bodies + np.arange(len(scene.statics))])
        solids: list[Any] = [*scene.bodies, *scene.driven_bodies, *scene.statics]
        self._excluded = self._never_touching(scene, at)
        examples = [int(np.argmax(kinds.of_solid == kind)) for kind in range(len(kinds.pair))]
        shapes = [None if isinstance(solids[n], Ground) else solids[n].shape for n in examples]
        self._kind = np.full(self._places, -1)
        self._kind[at] = kinds.of_solid

        def of_place(values: list[Any], otherwise: Any) -> Array:
            out = np.full((self._places, *np.shape(values[0])), otherwise)
            out[at] = np.array(values)[kinds.of_solid]
            return out

        self._plane = of_place([int(shape is None) for shape in shapes], 0)
        self._box = of_place([np.zeros(3) if s is None else half_extents(s) for s in shapes], 0.0)
        self._reach = of_place([0.0 if s is None else s.reach for s in shapes], 0.0)
        margin = of_place([0.0 if s is None else NEAR_MARGIN * s.width for s in shapes], 0.0)
        margin[self._bodies :] = 0.0
        # copies of bodies may go anywhere
        self._least_margin = np.where(self._kind < 0, np.inf, margin)
        self._grid, self._counts = Grid.of(self._places), np.zeros(self._places + 1, np.int64)
        self._room = np.zeros(8 * self._places, np.int64)
        self.clear()

    def _never_touching(self, scene: Scene, at: Array) -> Array:
        """Pairs, as in `found`, of the fingers of a gripper and of solids that a joint connects."""
        first = len(scene.bodies)
        pairs = [(first + n, first + n + 1) for n, _ in scene.grippers]
        pairs += scene.jointed_pairs
        found = np.zeros((2, len(pairs)), np.int64)
        for n, (a, b) in enumerate(pairs):
            kinds = self._kinds.of_solid[a], self._kinds.of_solid[b]
            swap = kinds[1] < kinds[0] or (kinds[0] == kinds[1] and at[b] < at[a])
            found[:, n] = (at[b], at[a]) if swap else (at[a], at[b])
        return found[0] * self._places + found[1]

    def clear(self) -> None:
        """Forgets all pairs."""
        self.pairs: Pairs = no_pairs(self._kinds.features)
        self.found, self.homes = np.zeros(0, np.int64), np.zeros(0, np.int64)
        self._filled = 1.0
        self._free: Homes = no_homes(len(self._kinds.pair_kind), self._places)

    def search(self, crowd: Crowd) -> Crowd:
        """Finds the near pairs of the present poses; those that were near keep their contacts.

        On the way through a substep no home is moved, see impact_paths.py.
        """
        moved = np.abs(crowd.frame[:, DISPLACEMENT : DISPLACEMENT + 3]).sum(axis=1)
        moved += crowd.frame[:, ROTATION_BOUND]
        margin = np.maximum(self._least_margin, _STEPS * moved)
        margin[self._bodies :] = 0.0
        found = self._find(crowd, margin)
        homes = np.empty(len(found), np.int64)
        kinds, free = self._kinds, self._free
        sizes = self._bodies, self._places
        make_merge(kinds.features)(
            kinds.model, self.pairs, kinds.pair_kind, free, *sizes, self.found, self.homes, found,
            homes,
        )  # fmt: skip
        settled = 0
        while settled < len(found):
            settled = make_settle(kinds.features)(
                self.pairs, kinds.pair_kind, self._free, self._kind, kinds.pair, *sizes, found,
                homes, settled,
            )  # fmt: skip
            if settled < len(found):
                self._grow(found[settled:][homes[settled:] < 0])
        self.found, self.homes = found, homes
        if not crowd.path[IMPACTS] > 0.0:
            self._repack()
        return self.listed(crowd, margin[: self._bodies].reshape(-1, LANES))

    def _repack(self) -> None:
        """Moves pairs to new homes where batches are much less filled than after the last move."""
        lengths, batches = np.empty((len(self.found), 2), np.int64), int(self._free.used[0])
        pairs = self.pairs
        measure = pairs.work, pairs.first_work, pairs.kind, self._kinds.pair_kind, self.homes
        filled, places = make_occupancy()(*measure, batches, lengths)
        if filled >= _WORTH * self._filled * places:
            return
        batch, features = self.homes // LANES, self._kinds.features
        kinds, colours = self.pairs.kind[batch], self.pairs.colour[batch]
        order = lexicographic_order([kinds, colours, lengths[:, 0], lengths[:, 1]])
        most = int(self._kinds.pair_kind["half_pair_count"].max())
        aside = np.empty(room_for(len(self.found), most, filled, features))
        one, two = np.divmod(self.found, self._places)
        make_repack(features)(
            self._kinds.model, self.pairs, self._kinds.pair_kind, self._free, self.homes, order,
            kinds, colours, aside, one, two,
        )  # fmt: skip
        filled, places = make_occupancy()(*measure, int(self._free.used[0]), lengths)
        self._filled = filled / max(places, 1)

    def _find(self, crowd: Crowd, margin: Array) -> Array:
        sizes = np.where(self._kind >= 0, self._reach + margin, 0.0)
        round_ones = (self._kind >= 0) & (self._plane == 0)
        level = np.zeros(self._places, np.int64)
        level[round_ones], edge = grid_levels(sizes[round_ones])
        while True:
            count = make_near_pairs()(
                crowd.frame, self._box, self._reach, margin, self._kind, self._plane, level, edge,
                self._bodies, self._kinds.pair, self._grid, self._room,
            )  # fmt: skip
            if count <= len(self._room):
                found = np.empty(count, np.int64)
                make_sort_pairs()(self._room[:count], self._places, self._counts, found)
                if len(self._excluded):
                    found = found[~np.isin(found, self._excluded)]
                return found
            self._room = np.zeros(count + count // 4, np.int64)

    def _grow(self, new: Array) -> None:
        """Room for new pairs [n] and, so that it is seldom needed, for half as many as there are.

        A kind needs a batch for LANES pairs and one more, of which some lanes stay free. With
        impulses colours may need more, and then this is called again.
        """
        kind, free = self._kinds.pair_kind, self._free
        one, two = np.divmod(new, self._places)
        kinds = self._kinds.pair[self._kind[one], self._kind[two]]
        counts = np.bincount(kinds, minlength=len(kind))
        more = np.where(counts > 0, 1 + counts // LANES, 0)
        used = free.used + free.used // 2
        batches = int(used[0] + more.sum())
        enough = (
            max(int(used[1] + more @ kind["slot_count"]), self.pairs.candidate.shape[1]),
            max(int(used[2] + more @ kind["half_pair_count"]), len(self.pairs.work)),
        )
        batches = max(batches, len(self.pairs.kind))
        check_memory(
            bytes_with_room(self.pairs, self._kinds.features, batches, *enough),
            "the pairs of bodies that are near each other",
        )
        self.pairs = with_room(self.pairs, self._kinds.features, batches, *enough)
        following = np.full(batches * LANES, -1)
        following[: len(self._free.next_free)] = self._free.next_free
        self._free = self._free._replace(next_free=following)

    def listed(self, crowd: Crowd, margin: Array) -> Crowd:
        """The world with the order of the present pairs, and with margins [blocks, LANES]."""
        used = int(self._free.used[0])
        order = lexicographic_order([self.pairs.colour[:used]])
        colours = self.pairs.colour[order]
        incident = np.empty(2 * len(self.found), np.int64)
        make_incidence()(
            self.found, self.homes, self._bodies, self._places, crowd.incident_first, incident
        )
        crowd.motion[...] = 0.0
        crowd.margin[...] = margin
        return crowd._replace(
            incident=incident,
            order=order,
            colour_first=np.searchsorted(colours, np.arange(MOST_COLOURS + 2)),
        )

    def home(self, first: int, second: int) -> int:
        """Home of the pair of two places, -1 if they aren't near each other."""
        n = int(np.searchsorted(self.found, first * self._places + second))
        near = n < len(self.found) and self.found[n] == first * self._places + second
        return int(self.homes[n]) if near else -1

    def saved(self) -> Any:
        """A copy of everything that the next steps depend on."""
        free = Homes(*(array.copy() for array in self._free))
        return copy_pairs(self.pairs), self.found.copy(), self.homes.copy(), free, self._filled

    def restore(self, saved: Any) -> None:
        """Returns to what `saved` gave."""
        pairs, found, homes, free, self._filled = saved
        self.pairs, self.found, self.homes = copy_pairs(pairs), found.copy(), homes.copy()
        self._free = Homes(*(array.copy() for array in free))
