"""Mass splitting: each of a body's contacts estimates its load with a part of the mass.

The normal law estimates the load on a contact from the last step, L = f + m (u - u_before) / h, as
if it alone acted on its two bodies (see `hunt_crossley`). A body that is squeezed from two sides
has two such contacts, and each takes what the other did for a change of its own load. Strongly
damped, a contact removes the whole approach speed within a step: f = L + m u / h. With the part
m / n of the mass in L, the difference D = f_1 - f_2 of two of them follows

    D = (1 - 2/n) D_before + 2 m u / h,    m u_after = m u - h D.

With n = 1 the speed u grows by 1 + sqrt(2) in every step: the body vibrates and gains energy. With
n = 2 it only changes its sign at this limit of strong damping, and decays with any weaker one.

n counts the solids that press along the same line. With n_j the mean normal of the contact with
solid j, n of contact i is the sum over all j of (n_i . n_j)^2. It is 2 for opposite contacts, and 1
for each of a floor and a wall, which don't disturb each other. The normals are those of the last
step, so a contact is alone in its first. One solid that presses from two sides, as a slot does,
counts as one: the samples of a pair have one mean normal.

Friction, too, is chosen as if each contact acted alone. In a step its damping c changes the slip of
two bodies by the part h (c + h k_t / 2) (w_1 + w_2), with their inverse masses w for a force at the
surface, which rotation makes larger. All contacts of a body turn it at once. By Gershgorin's
circles no mode of a heap overshoots, and friction can't drive it, if for each body the sum of

    a_i = h (c_i + h k_t,i / 2) (w + sqrt(w w_i))

over its contacts i is at most 2. So where that sum S was larger in the last step, a contact has the
part 2/S of its a_i. Its spring keeps all of its own part f, so the damping is multiplied by its
`grip` (2/S - f)/(1 - f), the smaller one of its two bodies. Cubes and balls keep all of it up to
two contacts. Without it a heap of rough balls boils for ever.

The damping of the normal law keeps the whole mass. With a part of it, hands that close on a body
rebound too fast, and a gripper loses its cube (docs/decisions/0007-normal-force.md). The dashpot
has no load. Mass splitting of contacts that are solved at once: Tonge, Benevolenski and Voroshilov
2012.
"""

import math

from physics.compiler.jit import LANES, at, stage
from physics.model.features import ADAPTIVE, RK4
from physics.model.tangential import grip_of
from physics.model.workspace import NORMAL_SUMS
from physics.scene.shapes import PLANE


def splits_mass(features):
    """Whether masses or damping are split: not where steps of zero length evaluate forces."""
    splits = not features.dashpot or features.friction or features.viscous
    return splits and features.integrator not in (RK4, ADAPTIVE)


@stage
def closes_near_pair(model, workspace, k):
    """Whether half-pair k is the last one of its pair, and its solids are near in any lane."""
    other = model.half_pair[k].next_in_pair
    if other > k:
        return False
    slots = workspace.half_pair[k].slots
    while other != k:
        slots += workspace.half_pair[other].slots
        other = model.half_pair[other].next_in_pair
    return slots > 0


@stage
def count_partners(model, workspace):
    """Counts for each dynamic body the solids that are near it in any lane."""
    bodies = model.dynamic.shape[0]
    for m in range(bodies):
        workspace.solid[m].partners = 0
    for k in range(model.half_pair.shape[0]):
        if closes_near_pair(model, workspace, k):
            for solid in (model.half_pair[k].owner, model.half_pair[k].surface):
                if solid < bodies:
                    workspace.solid[solid].partners += 1


@stage
def pair_normal(model, workspace, k):
    """Writes the mean normal of a pair in the last step, zero where it didn't touch.

    And its shear loads. k: the last half-pair of the pair, which keeps them.
    """
    first = model.half_pair[k]
    owner, normal, loads = first.owner, workspace.half_pair[k].normal, workspace.half_pair[k].loads
    one, two = first.owner_shear_load, first.surface_shear_load
    row = 0 if owner < first.surface else 1
    for c in range(3):
        for i in range(LANES):
            normal[c, i] = 0.0
    for c in range(2):
        for i in range(LANES):
            loads[c, i] = 0.0
    other = k
    while True:
        half_pair, live = model.half_pair[other], workspace.half_pair[other]
        for i in range(LANES):
            loads[row, i] += live.previous_weight[i] * at(one, i)
            loads[1 - row, i] += live.previous_weight[i] * at(two, i)
        if half_pair.kind == PLANE:  # its normal is the z axis
            for i in range(LANES):
                normal[2, i] += live.previous_weight[i]
        else:
            own, sign = live.previous_normal, 1.0 if half_pair.owner == owner else -1.0
            for c in range(3):
                for i in range(LANES):
                    normal[c, i] += sign * own[c, i]
        other = half_pair.next_in_pair
        if other == k:
            break
    for i in range(LANES):
        x, y, z = normal[0, i], normal[1, i], normal[2, i]
        square = x * x + y * y + z * z
        inverse = 1.0 / math.sqrt(square) if square > 0.0 else 0.0
        normal[0, i] = inverse * x
        normal[1, i] = inverse * y
        normal[2, i] = inverse * z


@stage
def add_normal(solid, normal, load, plane):
    """Adds n n^T and the shear load to the sums of a body."""
    sums = solid.normals
    for i in range(LANES):
        sums[6, i] += load[i]
    if plane:
        for i in range(LANES):
            sums[2, i] += normal[2, i]
    else:
        for i in range(LANES):
            x, y, z = normal[0, i], normal[1, i], normal[2, i]
            sums[0, i] += x * x
            sums[1, i] += y * y
            sums[2, i] += z * z
            sums[3, i] += x * y
            sums[4, i] += x * z
            sums[5, i] += y * z


@stage
def add_parts(solid, inverse_mass, pair_mass, normal, plane, spring_part, live):
    """Adds what a body adds to the parts of a pair: n - 1, weighted by its inverse mass.

    Exactly 0 where it touched one solid or none. Also limits the pair's grip, and marks pairs of
    bodies that touched others.
    """
    sums, parts, supported, grip = solid.normals, live.parts, live.supported, live.grip
    for i in range(LANES):
        # the number of solids, but for round-off
        solids = sums[0, i] + sums[1, i] + sums[2, i]
        several = solids > 1.5
        z = normal[2, i]
        n = sums[2, i] * z * z
        own = z * z
        if not plane:
            x, y = normal[0, i], normal[1, i]
            own += x * x + y * y
            n += sums[0, i] * x * x + sums[1, i] * y * y
            n += 2.0 * (sums[3, i] * x * y + sums[4, i] * x * z + sums[5, i] * y * z)
        more = max(n - 1.0, 0.0) if several else 0.0
        parts[i] += more * at(inverse_mass, i) * at(pair_mass, i)
        supported[i] = 1.0 if solids - own > 0.5 else supported[i]
        held = grip_of(sums[6, i], at(spring_part, i))
        grip[i] = min(grip[i], held if several else 1.0)


@stage
def pair_parts(model, workspace, k):
    """Writes into how many parts the mass of a pair is split.

    That is the mean of n of its two bodies, with their inverse masses as weights. Also writes
    their grip, and whether one of them touched another solid in the last step. k: the last
    half-pair of the pair; the others get a copy.
    """
    half_pair, live = model.half_pair[k], workspace.half_pair[k]
    owner, surface = workspace.solid[half_pair.owner], workspace.solid[half_pair.surface]
    parts, normal, plane = live.parts, live.normal, half_pair.kind == PLANE
    supported, grip = live.supported, live.grip
    one, two, pair_mass = (
        half_pair.owner_inverse_mass,
        half_pair.surface_inverse_mass,
        half_pair.pair_mass,
    )
    for i in range(LANES):
        parts[i] = 1.0
        supported[i] = 0.0
        grip[i] = 1.0
    if owner.partners > 1:
        add_parts(owner, one, pair_mass, normal, plane, half_pair.spring_part, live)
    if surface.partners > 1:
        add_parts(surface, two, pair_mass, normal, plane, half_pair.spring_part, live)
    other = half_pair.next_in_pair
    while other != k:
        same = workspace.half_pair[other]
        for i in range(LANES):
            same.parts[i] = parts[i]
            same.supported[i] = supported[i]
            same.grip[i] = grip[i]
        other = model.half_pair[other].next_in_pair


@stage
def split_masses(model, workspace):
    """Splits the masses of all bodies that can touch several solids."""
    count_partners(model, workspace)
    for m in range(model.dynamic.shape[0]):
        if workspace.solid[m].partners > 1:
            sums = workspace.solid[m].normals
            for c in range(NORMAL_SUMS):
                for i in range(LANES):
                    sums[c, i] = 0.0
    for k in range(model.half_pair.shape[0]):
        half_pair = model.half_pair[k]
        owner, surface = workspace.solid[half_pair.owner], workspace.solid[half_pair.surface]
        several = owner.partners > 1 or surface.partners > 1
        if several and closes_near_pair(model, workspace, k):
            pair_normal(model, workspace, k)
            normal, plane = workspace.half_pair[k].normal, half_pair.kind == PLANE
            loads, swapped = workspace.half_pair[k].loads, half_pair.owner > half_pair.surface
            row = 1 if swapped else 0
            if owner.partners > 1:
                add_normal(owner, normal, loads[row], plane)
            if surface.partners > 1:
                add_normal(surface, normal, loads[1 - row], plane)
    for k in range(model.half_pair.shape[0]):
        if closes_near_pair(model, workspace, k):
            pair_parts(model, workspace, k)
