"""Work on the pairs of one colour after the other: those of one colour share no body.

So all pairs of a colour can be worked on at once, by any number of threads, with the same result.
Pairs that found no colour are left to the first thread.
"""

from physics.compiler.jit import sequence, stage
from physics.manybody.couplings import couple_fingers
from physics.manybody.tables import MOST_COLOURS
from physics.manybody.team import share, wait
from physics.model.features import cached_by_features


@stage
def part_of_colour(crowd, colour, team):
    """Which entries of `Crowd.order` of a colour a thread works on, and whether there are any."""
    begin, end = crowd.colour_first[colour], crowd.colour_first[colour + 1]
    if colour < MOST_COLOURS:
        first, last = share(begin, end, team)
    else:
        first, last = begin, end if team.thread == 0 else begin
    return first, last, end > begin


@cached_by_features
def make_by_colour(features, work):
    """Sequence that calls `work` for all batches in contact, and adds up what it returns.

    `work` is a sequence that takes model, workspace, contact rows, crowd, pairs, the number of a
    batch, and options.
    """
    gripper = features.gripper

    @sequence
    def by_colour(model, workspace, rows, crowd, pairs, team, options):
        count = 0
        for colour in range(MOST_COLOURS + 1):
            first, last, used = part_of_colour(crowd, colour, team)
            for n in range(first, last):
                b = crowd.order[n]
                if pairs.busy[b] != 0:
                    count += work(model, workspace, rows, crowd, pairs, b, *options)
            if used:
                wait(team)
                if gripper:
                    first, last = share(0, crowd.group.shape[0], team)
                    for g in range(first, last):
                        if crowd.group[g].gripper != 0:
                            couple_fingers(crowd, g)
                    wait(team)
        return count

    return by_colour
