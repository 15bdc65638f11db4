"""Homes of pairs: in which lane of which batch a pair lives while its solids are near each other.

A pair keeps its home, with its candidates and what its contacts remember, until its solids are no
longer near each other. A free lane is given to a new pair of the same kind and colour. Colours are
for the impulse law: pairs of one colour share no body, so all of them can be solved at once.
"""

import math
from functools import cache
from typing import NamedTuple

import numpy as np

from physics.collision.candidate_list import make_clear
from physics.compiler.jit import LANES, entry, stage
from physics.manybody.tables import MOST_COLOURS
from physics.model.features import Features

Array = np.ndarray

# a lane without a pair needs no search, however far its solids "move"
FOREVER = 1e300


class Homes(NamedTuple):
    """Which homes are free.

    Attributes:
        first_free: [kinds * (MOST_COLOURS + 1)] a free home of a kind and colour, -1 for none.
        next_free: [batches * LANES] the next one, -1 for none.
        colours: [places] bits of the colours of a body's pairs.
        used: [3] batches, slots and rows of `Pairs.work` that are in use.
    """

    first_free: Array
    next_free: Array
    colours: Array
    used: Array


def no_homes(kinds: int, places: int) -> Homes:
    """Without any batch."""
    return Homes(
        first_free=np.full(kinds * (MOST_COLOURS + 1), -1),
        next_free=np.full(0, -1),
        colours=np.zeros(places, np.int64),
        used=np.zeros(3, np.int64),
    )


@stage
def clear_lane(row, i, remaining_skin):
    """An empty list, and no memory, of one half-pair."""
    row.count[i] = 0
    row.remaining_skin[i] = remaining_skin
    row.relative_motion[i] = 0.0
    row.first_touch[i] = math.nan
    row.previous_normal_force[i] = 0.0
    row.previous_weight[i] = 0.0
    row.previous_impact[i] = 0.0
    row.previous_closing[i] = 0.0
    for c in range(3):
        row.previous_normal[c, i] = 0.0


@cache
def make_merge(features: Features):
    """Entry point: which pairs of a new list have homes; releases the homes of the others."""
    clear, timed = make_clear(features), features.finds_impacts

    @entry
    def merge(model, pairs, pair_kind, free, bodies, places, old, old_homes, new, homes):
        """Writes the home of each new pair, -1 for none yet. Both lists are sorted."""
        n = 0
        for m in range(new.shape[0]):
            homes[m] = -1
        for o in range(old.shape[0]):
            while n < new.shape[0] and new[n] < old[o]:
                n += 1
            if n < new.shape[0] and new[n] == old[o]:
                homes[n] = old_homes[o]
                continue
            b, i = old_homes[o] // LANES, old_homes[o] % LANES
            kind, colour = pair_kind[pairs.kind[b]], pairs.colour[b]
            for k in range(kind.half_pair_count):
                row = pairs.work[pairs.first_work[b] + k]
                constants = model.half_pair[kind.first_half_pair + k]
                slot = pairs.first_slot[b] + constants.first_slot
                for c in range(row.count[i]):
                    clear(pairs.candidate[0, slot + c], i)
                clear_lane(row, i, FOREVER)
                if timed:
                    timing = pairs.timing[pairs.first_work[b] + k]
                    timing.timed[i], timing.impulse[i] = 0, 0.0
                slots = 0
                for lane in range(LANES):
                    slots = max(slots, row.count[lane])
                row.slots = slots
            pairs.first[b, i] = -1
            pairs.second[b, i] = -1
            for c in range(12):
                pairs.wrench[b, i, c] = 0.0
            one, two = old[o] // places, old[o] % places
            if colour < MOST_COLOURS:
                free.colours[one] &= ~(1 << colour)
                if two < bodies:
                    free.colours[two] &= ~(1 << colour)
            key = pairs.kind[b] * (MOST_COLOURS + 1) + colour
            free.next_free[old_homes[o]] = free.first_free[key]
            free.first_free[key] = old_homes[o]

    return merge


@cache
def make_settle(features: Features):
    """Entry point: gives homes to pairs that have none."""
    coloured = features.impulse

    @stage
    def free_colour(free, one, two, bodies):
        """The first colour that no pair of two solids has, and marks it."""
        if not coloured:
            return 0
        taken = free.colours[one] | (free.colours[two] if two < bodies else 0)
        for colour in range(MOST_COLOURS):
            if taken & (1 << colour) == 0:
                free.colours[one] |= 1 << colour
                if two < bodies:
                    free.colours[two] |= 1 << colour
                return colour
        return MOST_COLOURS

    @stage
    def open_batch(pairs, pair_kind, free, kind_index, colour, key):
        """A new batch, whose lanes are free; False without room for it."""
        kind, b = pair_kind[kind_index], free.used[0]
        room = b < pairs.kind.shape[0]
        room = room and free.used[1] + kind.slot_count <= pairs.candidate.shape[1]
        room = room and free.used[2] + kind.half_pair_count <= pairs.work.shape[0]
        if not room:
            return False
        pairs.kind[b], pairs.colour[b] = kind_index, colour
        pairs.first_slot[b], pairs.first_work[b] = free.used[1], free.used[2]
        free.used[0] += 1
        free.used[1] += kind.slot_count
        free.used[2] += kind.half_pair_count
        for i in range(LANES - 1, -1, -1):
            pairs.first[b, i] = -1
            pairs.second[b, i] = -1
            for k in range(kind.half_pair_count):
                clear_lane(pairs.work[pairs.first_work[b] + k], i, FOREVER)
            # what found no colour is solved one pair after the other: one pair per batch
            if colour < MOST_COLOURS or i == 0:
                free.next_free[b * LANES + i] = free.first_free[key]
                free.first_free[key] = b * LANES + i
        return True

    @entry
    def settle(pairs, pair_kind, free, kind, pair, bodies, places, new, homes, start):
        """Continues with pair `start`; returns where room ran out, or the number of pairs."""
        for n in range(start, new.shape[0]):
            if homes[n] >= 0:
                continue
            one, two = new[n] // places, new[n] % places
            kind_index = pair[kind[one], kind[two]]
            colour = free_colour(free, one, two, bodies)
            key = kind_index * (MOST_COLOURS + 1) + colour
            opened = free.first_free[key] >= 0
            if not opened and not open_batch(pairs, pair_kind, free, kind_index, colour, key):
                if coloured and colour < MOST_COLOURS:
                    free.colours[one] &= ~(1 << colour)
                    if two < bodies:
                        free.colours[two] &= ~(1 << colour)
                return n
            home = free.first_free[key]
            free.first_free[key] = free.next_free[home]
            homes[n] = home
            b, i = home // LANES, home % LANES
            pairs.first[b, i] = one
            pairs.second[b, i] = two
            for k in range(pair_kind[kind_index].half_pair_count):
                clear_lane(pairs.work[pairs.first_work[b] + k], i, -1.0)
        return new.shape[0]

    return settle


@cache
def make_incidence():
    """Entry point: the homes of each body's pairs, in the order of the list of pairs."""

    @entry
    def incidence(found, homes, bodies, places, first, incident):
        """Writes `Crowd.incident_first` and `Crowd.incident`."""
        for p in range(bodies + 1):
            first[p] = 0
        for n in range(found.shape[0]):
            first[found[n] // places] += 1
            if found[n] % places < bodies:
                first[found[n] % places] += 1
        total = 0
        for p in range(bodies + 1):
            count = first[p]
            first[p] = total
            total += count
        for n in range(found.shape[0]):
            one, two = found[n] // places, found[n] % places
            incident[first[one]] = 2 * homes[n]
            first[one] += 1
            if two < bodies:
                incident[first[two]] = 2 * homes[n] + 1
                first[two] += 1
        for p in range(bodies, 0, -1):
            first[p] = first[p - 1]
        first[0] = 0

    return incidence
