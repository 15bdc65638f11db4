"""Samples of solids of revolution turn about their solid's z axis until the first faces a surface.

The samples of a cylinder or torus lie on circles about its axis. On a solid of revolution they may
lie there at any angle, so they need not rotate with it: at every step they are turned such that the
first of each circle is the circle's point nearest to the surface. Fixed samples would make a
polygon of a wheel: with n corners it rises and falls by r (1 - cos(pi/n)), 0.5 % of the radius r at
n = 32, and loses energy at each corner.

Samples turn over a ground and over the face of a large static box, see `model.pairs.is_floor`. The
nearest point of a circle lies opposite to the normal of the plane. It is an extremum: its height
changes at the rate at which the material there moves. The other samples lie symmetric to it, so the
work of their turning cancels. So an elastic contact keeps its energy.

Over other surfaces it would not: where the circle is larger than the face below it, samples that
turn could leap over its border. (Elastic cylinders and boxes that hit each other at random gained
up to five times their energy.) There fixed samples are used.

A circle parallel to the surface has no nearest point. It keeps the angle at which it is in the
body, because of a bias: a tilt of BIAS rad that is added to the real one. Evenly spaced samples,
three or more, resist any tilt as a whole circle does, whatever their angle.
"""

import math

from physics.collision.distances import core_distance
from physics.compiler.jit import stage
from physics.scene.shapes import BOX, PLANE

# kinds of surface over which samples turn
FLOORS = (PLANE, BOX)

# rad. It displaces the lowest point of a circle that is tilted by more by BIAS / tilt rad at most.
# At 1e-6 a ring that lies under the impulse law wobbles on at 0.01 rad/s, by a micrometre: its
# samples turn with the wobble. At 1e-3 elastic landings of a ring gain 0.3 % of energy, at 1e-4 as
# little as without a bias
BIAS = 1e-4


@stage
def _turned(x, y, mx, my, mz):
    """Turns x y about z such that x points against the normal m, given in the body's frame."""
    # none for a body on its side, which rolls
    dx, dy = BIAS * mz * mz - mx, -my
    length = math.sqrt(dx * dx + dy * dy)
    inverse = 1.0 / max(length, 1e-150)
    cosine = dx * inverse if length > 1e-150 else 1.0
    sine = dy * inverse
    return cosine * x - sine * y, sine * x + cosine * y


@stage
def _over_plane(x, y, z, R, c, i, ca, cb, cc):
    return _turned(x, y, R[6, i], R[7, i], R[8, i])


def facing(kind):
    """Stage that turns a sample x y z of an axial solid towards one of the `FLOORS`.

    Its arguments: the sample in the solid's frame in m; the solid's rotation R and position c
    relative to the surface; the lane; the parameters of the surface's core. It returns x and y.
    """
    if kind == PLANE:
        return _over_plane
    distance = core_distance(kind)

    @stage
    def turn(x, y, z, R, c, i, ca, cb, cc):
        # the centre of the sample's circle
        px, py, pz = R[2, i] * z + c[0, i], R[5, i] * z + c[1, i], R[8, i] * z + c[2, i]
        _, nx, ny, nz = distance(px, py, pz, ca, cb, cc, 0.0, False)
        mx = R[0, i] * nx + R[3, i] * ny + R[6, i] * nz
        my = R[1, i] * nx + R[4, i] * ny + R[7, i] * nz
        mz = R[2, i] * nx + R[5, i] * ny + R[8, i] * nz
        return _turned(x, y, mx, my, mz)

    return turn
