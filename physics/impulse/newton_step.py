"""What a solution of the matrix does to contacts, and how much of it is taken.

Along the solution dv the energy that Newton's method makes less has the slope

    sum J dv (p + part dp - p(u + part J dv))

over the contacts, with the impulse p now, its change dp by the solution and the impulse p(u) of
`contact_responses.py`. Where contacts open, close or begin to slide on the way, the whole solution
can be too much; the part at which the slope vanishes is then found by bisection.
"""

from physics.compiler.jit import LANES, stage
from physics.impulse.contact_responses import contact_impulse, response_times
from physics.impulse.point_impulses import apply_impulse
from physics.model.features import cached_by_features
from physics.motion.vectors import cross


@stage
def set_changes(pair, rows, first, v, w, u, q, slope):
    """Writes the changes of velocities and impulses of contacts, and adds the slope at the start.

    v, w: changes of the owner's velocity and angular velocity; u, q: of the surface's.
    """
    points = pair.points
    for n in range(points.shape[0]):
        point, row = points[n], rows[first + n]
        for i in range(LANES):
            ax, ay, az = point.arm[0, i], point.arm[1, i], point.arm[2, i]
            bx, by, bz = point.surface_arm[0, i], point.surface_arm[1, i], point.surface_arm[2, i]
            ox, oy, oz = cross(w[0, i], w[1, i], w[2, i], ax, ay, az)
            rx, ry, rz = cross(q[0, i], q[1, i], q[2, i], bx, by, bz)
            x = v[0, i] + ox - u[0, i] - rx
            y = v[1, i] + oy - u[1, i] - ry
            z = v[2, i] + oz - u[2, i] - rz
            fx, fy, fz = response_times(point, row, i, x, y, z)
            gx, gy, gz = row.change[0, i], row.change[1, i], row.change[2, i]
            row.velocity_change[0, i] = x
            row.velocity_change[1, i] = y
            row.velocity_change[2, i] = z
            row.change[0, i] = gx - fx
            row.change[1, i] = gy - fy
            row.change[2, i] = gz - fz
            slope[i] -= x * gx + y * gy + z * gz


@cached_by_features
def make_add_slopes(features):
    """Stage that adds the slope of the energy at a part of the solution."""
    friction = features.friction

    @stage
    def add_slopes(pair, rows, first, part, slope):
        points = pair.points
        for n in range(points.shape[0]):
            point, row = points[n], rows[first + n]
            for i in range(LANES):
                nx, ny, nz = point.normal[0, i], point.normal[1, i], point.normal[2, i]
                velocity, f = row.velocity_change, part[i]
                x, y, z = velocity[0, i], velocity[1, i], velocity[2, i]
                along = x * nx + y * ny + z * nz
                sx = row.slip[0, i] + f * (x - along * nx)
                sy = row.slip[1, i] + f * (y - along * ny)
                sz = row.slip[2, i] + f * (z - along * nz)
                approach = row.approach[i] + f * along
                pressed, fx, fy, fz, _ = contact_impulse(row, i, approach, sx, sy, sz)
                size = point.normal_impulse[i] - pressed
                px = size * nx - fx + f * row.change[0, i]
                py = size * ny - fy + f * row.change[1, i]
                pz = size * nz - fz + f * row.change[2, i]
                if friction:
                    px += point.tangential_impulse[0, i]
                    py += point.tangential_impulse[1, i]
                    pz += point.tangential_impulse[2, i]
                slope[i] += x * px + y * py + z * pz

    return add_slopes


@stage
def begin_search(search):
    """Tries the whole solution, in worlds that aren't solved yet."""
    for i in range(LANES):
        search.least[i] = 0.0
        search.most[i] = 1.0
        search.steepest[i] = -search.slope[i]
        search.part[i] = 1.0 if search.unsolved[i] != 0 else 0.0


@stage
def bisect_parts(search):
    """Corrects the parts whose slope is more than half of that at the start; how many those are."""
    count = 0
    for i in range(LANES):
        part, slope, flat = search.part[i], search.slope[i], 0.5 * search.steepest[i]
        uphill, downhill = slope > flat, (slope < -flat) & (part < 1.0)
        if (search.unsolved[i] != 0) & (uphill | downhill):
            search.most[i] = part if uphill else search.most[i]
            search.least[i] = search.least[i] if uphill else part
            search.part[i] = 0.5 * (search.least[i] + search.most[i])
            count += 1
    return count


@cached_by_features
def make_apply_part(features):
    """Stage that gives the contacts of a half-pair a part of the solution's impulses."""
    friction = features.friction

    @stage
    def apply_part(pair, rows, first, part):
        points = pair.points
        for n in range(points.shape[0]):
            point, row = points[n], rows[first + n]
            for i in range(LANES):
                nx, ny, nz = point.normal[0, i], point.normal[1, i], point.normal[2, i]
                f = part[i]
                gx = f * row.change[0, i] if f > 0.0 else 0.0
                gy = f * row.change[1, i] if f > 0.0 else 0.0
                gz = f * row.change[2, i] if f > 0.0 else 0.0
                along = gx * nx + gy * ny + gz * nz
                point.normal_impulse[i] += along
                if friction:
                    tangential = point.tangential_impulse
                    tangential[0, i] += gx - along * nx
                    tangential[1, i] += gy - along * ny
                    tangential[2, i] += gz - along * nz
                apply_impulse(pair, point, i, gx, gy, gz)

    return apply_part
