"""Energy stored in the normal springs of contacts, computed by the step's kernels.

A sample with the weight w that penetrates by d has the spring force w k d, and so the energy
w k d^2/2. Damping multiplies this force and stores nothing. The impulse law has such springs where
solids overlap, too: the soft contacts of `impulse.sweep`. But an instantaneous collision may leave
an overlap that it did not pay for, and the speed at which overlaps are pushed apart is limited, so
their sum is what such a world has only while it is at rest.

Springs of friction are not counted. Their force is what friction remembers: where a contact slides
it follows from the speed, not from a shear (see `spring.coulomb`), so it has no potential. A hand
that lands at 1 m/s charges them to the friction cone within two steps, with more energy than
friction has taken until then; the steps that follow do not return it. So a balance of energy
without them is too low where a contact sticks, and right again when it is released.

The energy of a world with contacts is exact between steps in the limit of short steps only. Kicks
and drifts take turns, so in a harmonic contact kinetic and elastic energy at the same time are not
constant in sum: it swings by a fraction (omega h)^2/4 of the elastic energy, 1/16 at a contact
resolution of 0.5. The sum is least at first contact and does not exceed that before it, see the
mean over the drift in `spring.hunt_crossley`.
"""

from typing import Any

import numpy as np

from physics.collision.compound_frames import make_compound_frames
from physics.compiler.bundles import bundle
from physics.compiler.jit import LANES, at, factory, large_entry
from physics.impulse.contact_rows import make_contact_rows
from physics.model.features import Features
from physics.model.lanes import load, make_constants
from physics.model.state import QUERY
from physics.motion.kinematics import make_kinematics, write_drive_frames, write_static_frames
from physics.spring.contact_loop import REPORT
from physics.spring.contacts import make_half_pair
from physics.step.simulation import Simulation
from physics.step.threads import run_in_blocks

Array = np.ndarray


@factory
def _make_elastic_energy(features: Features) -> Any:
    """Entry point: writes the elastic energy [w] J of the worlds of groups first <= g < last."""
    constants, kinematics = make_constants(features), make_kinematics(features)
    compound_frames, impulse = make_compound_frames(features), features.impulse
    half_pair = make_contact_rows(features) if impulse else make_half_pair(features, True)

    @large_entry
    def elastic_energy(all_model, state, workspace, chosen, rows, energy, first, last):
        state, workspace = bundle(state), bundle(workspace)
        for g in range(first, last):
            model = bundle(constants(all_model, g))
            if load(model, state, workspace, chosen, g) == 0:
                continue
            write_static_frames(model, workspace)
            write_drive_frames(model, workspace)
            kinematics(model, workspace)
            compound_frames(model, workspace)
            lane = workspace.lane[0]
            for i in range(LANES):
                lane.updates_memory[i] = 0
            for k in range(model.half_pair.shape[0]):
                live, pair = workspace.half_pair[k], model.half_pair[k]
                if live.slots == 0:
                    continue
                # what contacts remember stays: with springs the step of 0 s restores it
                if impulse:
                    half_pair(model, state, workspace, g, k, lane.updates_memory, 1.0)
                else:
                    half_pair(model, state, workspace, rows, g, k, 0.0, QUERY)
                stiffness, first_row = pair.stiffness, pair.first_slot
                for n in range(live.slots):
                    for i in range(LANES):
                        if lane.active[i] and n < live.count[i]:
                            if impulse:
                                point = workspace.contact_row[first_row + n]
                                d, weight = -point.separation[i], point.weight[i]
                            else:
                                row = rows[first_row + n]
                                d, weight = row.penetration[i], row.weight[i]
                            d = max(d, 0.0)
                            stored = 0.5 * weight * at(stiffness, i) * d * d
                            energy[lane.world[i]] += stored if weight > 0.0 else 0.0
        return 0

    return elastic_energy


def elastic_energy(simulation: Simulation) -> Array:
    """[count] J stored in the contacts of each world; 0 of worlds that have diverged."""
    energy = np.zeros(simulation.count)
    if not len(simulation.base.half_pair):
        return energy
    kernel = _make_elastic_energy(simulation.features)
    model, state, everyone = simulation.model, simulation.state, simulation.everyone

    def run(first: int, last: int) -> int:
        workspace = simulation.take_workspace()
        rows = np.zeros(state.candidate.shape[1], REPORT)
        kernel(model, state, workspace, everyone, rows, energy, first, last)
        simulation.return_workspace(workspace)
        return 0

    groups = -(-simulation.count // LANES)
    run_in_blocks(run, groups, simulation.threads)
    return energy
