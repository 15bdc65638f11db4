"""Where solids hide the sun.

Primitives are sorted into the cells of a grid that lies across the sunlight, each into all cells
that its shadow may reach. What a point of a surface sees of the sun, only the primitives of its
cell can hide.
"""

import math

from physics.compiler.jit import stage
from rigid_envs.rendering.rays.intersections import (
    BOX,
    FAR,
    TORUS,
    TRIANGLE,
    grown,
    intersection,
    shrunk,
)
from rigid_envs.rendering.rays.light import SUN_SIZE
from rigid_envs.rendering.rays.visibility import bounds, seen_from, sight, turned_into

MOST_CELLS = 256  # along one side of the grid
CELLS = 3.0  # along one side, by the root of the number of primitives
# of its reach, how far from a surface a solid begins to hide the sun: nearer, rounding would decide
_CLOSE = 1e-4
_ASLANT = 1.002  # rays to the sun's rim pass a sphere's middle by so much farther
_STRAY = 8.0  # mean distances from the mean place, beyond which bodies don't stretch the grid


@stage
def _shadow_radius(p, sun, spread):
    """m, of a disc across the light that holds a primitive's shadow, down to the ground."""
    return _ASLANT * p.reach + spread * max(p.position[2] + p.reach, 0.0) / sun[2]


@stage
def _across(frame, x, y, z):
    """Coordinates of a point across the light: the first two rows of `frame` [3, 3]."""
    return (
        frame[0, 0] * x + frame[0, 1] * y + frame[0, 2] * z,
        frame[1, 0] * x + frame[1, 1] * y + frame[1, 2] * z,
    )


@stage
def _cells_of(u, v, radius, left, bottom, cell, side):
    """First and last cell along both sides (inclusive) that a disc may reach."""
    return (
        min(max(math.floor((u - radius - left) / cell), 0), side - 1),
        min(max(math.floor((u + radius - left) / cell), 0), side - 1),
        min(max(math.floor((v - radius - bottom) / cell), 0), side - 1),
        min(max(math.floor((v + radius - bottom) / cell), 0), side - 1),
    )


@stage
def sort_into_cells(primitives, order, frame, spread, starts, entries):
    """Lists the primitives of every cell, those nearest to the sun first.

    The grid has several cells for each primitive, or fewer if the lists would not fit.
    It leaves out the few that may be far from all others.

    Args:
        primitives: [n], of PRIMITIVE.
        order: [n], their indices, those nearest to the sun first.
        frame: [3, 3], rows are two unit vectors across the light, and the one to the sun.
        spread: half-width of the sun over its distance.
        starts: [cells + 1], on return where each cell's list begins.
        entries: [capacity, at least n], on return the lists.

    Returns:
        (left, bottom, cell, side): corner of the grid and width of a cell in m, cells along a side.
    """
    sun, count = frame[2], len(primitives)
    middle_u, middle_v, apart = 0.0, 0.0, 0.0
    for n in range(count):
        p = primitives[n].position
        u, v = _across(frame, p[0], p[1], p[2])
        middle_u, middle_v = middle_u + u / count, middle_v + v / count
    for n in range(count):
        p = primitives[n].position
        u, v = _across(frame, p[0], p[1], p[2])
        apart += max(abs(u - middle_u), abs(v - middle_v)) / count
    left, right, bottom, top = middle_u, middle_u, middle_v, middle_v
    for n in range(count):
        p = primitives[n]
        u, v = _across(frame, p.position[0], p.position[1], p.position[2])
        if max(abs(u - middle_u), abs(v - middle_v)) <= _STRAY * apart:
            radius = _shadow_radius(p, sun, spread)
            left, right = min(left, u - radius), max(right, u + radius)
            bottom, top = min(bottom, v - radius), max(top, v + radius)
    width = max(right - left, top - bottom)
    side = min(math.ceil(CELLS * math.sqrt(len(primitives))), MOST_CELLS)
    while True:
        cell = width / side
        for k in range(side * side + 1):
            starts[k] = 0
        total = 0
        for n in range(len(primitives)):
            p = primitives[n]
            u, v = _across(frame, p.position[0], p.position[1], p.position[2])
            radius = _shadow_radius(p, sun, spread)
            u0, u1, v0, v1 = _cells_of(u, v, radius, left, bottom, cell, side)
            total += (u1 - u0 + 1) * (v1 - v0 + 1)
            if total > len(entries):
                break
            for b in range(v0, v1 + 1):
                for a in range(u0, u1 + 1):
                    starts[b * side + a + 1] += 1
        if total <= len(entries):
            break
        side = max(side // 2, 1)
    for k in range(side * side):
        starts[k + 1] += starts[k]
    # from the last to the first, so that every cell's list is filled from its end
    for k in range(len(order) - 1, -1, -1):
        p = primitives[order[k]]
        u, v = _across(frame, p.position[0], p.position[1], p.position[2])
        radius = _shadow_radius(p, sun, spread)
        u0, u1, v0, v1 = _cells_of(u, v, radius, left, bottom, cell, side)
        for b in range(v0, v1 + 1):
            for a in range(u0, u1 + 1):
                slot = b * side + a + 1
                starts[slot] -= 1
                entries[starts[slot]] = order[k]
    # the end of a cell's list has become its start: they are one place too far
    for k in range(side * side):
        starts[k] = starts[k + 1]
    starts[side * side] = total
    return left, bottom, cell, side


@stage
def find_spans(primitives, camera, sun, spread, columns, spans):
    """First and last column (exclusive) of the pixels in each row that show solids or shadows.

    Every pixel shows a solid, within the sphere around it, or the ground, which only that sphere's
    shadow can reach.

    Args:
        primitives: [n], of PRIMITIVE.
        camera: a record of CAMERA.
        sun: [3], unit vector.
        spread: half-width of the sun over its distance.
        columns: of the picture.
        spans: [rows, 2], is written.
    """
    rows = len(spans)
    for row in range(rows):
        spans[row, 0], spans[row, 1] = columns, 0
    for n in range(len(primitives)):
        p = primitives[n]
        x, y, z, reach = p.position[0], p.position[1], p.position[2], p.reach
        for end in range(2):
            radius = reach
            if end == 1:
                way = max(z, 0.0) / sun[2]
                # rays to the sun's lowest point are the flattest
                low = sun[2] - spread * math.sqrt(1.0 - sun[2] * sun[2])
                radius = (reach + spread * way) / low
                x, y, z = x - way * sun[0], y - way * sun[1], 0.0
            top, bottom, left, right = bounds(camera, x, y, z, radius, rows, columns)
            for row in range(top, bottom):
                spans[row, 0], spans[row, 1] = min(spans[row, 0], left), max(spans[row, 1], right)


@stage
def find_shadows(
    primitives, order, camera, frame, points, depth, shown, starts, entries, slabs, spans, hidden
):
    """Which points of the sun are hidden from what each pixel shows.

    Args:
        primitives: [n], of PRIMITIVE.
        order: [n], their indices, those nearest to the sun first.
        camera: a record of CAMERA.
        frame: [3, 3], rows are two unit vectors across the light, and the one to the sun.
        points: [samples, 3], directions to points of the sun.
        depth: [rows, columns] m.
        shown: [rows, columns], which primitive, or -1.
        starts: [MOST_CELLS^2 + 1], working memory.
        entries: [at least n], working memory.
        slabs: [at least n, samples + 1, 6], working memory.
        spans: [rows, 2], is written, see `find_spans`.
        hidden: [rows, columns], of a bit for each sample; at first 0.
    """
    spread = SUN_SIZE if len(points) > 1 else 0.0
    find_spans(primitives, camera, frame[2], spread, depth.shape[1], spans)
    if len(primitives) == 0:
        return
    sun, every, largest = frame[2], (1 << len(points)) - 1, 0.0
    for n in range(len(primitives)):
        largest = max(largest, primitives[n].reach)
        if primitives[n].kind == BOX:
            for s in range(len(points)):
                _slabs(primitives[n], points[s, 0], points[s, 1], points[s, 2], slabs[n, s])
            _slabs(primitives[n], sun[0], sun[1], sun[2], slabs[n, len(points)])
    left, low, cell, side = sort_into_cells(primitives, order, frame, spread, starts, entries)
    per_cell = 1.0 / cell
    ex, ey, ez = camera.eye[0], camera.eye[1], camera.eye[2]
    eye_u, eye_v = _across(frame, ex, ey, ez)
    across_u, across_v = _across(frame, camera.axes[0, 0], camera.axes[0, 1], camera.axes[0, 2])
    for row in range(len(spans)):
        # a pixel's place across the light is linear in its column and its depth
        dx, dy, dz = sight(camera, row + 0.5, camera.half_width)
        row_u, row_v = _across(frame, dx, dy, dz)
        for column in range(spans[row, 0], spans[row, 1]):
            t = depth[row, column]
            if t == math.inf:
                continue
            x = (column + 0.5 - camera.half_width) * camera.pixel
            u, v = eye_u + t * (row_u + x * across_u), eye_v + t * (row_v + x * across_v)
            a, b = math.floor((u - left) * per_cell), math.floor((v - low) * per_cell)
            if (a < 0) | (b < 0) | (a >= side) | (b >= side):
                continue
            if starts[b * side + a] == starts[b * side + a + 1]:
                continue
            dx, dy, dz = sight(camera, row + 0.5, column + 0.5)
            x, y, z = ex + t * dx, ey + t * dy, ez + t * dz
            own, found = shown[row, column], 0
            for k in range(starts[b * side + a], starts[b * side + a + 1]):
                p = primitives[entries[k]]
                vx, vy, vz = p.position[0] - x, p.position[1] - y, p.position[2] - z
                way = vx * sun[0] + vy * sun[1] + vz * sun[2]
                if way < -largest:
                    break  # this one and all that follow are behind the point
                hollow = (p.kind == TRIANGLE) | (p.kind == TORUS)
                room = _ASLANT * p.reach + spread * max(way, 0.0)
                aside = vx * vx + vy * vy + vz * vz - way * way
                itself = (own == entries[k]) & (not hollow)
                if itself | (way < -p.reach) | (aside > room * room):
                    continue
                found |= _hidden_by(
                    p, x, y, z, points, slabs[entries[k]], sun, spread, max(way, 0.0)
                )
                if found == every:
                    break
            hidden[row, column] = found


@stage
def _slabs(p, ex, ey, ez, slabs):
    """Of a box and rays along a direction: what doesn't depend on where the rays begin.

    `slabs` [6]: the inverse of the direction's components, and half the time within each pair of
    the box's planes. A component of 0 has a very large inverse.
    """
    dx, dy, dz = turned_into(p, ex, ey, ez)
    for k, e in enumerate((dx, dy, dz)):
        slabs[k] = 1.0 / e if e != 0.0 else FAR
        slabs[k + 3] = abs(slabs[k]) * p.size[k]


@stage
def _meets_box(ox, oy, oz, least, slabs, by):
    """Whether a ray from (ox, oy, oz) meets a box that is larger by `by`, from `least` on."""
    mx, my, mz = -ox * slabs[0], -oy * slabs[1], -oz * slabs[2]
    hx = slabs[3] + by * abs(slabs[0])
    hy = slabs[4] + by * abs(slabs[1])
    hz = slabs[5] + by * abs(slabs[2])
    near = max(mx - hx, max(my - hy, mz - hz))
    far = min(mx + hx, min(my + hy, mz + hz))
    return (near <= far) & (far >= least)


@stage
def _hidden_by_box(p, ox, oy, oz, samples, slabs, aside):
    """As `_hidden_by`, in the box's frame; `slabs` [samples + 1, 6], the last is of the middle."""
    least, found = _CLOSE * p.reach, 0
    if aside > 0.0:
        if not _meets_box(ox, oy, oz, 0.0, slabs[samples], aside):
            return found
        thick = min(p.size[0], min(p.size[1], p.size[2])) > aside
        if thick and _meets_box(ox, oy, oz, 0.0, slabs[samples], -aside):
            return (1 << samples) - 1
    for s in range(samples):
        found |= _meets_box(ox, oy, oz, least, slabs[s], 0.0) << s
    return found


@stage
def _hidden_by(p, x, y, z, points, slabs, sun, spread, way):
    """Bits of the points of the sun that a primitive hides from a point of a surface.

    The rays to all points pass the primitive within `spread` times the distance of the middle one:
    if that misses the primitive grown by so much, none is hidden; if it meets the primitive shrunk
    by so much, all are.
    """
    ox, oy, oz = seen_from(p, x, y, z)
    aside = spread * (way + p.reach)
    if p.kind == BOX:
        return _hidden_by_box(p, ox, oy, oz, len(points), slabs, aside)
    least, found = _CLOSE * p.reach, 0
    if (spread > 0.0) & (p.kind != TRIANGLE):
        ex, ey, ez = turned_into(p, sun[0], sun[1], sun[2])
        a, b, c = grown(p.kind, p.size[0], p.size[1], p.size[2], aside)
        at, _, _, _ = intersection(p.kind, a, b, c, ox, oy, oz, ex, ey, ez)
        if at == math.inf:
            return found
        if p.kind != TORUS:
            a, b, c = shrunk(p.kind, p.size[0], p.size[1], p.size[2], aside)
            if a > 0.0:
                at, _, _, _ = intersection(p.kind, a, b, c, ox, oy, oz, ex, ey, ez)
                if at < math.inf:
                    return (1 << len(points)) - 1
    for s in range(len(points)):
        ex, ey, ez = turned_into(p, points[s, 0], points[s, 1], points[s, 2])
        at, _, _, _ = intersection(
            p.kind, p.size[0], p.size[1], p.size[2],
            ox + least * ex, oy + least * ey, oz + least * ez, ex, ey, ez,
        )  # fmt: skip
        if at < math.inf:
            found |= 1 << s
    return found
