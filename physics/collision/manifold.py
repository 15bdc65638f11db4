"""Four points are enough for two faces: which of a pair's candidates an impulse law is to use.

Rounds of Gauss-Seidel need more turns, and in a tower swing up, the more points share a load. So of
all candidates that would touch with the same face, both ways round, those four stay that span the
largest patch, with the weight of all. They are chosen when the lists are made: until then another
sample can get as deep as the skin is wide, if a body turns about those chosen.
"""

import math
from functools import cache

from physics.jit import at, kernel
from physics.motion.vectors import cross, turned
from physics.scene.shapes import PARTICLES

# normals of the same face agree better than this
_ALIKE = 0.99
# shares of the skin by which a point must lie deeper to be chosen for that alone, and of the
# largest area that a triangle must have to count
_DEEPER, _FLAT = 0.1, 0.05


@kernel
def note(near, surface, i, x, y, z, nx, ny, nz, gap):
    """Notes a candidate that lies at x y z in the frame of a surface."""
    R, c = surface.rotation, surface.position
    px, py, pz = turned(R, i, x, y, z)
    near.position[0] = px + c[0, i]
    near.position[1] = py + c[1, i]
    near.position[2] = pz + c[2, i]
    px, py, pz = turned(R, i, nx, ny, nz)
    near.normal[0] = px
    near.normal[1] = py
    near.normal[2] = pz
    near.gap = gap
    near.chosen = 1


@kernel
def _apart(a, b):
    """Vector from a's position to b's."""
    return (
        b.position[0] - a.position[0],
        b.position[1] - a.position[1],
        b.position[2] - a.position[2],
    )


@kernel
def _area(a, b, c, normal):
    """Twice the area of a triangle seen along a normal; its sign is its sense."""
    ux, uy, uz = _apart(a, b)
    vx, vy, vz = _apart(a, c)
    px, py, pz = cross(ux, uy, uz, vx, vy, vz)
    return px * normal[0] + py * normal[1] + pz * normal[2]


@kernel
def _farthest(near, n, group, x, y, z, highest):
    """Index of the group's point farthest from a place, and the square of the distance.

    Of those only whose gap is at most `highest`.
    """
    best, far = 0, -1.0
    for j in range(n):
        if near[j].group == group and near[j].gap <= highest:
            dx, dy, dz = near[j].position[0] - x, near[j].position[1] - y, near[j].position[2] - z
            square = dx * dx + dy * dy + dz * dz
            # twins that lie together must not take turns
            if square > far * (1.0 + 1e-6):
                best, far = j, square
    return best, far


@kernel
def _span(near, n, group, deepest, skin, x, y, z):
    """Four of a group whose middle is x y z, or fewer if they lie in line; -1 for none."""
    low = near[deepest].gap + _DEEPER * skin
    first, far = _farthest(near, n, group, x, y, z, low)
    p, normal = near[first].position, near[deepest].normal
    second, far = _farthest(near, n, group, p[0], p[1], p[2], math.inf)
    least = _FLAT * far
    third, fourth, most, fewest = -1, -1, least, -least
    for j in range(n):
        if near[j].group == group:
            area = _area(near[first], near[second], near[j], normal)
            if area > most * (1.0 + 1e-6):
                third, most = j, area
            if area < fewest * (1.0 + 1e-6):
                fourth, fewest = j, area
    if third < 0 and fourth < 0:  # an edge lies on both its ends, whatever hangs farther out
        second, far = _farthest(near, n, group, p[0], p[1], p[2], low)
    return first, second, third, fourth


@kernel
def thin_group(near, n, group, skin):
    """Gathers the deepest candidate without a group and its like, and leaves four of them chosen.

    Returns:
        False if all candidates have a group.
    """
    deepest = -1
    for j in range(n):
        if near[j].group == 0 and (deepest < 0 or near[j].gap < near[deepest].gap):
            deepest = j
    if deepest < 0:
        return False
    normal = near[deepest].normal
    members, weight, x, y, z = 0, 0.0, 0.0, 0.0, 0.0
    for j in range(n):
        other = near[j].normal
        alike = normal[0] * other[0] + normal[1] * other[1] + normal[2] * other[2] > _ALIKE
        if near[j].group == 0 and (alike or j == deepest):
            near[j].group = group
            members += 1
            weight += near[j].weight
            x += near[j].position[0]
            y += near[j].position[1]
            z += near[j].position[2]
    if members <= 4:
        return True
    four = _span(near, n, group, deepest, skin, x / members, y / members, z / members)
    chosen = 0
    for j in range(n):
        if near[j].group == group:
            near[j].chosen = 1 if j in four else 0
            chosen += near[j].chosen
    for j in range(n):
        if near[j].group == group:
            near[j].weight = weight / chosen
    return True


@cache
def make_choose(features, clear):
    """Kernel that thins out the lists of one lane of a side and its mirror, just made."""
    friction, box, resistance = features.friction, features.box, features.resistance

    @kernel
    def move(candidate, ids, i, source, target):
        a, b = candidate[source], candidate[target]
        ids[target, i] = ids[source, i]
        b.weight[i] = a.weight[i]
        b.load[i] = a.load[i]
        if box:
            b.face[i] = a.face[i]
        for axis in range(3):
            b.sample[axis, i] = a.sample[axis, i]
            if friction:
                b.shear[axis, i] = a.shear[axis, i]
                b.pull[axis, i] = a.pull[axis, i]
            if resistance:
                b.twist[axis, i] = a.twist[axis, i]

    @kernel
    def drop(model, state, work, g, k, i, near):
        """Drops what isn't chosen from a side's list, and gives the others their new weights."""
        first, count = model.side[k].first_slot, work.side[k].count[i]
        candidate = state.candidate[g, first : first + count]
        ids = state.sample_id[g, first : first + count]
        kept = 0
        for n in range(count):
            if near[n].chosen:
                if kept != n:
                    move(candidate, ids, i, n, kept)
                candidate[kept].weight[i] = near[n].weight
                kept += 1
        for n in range(kept, count):
            clear(candidate[n], i)
        work.side[k].count[i] = kept

    @kernel
    def choose(model, state, work, g, k, i):
        side = model.side[k]
        if side.kind == PARTICLES:
            return
        mirror, count, near = side.mirror, work.side[k].count[i], work.near
        others = work.side[mirror].count[i] if mirror >= 0 else 0
        for j in range(count, count + others):
            for axis in range(3):
                near[j].normal[axis] = -near[j].normal[axis]
        n = count + others
        if n <= 4:
            return
        for j in range(n):
            s, slot = (k, j) if j < count else (mirror, j - count)
            near[j].weight = state.candidate[g, model.side[s].first_slot + slot].weight[i]
            near[j].group = 0
        group = 1
        while thin_group(near, n, group, at(side.skin, i)):
            group += 1
        drop(model, state, work, g, k, i, near[:count])
        if mirror >= 0:
            drop(model, state, work, g, mirror, i, near[count:n])

    return choose
