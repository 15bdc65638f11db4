"""Contact manifolds of the impulse law: at most four points where two faces touch.

Sequential impulses need more sweeps, and make towers sway, the more points share a load. So of all
candidates of a pair that would touch on the same face, from both half-pairs, only four stay: those
that span the largest patch. They carry the weight of all. They are chosen when lists are replaced,
which is early: after a shift of half the rounding one of them may be off the other face.
A mesh keeps all its candidates: its round sides have many samples nearly in a plane, and on four
that span it, but are not the deepest, it would rock without end.
"""

import math

from physics.compiler.jit import at, stage
from physics.model.contact_memory import contact_memory
from physics.model.features import cached_by_features
from physics.model.workspace import MEETS
from physics.motion.vectors import cross, rotated
from physics.scene.shapes import PARTICLES

# cosine of the angle between normals of the same face, at least
_ALIKE = 0.99
# fraction of the skin by which a point must be deeper to be preferred for that alone
_DEEPER = 0.1
# fraction of the squared span below which twice a triangle's area is round-off
_SLIMMEST = 1e-6


@stage
def add_manifold_point(point, surface, i, x, y, z, nx, ny, nz, separation):
    """Writes a candidate at x y z with normal nx ny nz, both in the frame of a surface."""
    R, c = surface.rotation, surface.position
    px, py, pz = rotated(R, i, x, y, z)
    point.position[0] = px + c[0, i]
    point.position[1] = py + c[1, i]
    point.position[2] = pz + c[2, i]
    px, py, pz = rotated(R, i, nx, ny, nz)
    point.normal[0] = px
    point.normal[1] = py
    point.normal[2] = pz
    point.separation = separation
    point.chosen = 1


@stage
def _difference(a, b):
    """Vector from the position of a to that of b."""
    return (
        b.position[0] - a.position[0],
        b.position[1] - a.position[1],
        b.position[2] - a.position[2],
    )


@stage
def _area(a, b, c, normal):
    """Twice the signed area of a triangle seen along a normal."""
    ux, uy, uz = _difference(a, b)
    vx, vy, vz = _difference(a, c)
    px, py, pz = cross(ux, uy, uz, vx, vy, vz)
    return px * normal[0] + py * normal[1] + pz * normal[2]


@stage
def _farthest(manifold, n, face, x, y, z, low, highest):
    """Index of a face's point farthest from x y z, and its distance in m.

    Only points whose separation is at most `highest`. What is higher than `low` counts as nearer by
    that height: of two points above each other the lower one is the farther.
    """
    best, far = 0, -1.0
    for j in range(n):
        if manifold[j].face == face and manifold[j].separation <= highest:
            p = manifold[j].position
            dx, dy, dz = p[0] - x, p[1] - y, p[2] - z
            distance = math.sqrt(dx * dx + dy * dy + dz * dz)
            distance = max(distance - max(manifold[j].separation - low, 0.0), 0.0)
            # of coinciding points always take the first
            if distance > far * (1.0 + 1e-6):
                best, far = j, distance
    return best, far


@stage
def _span(manifold, n, face, deepest, deeper, x, y, z):
    """Four points of a face whose mean is x y z, fewer if they lie on a line; -1 for none."""
    low = manifold[deepest].separation + deeper
    first, far = _farthest(manifold, n, face, x, y, z, low, low)
    p, normal = manifold[first].position, manifold[deepest].normal
    second, far = _farthest(manifold, n, face, p[0], p[1], p[2], low, math.inf)
    least = _SLIMMEST * far * far
    third, fourth, most, fewest = -1, -1, least, -least
    for j in range(n):
        if manifold[j].face == face:
            area = _area(manifold[first], manifold[second], manifold[j], normal)
            # twice an area is `far` times a distance, which a height shortens as above
            lost = far * max(manifold[j].separation - low, 0.0)
            if area - lost > most * (1.0 + 1e-6):
                third, most = j, area - lost
            if area + lost < fewest * (1.0 + 1e-6):
                fourth, fewest = j, area + lost
    if third < 0 and fourth < 0:  # the ends of an edge, both of them deep
        second, far = _farthest(manifold, n, face, p[0], p[1], p[2], low, low)
    return first, second, third, fourth


@stage
def reduce_face(manifold, n, face, deeper):
    """Assigns a face number to the deepest free point and those with its normal; keeps four.

    At least one of them is at most `deeper` m less deep than the deepest.

    Returns:
        False if no point is free.
    """
    deepest = -1
    for j in range(n):
        separation = manifold[j].separation
        if manifold[j].face == 0 and (deepest < 0 or separation < manifold[deepest].separation):
            deepest = j
    if deepest < 0:
        return False
    normal = manifold[deepest].normal
    members, weight, x, y, z = 0, 0.0, 0.0, 0.0, 0.0
    for j in range(n):
        other = manifold[j].normal
        alike = normal[0] * other[0] + normal[1] * other[1] + normal[2] * other[2] > _ALIKE
        if manifold[j].face == 0 and (alike or j == deepest):
            manifold[j].face = face
            members += 1
            weight += manifold[j].weight
            x += manifold[j].position[0]
            y += manifold[j].position[1]
            z += manifold[j].position[2]
    if members <= 4:
        return True
    four = _span(manifold, n, face, deepest, deeper, x / members, y / members, z / members)
    chosen = 0
    for j in range(n):
        if manifold[j].face == face:
            manifold[j].chosen = 1 if j in four else 0
            chosen += manifold[j].chosen
    for j in range(n):
        if manifold[j].face == face:
            manifold[j].weight = weight / chosen
    return True


@cached_by_features
def make_manifold_reduction(features, clear):
    """Stage that reduces the lists, just made, of a half-pair and its reverse in one lane."""
    memory_size, mesh = contact_memory(features).size, features.mesh
    timed = features.finds_impacts

    @stage
    def move(candidate, ids, i, source, target):
        a, b = candidate[source], candidate[target]
        ids[target, i] = ids[source, i]
        b.weight[i] = a.weight[i]
        for axis in range(3):
            b.sample[axis, i] = a.sample[axis, i]
        for m in range(memory_size):
            b.memory[m, i] = a.memory[m, i]

    @stage
    def drop(model, state, workspace, g, k, i, manifold):
        """Removes what isn't chosen from a half-pair's list, and sets the weights of the others."""
        first, count = model.half_pair[k].first_slot, workspace.half_pair[k].count[i]
        candidate = state.candidate[g, first : first + count]
        ids = state.sample_id[g, first : first + count]
        kept = 0
        for n in range(count):
            if manifold[n].chosen:
                if kept != n:
                    move(candidate, ids, i, n, kept)
                candidate[kept].weight[i] = manifold[n].weight
                kept += 1
        for n in range(kept, count):
            clear(candidate[n], i)
        workspace.half_pair[k].count[i] = kept

    @stage
    def reduce_manifold(model, state, workspace, g, k, i):
        """Reduces the lists of lane i; whether any candidate was dropped."""
        half_pair = model.half_pair[k]
        if half_pair.kind == PARTICLES:
            return False
        if mesh and half_pair.keeps_all != 0:
            return False
        reverse, manifold = half_pair.reverse, workspace.manifold
        count = workspace.half_pair[k].count[i]
        others = workspace.half_pair[reverse].count[i] if reverse >= 0 else 0
        for j in range(count, count + others):
            for axis in range(3):
                manifold[j].normal[axis] = -manifold[j].normal[axis]
        n = count + others
        if n <= 4:
            return False
        for j in range(n):
            s, slot = (k, j) if j < count else (reverse, j - count)
            manifold[j].weight = state.candidate[g, model.half_pair[s].first_slot + slot].weight[i]
            manifold[j].face = 0
        face, deeper = 1, _DEEPER * at(half_pair.skin, i)
        if timed and workspace.clock[0].phase[i] == MEETS:  # what touches must be among the four
            deeper = half_pair.impact_tolerance
        while reduce_face(manifold, n, face, deeper):
            face += 1
        drop(model, state, workspace, g, k, i, manifold[:count])
        if reverse >= 0:
            drop(model, state, workspace, g, reverse, i, manifold[count:n])
        left = workspace.half_pair[k].count[i]
        left += workspace.half_pair[reverse].count[i] if reverse >= 0 else 0
        return left < n

    return reduce_manifold
