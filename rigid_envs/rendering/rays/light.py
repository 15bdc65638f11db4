"""The sun and the sky: where solids hide the sun, and the brightness of a surface.

The sun is a disc, of which `samples` points shine. A point of a surface sees each of them or not,
so that shadows are sharp where a solid touches the ground and soft far from it.
"""

import math

import numpy as np

from physics.compiler.jit import stage
from rigid_envs.rendering.rays.intersections import TORUS, TRIANGLE, intersection
from rigid_envs.rendering.rays.visibility import bounds, seen_from, sight, turned_into

Array = np.ndarray

TO_SUN = np.array([-0.22, -0.52, 0.825]) / np.linalg.norm([-0.22, -0.52, 0.825])
SUN_SIZE = 0.06  # half-width over distance
SKY, UPWARDS, SUN = 0.60, 0.12, 0.44  # brightness of a surface: from all sides, from above, direct
SHARPNESS = 30  # exponent of the highlight
GROUND_SHADOW = (0.385, 0.36, 0.32)  # what full shadow takes of the ground; less blue, as the sky
_SELF = 1e-4  # of its reach, how far from itself a hollow solid can hide the sun


def sun_points(samples: int) -> Array:
    """Directions [samples, 3] to points of the sun, at most 8, evenly on its disc.

    They lie on a sunflower's spiral. One sample is the middle of the sun: shadows are sharp.
    """
    if samples == 1:
        return TO_SUN[None].copy()
    across = np.linalg.svd(TO_SUN[None])[2][1:]
    k = np.arange(samples)
    radius, angle = SUN_SIZE * np.sqrt((k + 0.5) / samples), 2.4 * k
    return TO_SUN + np.stack([radius * np.cos(angle), radius * np.sin(angle)], axis=1) @ across


@stage
def find_shadows(primitives, camera, sun, points, depth, shown, hidden):
    """Which points of the sun are hidden from what each pixel shows.

    A primitive's shadow lies between the sphere around it and that sphere's shadow on the ground,
    so its pixels lie in a rectangle around both.

    Args:
        primitives: [n], of PRIMITIVE.
        camera: a record of CAMERA.
        sun: [3], unit vector to its middle.
        points: [samples, 3], directions to points of it.
        depth: [rows, columns] m.
        shown: [rows, columns], which primitive, or -1.
        hidden: [rows, columns], of a bit for each sample; at first 0.
    """
    rows, columns = depth.shape
    spread = SUN_SIZE if len(points) > 1 else 0.0
    every = (1 << len(points)) - 1
    for n in range(len(primitives)):
        p = primitives[n]
        px, py, pz, reach = p.position[0], p.position[1], p.position[2], p.reach
        top, bottom, left, right = bounds(camera, px, py, pz, reach, rows, columns)
        way = max(pz, 0.0) / sun[2]
        foot = (reach + spread * way) / sun[2]
        x, y = px - way * sun[0], py - way * sun[1]
        top2, bottom2, left2, right2 = bounds(camera, x, y, 0.0, foot, rows, columns)
        if bottom2 > top2 and right2 > left2:
            if bottom > top and right > left:
                top, bottom = min(top, top2), max(bottom, bottom2)
                left, right = min(left, left2), max(right, right2)
            else:
                top, bottom, left, right = top2, bottom2, left2, right2
        kind, a, b, c = p.kind, p.size[0], p.size[1], p.size[2]
        hollow = (kind == TRIANGLE) | (kind == TORUS)
        for row in range(top, bottom):
            for column in range(left, right):
                t = depth[row, column]
                own = shown[row, column] == n
                if (t == math.inf) | (hidden[row, column] == every) | (own & (not hollow)):
                    continue
                dx, dy, dz = sight(camera, row + 0.5, column + 0.5)
                x, y, z = camera.eye[0] + t * dx, camera.eye[1] + t * dy, camera.eye[2] + t * dz
                vx, vy, vz = px - x, py - y, pz - z
                way = vx * sun[0] + vy * sun[1] + vz * sun[2]
                room = reach + spread * max(way, 0.0)
                aside = vx * vx + vy * vy + vz * vz - way * way
                if (way < -reach) | (aside > room * room):
                    continue
                ox, oy, oz = seen_from(p, x, y, z)
                least = _SELF * reach if hollow else 0.0
                found = hidden[row, column]
                for s in range(len(points)):
                    ex, ey, ez = turned_into(p, points[s, 0], points[s, 1], points[s, 2])
                    at, _, _, _ = intersection(
                        kind, a, b, c,
                        ox + least * ex, oy + least * ey, oz + least * ez, ex, ey, ez,
                    )  # fmt: skip
                    if at < math.inf:
                        found |= 1 << s
                hidden[row, column] = found


@stage
def sunlit(hidden, samples):
    """Share of the sun that is seen, from the bits of the hidden points."""
    count = 0
    for s in range(samples):
        count += (hidden >> s) & 1
    return 1.0 - count / samples


@stage
def brightness(nx, ny, nz, ex, ey, ez, sun, lit, gloss):
    """Of a surface with a unit normal, seen along (ex, ey, ez): (diffuse, highlight in 0..255)."""
    direct = max(nx * sun[0] + ny * sun[1] + nz * sun[2], 0.0) * lit
    diffuse = SKY + UPWARDS * nz + SUN * direct
    shine = 0.0
    if (gloss > 0.0) & (direct > 0.0):
        k = 1.0 / math.sqrt(ex * ex + ey * ey + ez * ez)
        hx, hy, hz = sun[0] - k * ex, sun[1] - k * ey, sun[2] - k * ez
        k = 1.0 / math.sqrt(hx * hx + hy * hy + hz * hz)
        shine = 255.0 * gloss * lit * max(k * (nx * hx + ny * hy + nz * hz), 0.0) ** SHARPNESS
    return diffuse, shine
