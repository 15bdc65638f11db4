"""The sun and the sky: the brightness of a surface.

The sun is a disc, of which `samples` points shine. A point of a surface sees each of them or not,
so that shadows are sharp where a solid touches the ground and soft far from it.
"""

import math

import numpy as np

from physics.compiler.jit import stage

Array = np.ndarray

TO_SUN = np.array([-0.22, -0.52, 0.825]) / np.linalg.norm([-0.22, -0.52, 0.825])
# rows are two unit vectors across the light, and the one to the sun
SUN_FRAME = np.vstack([np.linalg.svd(TO_SUN[None])[2][1:], TO_SUN])
SUN_SIZE = 0.03  # half-width over distance
SKY, UPWARDS, SUN = 0.60, 0.12, 0.44  # brightness of a surface: from all sides, from above, direct
SHARPNESS = 30  # exponent of the highlight
GROUND_SHADOW = (0.385, 0.36, 0.32)  # what full shadow takes of the ground; less blue, as the sky


def sun_points(samples: int) -> Array:
    """Directions [samples, 3] to points of the sun, at most 8, evenly on its disc.

    They lie on a sunflower's spiral. One sample is the middle of the sun: shadows are sharp.
    """
    if samples == 1:
        return TO_SUN[None].copy()
    k = np.arange(samples)
    radius, angle = SUN_SIZE * np.sqrt((k + 0.5) / samples), 2.4 * k
    aside = np.stack([radius * np.cos(angle), radius * np.sin(angle)], axis=1)
    return TO_SUN + aside @ SUN_FRAME[:2]


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
