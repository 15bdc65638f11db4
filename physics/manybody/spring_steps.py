"""Substeps of one world of many bodies with the spring law, by several threads.

Each thread works on its part of the body groups and of the batches, and all wait for each other
between the two. Every batch writes its own wrenches, and every body adds up those of its pairs in a
fixed order, so the result does not depend on the number of threads.
"""

from physics.compiler.bundles import bundle
from physics.compiler.jit import factory, large_entry
from physics.manybody.batches import make_batch_forces
from physics.manybody.blocks import (
    add_contacts,
    add_normals,
    blocks_of,
    make_end_step,
    make_hold_joints,
    make_known_forces,
    make_move_group,
    make_place_group,
)
from physics.manybody.team import FAR, Team, share, takes_batch, total, wait
from physics.model.features import EULER, Features
from physics.model.state import BEGINS, QUERY, STARTS_ANEW
from physics.spring.mass_splitting import splits_mass

# what a call continues with, see `make_spring_steps`
STEP, RESUME, REFRESH = range(3)


@factory
def make_spring_steps(features: Features):
    """Entry point: substeps until all are done or pairs have to be searched again."""
    move_group, place_group = make_move_group(features), make_place_group(features)
    known_forces, hold_joints = make_known_forces(features), make_hold_joints(features)
    batch_forces, end_step = make_batch_forces(features), make_end_step(features)
    splits, dashpot = splits_mass(features), features.dashpot
    before = 1.0 if features.integrator == EULER else 0.5

    @large_entry
    def spring_steps(
        model, state, workspace, crowd, pairs, h, substeps, collision_substeps, progress, barrier,
        shared, thread, threads,
    ):  # fmt: skip
        """All threads call it with the same arguments but their workspace and `thread`.

        progress: [7] substeps done; STEP, RESUME after pairs have been searched or REFRESH, which
        computes forces only; 1: pairs have to be searched; and at 6 why it refreshes. For barrier
        and shared see `Team`.
        """
        model, state, workspace = bundle(model), bundle(state), bundle(workspace)
        crowd, pairs = bundle(crowd), bundle(pairs)
        team, batches = Team(barrier, shared, thread, threads), crowd.order.shape[0]
        first, last = share(0, crowd.group.shape[0], team)
        done, phase = progress[0], progress[1]
        wait(team)  # before any thread writes the progress
        while done < substeps or phase != STEP:
            if phase == STEP:
                far = 0
                for g in range(first, last):
                    far += move_group(model, workspace, crowd, g, before * h, h)
                shared[thread, FAR] = far
                if total(team, FAR) > 0:
                    if thread == 0:
                        progress[0], progress[1], progress[2] = done, RESUME, 1
                    return
            elif phase == REFRESH:
                for g in range(first, last):
                    place_group(model, workspace, crowd, g)
                wait(team)
            step = 0.0 if phase == REFRESH else h
            elapsed = done * h + step
            # see `spring.contacts`; a query is a refresh before no step
            begins = substeps > 0 and not dashpot
            span = before * h if phase == REFRESH and begins else step
            refresh = 0 if phase != REFRESH else BEGINS if begins else QUERY
            # new forces alone change nothing that contacts remember
            remembers = phase != REFRESH or progress[6] == STARTS_ANEW
            starts = phase != REFRESH and done > 0 and done % collision_substeps == 0
            for n in range(batches):
                if takes_batch(n, team):
                    b = crowd.order[n]
                    batch_forces(
                        model, state, workspace, crowd, pairs, b, span, refresh, elapsed, starts,
                        remembers,
                    )  # fmt: skip
            wait(team)
            for g in range(first, last):
                known_forces(model, workspace, crowd, g, step)
                for m in blocks_of(crowd, g):
                    add_contacts(crowd, pairs, m, crowd.solid[m].force, crowd.solid[m].torque)
                    if splits:
                        add_normals(crowd, pairs, m)
                hold_joints(model, state, workspace, crowd, g, h, step)
                end_step(model, workspace, crowd, g, step, (1.0 - before) * step)
            done += 0 if phase == REFRESH else 1
            phase = STEP
        wait(team)
        if thread == 0:
            progress[0], progress[1], progress[2] = done, STEP, 0

    return spring_steps
