"""Distance of a point from a mesh, from the signed distances at the nodes of its grid.

Between nodes the distance is interpolated trilinearly, and the normal is the gradient of that,
normalised. The normal therefore changes by a little from cell to cell of a round surface, and an
edge is rounded by about a cell.

Beyond the grid, for balls and capsules larger than its margin, the nearest point of the mesh is
searched. At a point q near the border it is q - d grad d. If c is nearest to a point p, it is
nearest to all points between c and p, too. So from a guess of c, q is the point between c and p
that is one margin from c, which gives the next c. The first guess is the nearest of some hundred
points of the surface. The distance is wrong by up to a tenth of a cell.

Positions and grids are looked up lane by lane. A loop over lanes then reads what was found.
"""

import math

from physics.compiler.jit import LANES, at, stage
from physics.meshes.distance_grid import MARGIN

# times that the nearest point is corrected; with 12 no test case is wrong by a tenth of a cell
_CORRECTIONS = 12
# cells beyond the bounding box up to which the grid is read directly
_MARGIN = MARGIN - 1.0


@stage
def _within(u, top):
    """A coordinate in cells, limited to the grid; a NaN to its border."""
    return u if (u > 0.0) & (u < top) else (top if u >= top else 0.0)


@stage
def interpolated(model, g, x, y, z):
    """Signed distance in m and its gradient at a point of grid g; beyond it, at its border."""
    grid, values = model.grid[g], model.grid_value
    inverse = 1.0 / grid.cell
    nx, ny, nz = grid.count[0], grid.count[1], grid.count[2]
    u = _within((x - grid.origin[0]) * inverse, nx - 1.0)
    v = _within((y - grid.origin[1]) * inverse, ny - 1.0)
    w = _within((z - grid.origin[2]) * inverse, nz - 1.0)
    i, j, k = min(int(u), nx - 2), min(int(v), ny - 2), min(int(w), nz - 2)
    u, v, w = u - i, v - j, w - k
    n = grid.first + (i * ny + j) * nz + k
    across, along = nz, ny * nz
    a, b = values[n], values[n + 1]
    c, d = values[n + across], values[n + across + 1]
    n += along
    e, f = values[n], values[n + 1]
    p, q = values[n + across], values[n + across + 1]
    # along z, then y, then x
    ab, cd, ef, gh = a + w * (b - a), c + w * (d - c), e + w * (f - e), p + w * (q - p)
    front, back = ab + v * (cd - ab), ef + v * (gh - ef)
    in_z = (1.0 - u) * ((1.0 - v) * (b - a) + v * (d - c)) + u * ((1.0 - v) * (f - e) + v * (q - p))
    in_y = (1.0 - u) * (cd - ab) + u * (gh - ef)
    distance = front + u * (back - front)
    return distance, (back - front) * inverse, in_y * inverse, in_z * inverse


@stage
def _length(x, y, z):
    return math.sqrt(x * x + y * y + z * z)


@stage
def _outside(position, low, high):
    """How far a coordinate is beyond an interval, with its sign; 0 within."""
    return max(position - high, 0.0) - max(low - position, 0.0)


@stage
def _beyond(model, g, x, y, z):
    """Vector in m from the nearest point of the bounding box of a grid's mesh."""
    low, high = model.grid[g].low, model.grid[g].high
    return (
        _outside(x, low[0], high[0]),
        _outside(y, low[1], high[1]),
        _outside(z, low[2], high[2]),
    )


@stage
def nearest_surface_point(model, g, x, y, z):
    """The surface point of grid g that is nearest to a point."""
    first, count, values = model.grid[g].first_point, model.grid[g].point_count, model.grid_value
    best, least = 0, math.inf
    for k in range(count):
        dx = x - values[first + 3 * k]
        dy = y - values[first + 3 * k + 1]
        dz = z - values[first + 3 * k + 2]
        square = dx * dx + dy * dy + dz * dz
        if square < least:
            best, least = k, square
    n = first + 3 * best
    return values[n], values[n + 1], values[n + 2]


@stage
def grid_distance(model, g, size, x, y, z):
    """Signed distance in m of a point from the mesh of grid g, and the normal there.

    Args:
        model: of the lane group.
        g: index of the grid.
        size: factor on all lengths of the mesh.
        x: m, of the point, in the mesh's frame.
        y: likewise.
        z: likewise.
    """
    x, y, z = x / size, y / size, z / size
    margin = _MARGIN * model.grid[g].cell
    bx, by, bz = _beyond(model, g, x, y, z)
    if not _length(bx, by, bz) > margin:
        distance, nx, ny, nz = interpolated(model, g, x, y, z)
    else:
        cx, cy, cz = nearest_surface_point(model, g, x, y, z)
        nx, ny, nz = x - cx, y - cy, z - cz
        distance = _length(nx, ny, nz)
        for _ in range(_CORRECTIONS):
            step = margin / distance
            qx, qy, qz = cx + step * nx, cy + step * ny, cz + step * nz
            d, gx, gy, gz = interpolated(model, g, qx, qy, qz)
            scale = d / max(_length(gx, gy, gz), 1e-12)
            cx, cy, cz = qx - scale * gx, qy - scale * gy, qz - scale * gz
            nx, ny, nz = x - cx, y - cy, z - cz
            distance = _length(nx, ny, nz)
    length = _length(nx, ny, nz)
    inverse = 1.0 / max(length, 1e-12)
    known = length > 1e-12
    return size * distance, nx * inverse, ny * inverse, nz * inverse if known else 1.0


@stage
def grid_separations(model, half_pair, i, relative, separation):
    """Writes lower bounds [samples] m of the separations of all samples from a mesh.

    Within the grid they are the distances, beyond it those of the bounding box.
    """
    R, c = relative.rotation, relative.position
    size, own = at(half_pair.surface_size, i), at(half_pair.owner_size, i)
    radius, g = at(half_pair.radius, i), half_pair.grid
    margin = _MARGIN * model.grid[g].cell
    for s in range(half_pair.sample_count):
        sample = model.sample[:, half_pair.first_sample + s]
        sx, sy, sz = own * sample[0], own * sample[1], own * sample[2]
        x = (R[0, i] * sx + R[1, i] * sy + R[2, i] * sz + c[0, i]) / size
        y = (R[3, i] * sx + R[4, i] * sy + R[5, i] * sz + c[1, i]) / size
        z = (R[6, i] * sx + R[7, i] * sy + R[8, i] * sz + c[2, i]) / size
        bx, by, bz = _beyond(model, g, x, y, z)
        distance = _length(bx, by, bz)
        if not distance > margin:
            distance = interpolated(model, g, x, y, z)[0]
        separation[s] = size * distance - radius


@stage
def grid_distances(model, k, candidate, relative):
    """Writes distance and normal of all candidates of a half-pair against a mesh."""
    half_pair = model.half_pair[k]
    R, c, g = relative.rotation, relative.position, half_pair.grid
    for n in range(candidate.shape[0]):
        row = candidate[n]
        for i in range(LANES):
            if row.weight[i] > 0.0:
                sx, sy, sz = row.sample[0, i], row.sample[1, i], row.sample[2, i]
                distance, nx, ny, nz = grid_distance(
                    model,
                    g,
                    at(half_pair.surface_size, i),
                    R[0, i] * sx + R[1, i] * sy + R[2, i] * sz + c[0, i],
                    R[3, i] * sx + R[4, i] * sy + R[5, i] * sz + c[1, i],
                    R[6, i] * sx + R[7, i] * sy + R[8, i] * sz + c[2, i],
                )
                row.distance[i] = distance
                row.normal[0, i] = nx
                row.normal[1, i] = ny
                row.normal[2, i] = nz
