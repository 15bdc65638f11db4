"""Pairs move to new homes, so that those with lists of the same length are side by side.

A batch takes as long as the longest list in it. Lists change with every search, so in time short
ones stand beside long ones, and pairs that only are near each other beside pairs in contact.
"""

from functools import cache

import numpy as np

from physics.collision.candidate_list import make_clear
from physics.compiler.jit import LANES, entry, stage
from physics.manybody.homes import FOREVER, clear_lane
from physics.manybody.tables import MOST_COLOURS
from physics.model.contact_memory import contact_memory
from physics.model.features import Features

Array = np.ndarray

# numbers of a half-pair, and of a candidate besides its memory, that move with a pair
_ROW, _CANDIDATE = 11, 11


def room_for(pairs: int, half_pairs: int, candidates: int, features: Features) -> int:
    """Numbers that `repack` needs to put pairs aside."""
    return pairs * half_pairs * _ROW + candidates * (_CANDIDATE + contact_memory(features).size)


@cache
def make_occupancy():
    """Entry point: lengths of lists of each pair, and how well batches are filled."""

    @entry
    def occupancy(work, first_work, kind, pair_kind, homes, batches, lengths):
        """Writes lengths [n, 2] of the first half-pair and of all others; candidates and places."""
        filled = 0
        for n in range(homes.shape[0]):
            b, i = homes[n] // LANES, homes[n] % LANES
            lengths[n, 0] = work[first_work[b]].count[i]
            lengths[n, 1] = 0
            for k in range(1, pair_kind[kind[b]].half_pair_count):
                lengths[n, 1] += work[first_work[b] + k].count[i]
            filled += lengths[n, 0] + lengths[n, 1]
        places = 0
        for b in range(batches):
            for k in range(pair_kind[kind[b]].half_pair_count):
                places += LANES * work[first_work[b] + k].slots
        return filled, places

    return occupancy


@cache
def make_repack(features: Features):
    """Entry point: moves all pairs."""
    clear = make_clear(features)
    memory_size = contact_memory(features).size
    impulse, particles = features.impulse, features.particles
    hidden = features.box and features.compound

    @stage
    def put_aside(row, candidate, sample_id, i, aside, at):
        """Writes a half-pair's lane to `aside` and clears it; returns where the next one begins."""
        aside[at] = row.count[i]
        aside[at + 1] = row.remaining_skin[i]
        aside[at + 2] = row.relative_motion[i]
        aside[at + 3] = row.first_touch[i]
        aside[at + 4] = row.previous_normal_force[i]
        aside[at + 5] = row.previous_weight[i]
        aside[at + 6] = row.previous_impact[i]
        aside[at + 7] = row.previous_closing[i]
        for c in range(3):
            aside[at + 8 + c] = row.previous_normal[c, i]
        at += _ROW
        for n in range(row.count[i]):
            slot = candidate[n]
            aside[at] = sample_id[n, i]
            aside[at + 1] = slot.weight[i]
            for c in range(3):
                aside[at + 2 + c] = slot.sample[c, i]
                if impulse:
                    aside[at + 5 + c] = slot.impact_force[c, i]
                if particles:
                    aside[at + 8 + c] = slot.partner[c, i]
            for m in range(memory_size):
                aside[at + _CANDIDATE + m] = slot.memory[m, i]
            at += _CANDIDATE + memory_size
            clear(slot, i)
        clear_lane(row, i, FOREVER)
        return at

    @stage
    def take_back(row, candidate, sample_id, i, aside, at):
        """The reverse."""
        row.count[i] = int(aside[at])
        row.remaining_skin[i] = aside[at + 1]
        row.relative_motion[i] = aside[at + 2]
        row.first_touch[i] = aside[at + 3]
        row.previous_normal_force[i] = aside[at + 4]
        row.previous_weight[i] = aside[at + 5]
        row.previous_impact[i] = aside[at + 6]
        row.previous_closing[i] = aside[at + 7]
        for c in range(3):
            row.previous_normal[c, i] = aside[at + 8 + c]
        at += _ROW
        for n in range(row.count[i]):
            slot = candidate[n]
            sample_id[n, i] = int(aside[at])
            slot.weight[i] = aside[at + 1]
            for c in range(3):
                slot.sample[c, i] = aside[at + 2 + c]
                if hidden:  # another kind of pair may have had the slot
                    slot.hidden_offset[c, i] = 0.0
                if impulse:
                    slot.impact_force[c, i] = aside[at + 5 + c]
                if particles:
                    slot.partner[c, i] = aside[at + 8 + c]
            for m in range(memory_size):
                slot.memory[m, i] = aside[at + _CANDIDATE + m]
            at += _CANDIDATE + memory_size
        return at

    @entry
    def repack(model, pairs, pair_kind, free, homes, order, kinds, colours, aside, firsts, seconds):
        """Gives pairs new homes in an order, in which pairs of one kind and colour are together.

        Args:
            model: tables of all kinds of pairs.
            pairs: of the world.
            pair_kind: of PAIR_KIND.
            free: of the world.
            homes: [n] of each pair, written.
            order: [n] pairs in the order of their new homes.
            kinds: [n] row of `pair_kind`.
            colours: [n].
            aside: [`room_for`] working memory.
            firsts: [n] place of each pair's first solid.
            seconds: [n] of its second.
        """
        at = 0
        for m in range(order.shape[0]):
            n = order[m]
            b, i = homes[n] // LANES, homes[n] % LANES
            kind = pair_kind[kinds[n]]
            for k in range(kind.half_pair_count):
                slot = pairs.first_slot[b] + model.half_pair[kind.first_half_pair + k].first_slot
                row, candidate = pairs.work[pairs.first_work[b] + k], pairs.candidate[0, slot:]
                at = put_aside(row, candidate, pairs.sample_id[0, slot:], i, aside, at)
        for key in range(free.first_free.shape[0]):
            free.first_free[key] = -1
        for b in range(free.used[0]):
            for i in range(LANES):
                pairs.first[b, i] = -1
                pairs.second[b, i] = -1
                for c in range(12):
                    pairs.wrench[b, i, c] = 0.0
            pairs.busy[b] = 0
        free.used[0], free.used[1], free.used[2] = 0, 0, 0
        at, b, i, last_kind, last_colour = 0, -1, LANES, -1, -1
        for m in range(order.shape[0]):
            n = order[m]
            kind, colour = pair_kind[kinds[n]], colours[n]
            full = i == LANES or colour == MOST_COLOURS
            if full or kinds[n] != last_kind or colour != last_colour:
                b, i = free.used[0], 0
                pairs.kind[b], pairs.colour[b] = kinds[n], colour
                pairs.first_slot[b], pairs.first_work[b] = free.used[1], free.used[2]
                free.used[0] += 1
                free.used[1] += kind.slot_count
                free.used[2] += kind.half_pair_count
                last_kind, last_colour = kinds[n], colour
                for k in range(kind.half_pair_count):
                    for lane in range(LANES):
                        clear_lane(pairs.work[pairs.first_work[b] + k], lane, FOREVER)
                    pairs.work[pairs.first_work[b] + k].slots = 0
                if colour < MOST_COLOURS:  # until a pair takes them
                    key = kinds[n] * (MOST_COLOURS + 1) + colour
                    for lane in range(LANES - 1, -1, -1):
                        home = b * LANES + lane
                        free.next_free[home] = free.first_free[key]
                        free.first_free[key] = home
            if colour < MOST_COLOURS:
                key = kinds[n] * (MOST_COLOURS + 1) + colour
                free.first_free[key] = free.next_free[b * LANES + i]
            homes[n] = b * LANES + i
            pairs.first[b, i] = firsts[n]
            pairs.second[b, i] = seconds[n]
            for k in range(kind.half_pair_count):
                slot = pairs.first_slot[b] + model.half_pair[kind.first_half_pair + k].first_slot
                row, candidate = pairs.work[pairs.first_work[b] + k], pairs.candidate[0, slot:]
                at = take_back(row, candidate, pairs.sample_id[0, slot:], i, aside, at)
                row.slots = max(row.slots, row.count[i])
            i += 1

    return repack
