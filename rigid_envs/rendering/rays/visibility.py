"""Which primitive each pixel shows, and at what depth."""

import math

from physics.compiler.jit import stage
from rigid_envs.rendering.rays.intersections import (
    SPHERE,
    TRIANGLE,
    half_extents,
    intersection,
)


@stage
def bounds(camera, x, y, z, radius, rows, columns):
    """First and last row and column (exclusive) of the pixels that a sphere may cover."""
    px, py, pz = x - camera.eye[0], y - camera.eye[1], z - camera.eye[2]
    axes = camera.axes
    right = px * axes[0, 0] + py * axes[0, 1] + pz * axes[0, 2]
    up = px * axes[1, 0] + py * axes[1, 1] + pz * axes[1, 2]
    depth = px * axes[2, 0] + py * axes[2, 1] + pz * axes[2, 2]
    if depth <= -radius:
        return 0, 0, 0, 0
    square = depth * depth - radius * radius
    if (depth <= radius) | (square <= 1e-6 * depth * depth):
        return 0, rows, 0, columns
    # tangents from the eye, in the plane of forward and right, and of forward and up
    k = camera.focal / square
    across, along = radius * math.sqrt(right * right + square), radius * math.sqrt(up * up + square)
    limit = 1e6  # far outside, and an integer for sure
    left = min(max(camera.half_width + k * (right * depth - across), -limit), limit)
    end = min(max(camera.half_width + k * (right * depth + across), -limit), limit)
    top = min(max(camera.half_height - k * (up * depth + along), -limit), limit)
    bottom = min(max(camera.half_height - k * (up * depth - along), -limit), limit)
    return (
        max(math.floor(top), 0), min(math.ceil(bottom), rows),
        max(math.floor(left), 0), min(math.ceil(end), columns),
    )  # fmt: skip


@stage
def seen_from(primitive, x, y, z):
    """A point of the world in a primitive's frame."""
    p = primitive.position
    return turned_into(primitive, x - p[0], y - p[1], z - p[2])


@stage
def turned_into(primitive, x, y, z):
    """A direction of the world in a primitive's frame."""
    A = primitive.axes
    return (
        A[0, 0] * x + A[0, 1] * y + A[0, 2] * z,
        A[1, 0] * x + A[1, 1] * y + A[1, 2] * z,
        A[2, 0] * x + A[2, 1] * y + A[2, 2] * z,
    )


@stage
def turned_out_of(primitive, x, y, z):
    """A direction of a primitive's frame in the world."""
    A = primitive.axes
    return (
        A[0, 0] * x + A[1, 0] * y + A[2, 0] * z,
        A[0, 1] * x + A[1, 1] * y + A[2, 1] * z,
        A[0, 2] * x + A[1, 2] * y + A[2, 2] * z,
    )


@stage
def sight(camera, row, column):
    """The direction in which a point of the picture is seen; a unit of it is a unit of depth."""
    x = (column - camera.half_width) * camera.pixel
    y = (camera.half_height - row) * camera.pixel
    A = camera.axes
    return (
        A[2, 0] + x * A[0, 0] + y * A[1, 0],
        A[2, 1] + x * A[0, 1] + y * A[1, 1],
        A[2, 2] + x * A[0, 2] + y * A[1, 2],
    )


@stage
def pixels_of(p, camera, rows, columns):
    """First and last row and column (exclusive) of the pixels that a primitive may cover.

    Those of the sphere around it, and of the box around it, which is tighter for slender shapes.
    """
    x, y, z = p.position[0], p.position[1], p.position[2]
    top, bottom, left, right = bounds(camera, x, y, z, p.reach, rows, columns)
    if (p.kind == SPHERE) | (p.kind == TRIANGLE):
        return top, bottom, left, right
    a, b, c = half_extents(p.kind, p.size[0], p.size[1], p.size[2])
    low_u, high_u, low_v, high_v = math.inf, -math.inf, math.inf, -math.inf
    A = camera.axes
    for k in range(8):
        ex, ey, ez = turned_out_of(p, a if k & 1 else -a, b if k & 2 else -b, c if k & 4 else -c)
        ex, ey, ez = ex + x - camera.eye[0], ey + y - camera.eye[1], ez + z - camera.eye[2]
        depth = A[2, 0] * ex + A[2, 1] * ey + A[2, 2] * ez
        if depth < camera.near:
            return top, bottom, left, right
        scale = camera.focal / depth
        u = camera.half_width + scale * (A[0, 0] * ex + A[0, 1] * ey + A[0, 2] * ez)
        v = camera.half_height - scale * (A[1, 0] * ex + A[1, 1] * ey + A[1, 2] * ez)
        low_u, high_u = min(low_u, u), max(high_u, u)
        low_v, high_v = min(low_v, v), max(high_v, v)
    # a sphere's pixels lie within the picture, so these are integers
    return (
        math.floor(max(low_v, top)), math.ceil(min(high_v, bottom)),
        math.floor(max(low_u, left)), math.ceil(min(high_u, right)),
    )  # fmt: skip


@stage
def find_nearest(primitives, camera, depth, shown):
    """The nearest primitive of every pixel.

    Args:
        primitives: [n], of PRIMITIVE.
        camera: a record of CAMERA.
        depth: [rows, columns] m; at first that of the ground, infinite above the horizon.
        shown: [rows, columns], at first -1: the ground, or nothing.
    """
    rows, columns = depth.shape
    A = camera.axes
    for n in range(len(primitives)):
        p = primitives[n]
        top, bottom, left, right = pixels_of(p, camera, rows, columns)
        kind, a, b, c = p.kind, p.size[0], p.size[1], p.size[2]
        ox, oy, oz = seen_from(p, camera.eye[0], camera.eye[1], camera.eye[2])
        rx, ry, rz = turned_into(p, A[0, 0], A[0, 1], A[0, 2])
        ux, uy, uz = turned_into(p, A[1, 0], A[1, 1], A[1, 2])
        fx, fy, fz = turned_into(p, A[2, 0], A[2, 1], A[2, 2])
        for row in range(top, bottom):
            y = (camera.half_height - row - 0.5) * camera.pixel
            lx, ly, lz = fx + y * ux, fy + y * uy, fz + y * uz
            for column in range(left, right):
                x = (column + 0.5 - camera.half_width) * camera.pixel
                t, _, _, _ = intersection(
                    kind, a, b, c, ox, oy, oz, lx + x * rx, ly + x * ry, lz + x * rz
                )
                if (t < depth[row, column]) & (t > camera.near):
                    depth[row, column] = t
                    shown[row, column] = n
