"""How contacts respond to velocities, as `newton.py` sees them.

A contact that presses gives the impulse of a soft contact as in `sweep.py`, that of the end of the
step: -pressing (u n + bias), at least zero. Where solids are apart it acts if they would meet in
the step. Friction is a steep viscosity up to its limit: -across s, with the slip s and
across = min(sticking, limit / |s|). The limit is that of the normal impulse found so far.

Both are derivatives of convex functions of u, so the velocities that solve a step are the least of
an energy, which Newton's method finds from any start.
"""

import math

from physics.compiler.jit import LANES, at, stage
from physics.impulse.point_impulses import relative_velocity
from physics.impulse.sweep import ANCHOR_RATE, soft_response, target_approach
from physics.model.features import cached_by_features
from physics.scene.shapes import PLANE

# relative accuracy of the impulses
ACCURACY = 1e-4
# response of a contact that sticks, as a multiple of its effective mass: nearly rigid
STICKING = 1e5


@stage
def contact_impulse(row, i, approach, sx, sy, sz):
    """The impulse along the normal and across it, and the response across it.

    `approach` is u n + bias in m/s, (sx, sy, sz) the slip in m/s.
    """
    size = math.sqrt(sx * sx + sy * sy + sz * sz)
    across = min(row.sticking[i], row.limit[i] / max(size, 1e-300))
    return max(-row.pressing[i] * approach, 0.0), -across * sx, -across * sy, -across * sz, across


@cached_by_features
def make_set_responses(features):
    """Stage that writes how a half-pair's contacts respond, and the impulses that they lack."""
    friction = features.friction

    @stage
    def set_responses(pair, constants, rows, first, h, search):
        """`first`: row of the half-pair's first contact."""
        points, owner, surface = pair.points, pair.owner[0], pair.surface[0]
        stiffness, damping, frictions = constants.stiffness, constants.damping, constants.friction
        lacking, scale = search.lacking, search.scale
        radii, has_faces = constants.radius, constants.kind != PLANE
        for n in range(points.shape[0]):
            point, row = points[n], rows[first + n]
            for i in range(LANES):
                nx, ny, nz = point.normal[0, i], point.normal[1, i], point.normal[2, i]
                separation, weight = point.separation[i], point.weight[i]
                p = point.normal_impulse[i]
                ux, uy, uz = relative_velocity(owner, surface, point, i)
                un = ux * nx + uy * ny + uz * nz
                acting = weight * point.remaining[i]
                a, rate = soft_response(at(stiffness, i), at(damping, i), h, acting)
                rises = un + point.bend[i]
                approach = rises + target_approach(separation, rate, 1.0 / h)
                solved = (weight > 0.0) & (point.arrives[i] == 0.0)
                deep = has_faces & (weight > 0.0) & (separation < -at(radii, i))
                search.deep[i] = 1 if deep else search.deep[i]
                row.pressing[i] = a if solved else 0.0
                row.sticking[i] = STICKING * point.shear_mass[i]
                row.limit[i] = at(frictions, i) * max(p, 0.0) if solved else 0.0
                row.approach[i] = approach
                sx, sy, sz, px, py, pz = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
                if friction:
                    anchor, tangential = point.anchor, point.tangential_impulse
                    arms = point.slip_bend
                    sx = ux - un * nx + arms[0, i] + ANCHOR_RATE * anchor[0, i]
                    sy = uy - un * ny + arms[1, i] + ANCHOR_RATE * anchor[1, i]
                    sz = uz - un * nz + arms[2, i] + ANCHOR_RATE * anchor[2, i]
                    px, py, pz = tangential[0, i], tangential[1, i], tangential[2, i]
                row.slip[0, i] = sx
                row.slip[1, i] = sy
                row.slip[2, i] = sz
                pressed, fx, fy, fz, across = contact_impulse(row, i, approach, sx, sy, sz)
                row.along[i] = row.pressing[i] if pressed > 0.0 else 0.0
                row.across[i] = across
                along, gx, gy, gz = pressed - p, fx - px, fy - py, fz - pz
                row.change[0, i] = along * nx + gx
                row.change[1, i] = along * ny + gy
                row.change[2, i] = along * nz + gz
                # the response of a contact that slides is small: what it lacks counts for more
                gain = row.sticking[i] / across if across > 0.0 else 1.0
                missing = gx * gx + gy * gy + gz * gz
                lacking[i] += along * along + gain * missing
                # what a sweep would change
                m, mt = point.mass[i], point.shear_mass[i]
                along *= m / (m + row.along[i])
                share = mt / (mt + across)
                search.off[i] += along * along + share * share * missing
                scale[i] += p * p

    return set_responses


@stage
def response_times(point, row, i, x, y, z):
    """K u of a contact: the impulse that a small velocity takes from it."""
    nx, ny, nz = point.normal[0, i], point.normal[1, i], point.normal[2, i]
    across = row.across[i]
    along = (row.along[i] - across) * (x * nx + y * ny + z * nz)
    return across * x + along * nx, across * y + along * ny, across * z + along * nz
