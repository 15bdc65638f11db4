"""Rows of working memory of the impulse law and of Newton's method, see `workspace`."""

import numpy as np

from physics.compiler.jit import LANES

# one row per candidate of a pair while a manifold of four points is chosen among them
MANIFOLD_POINT = np.dtype(
    [
        ("position", "f8", (3,)),  # m, world frame
        ("normal", "f8", (3,)),  # out of the surface of the pair's first half-pair, world frame
        ("separation", "f8"),  # m
        ("weight", "f8"),
        ("face", "i8"),  # number of the face, counted from 1, that it belongs to; 0 before
        ("chosen", "i8"),
    ],
    align=True,
)

# one row per slot, of the impulse law; all vectors in the world frame
CONTACT_ROW = np.dtype(
    [
        ("normal", "f8", (3, LANES)),  # out of the surface
        ("arm", "f8", (3, LANES)),  # m, from the owner's centre
        ("surface_arm", "f8", (3, LANES)),  # m, from the surface's centre
        ("separation", "f8", (LANES,)),  # m, negative if they overlap
        ("weight", "f8", (LANES,)),
        # m/s that curvature adds to the separation rate: over the next drift, and, taken from it,
        # over the last one, see impulse/contact_rows.py
        ("bend", "f8", (LANES,)),
        ("last_bend", "f8", (LANES,)),
        ("slip_bend", "f8", (3, LANES)),  # m/s, see impulse/moving_arms.py
        ("last_slip_bend", "f8", (3, LANES)),  # m/s, of the last drift
        ("turned", "f8", (LANES,)),  # m/s, part of u n by a spin that moves no sample
        ("approach", "f8", (LANES,)),  # m/s, in the last drift; then after the impacts of the step
        ("rest_speed", "f8", (LANES,)),  # m/s, closing speed up to which it counts as at rest
        # 1: what pushed its solids apart in the last step has been removed before a collision
        ("relaxed", "f8", (LANES,)),
        # 1: closes the gap so fast, before the step's forces, that it is left to collide
        ("arrives", "f8", (LANES,)),
        ("mass", "f8", (LANES,)),  # kg, effective mass along the normal
        ("shear_mass", "f8", (LANES,)),  # kg, smallest effective mass across it
        # part of the step in which its impulses act: 1; after a collision what remains of it
        ("remaining", "f8", (LANES,)),
        ("normal_impulse", "f8", (LANES,)),  # N s
        ("tangential_impulse", "f8", (3, LANES)),  # N s
        ("twist", "f8", (3, LANES)),  # N m s against rolling and spinning
        # given in this step beyond the impulses above: by the relaxation sweep, before a collision,
        # and in a refresh by collisions
        ("extra_impulse", "f8", (3, LANES)),  # N s
        ("extra_angular_impulse", "f8", (3, LANES)),  # N m s
        ("anchor", "f8", (3, LANES)),  # m, creep since the point came to stick
        # of an instantaneous collision
        ("impact_restitution", "f8", (LANES,)),  # -1 where it takes no part
        ("collides", "f8", (LANES,)),  # 1, or 0
        ("impact_target", "f8", (LANES,)),  # m/s, separation rate that compression ends with
        ("normal_impact", "f8", (LANES,)),  # N s
        ("tangential_impact", "f8", (3, LANES)),  # N s
        # of the part of the step before a collision
        ("half_impulse", "f8", (3, LANES)),  # N s
        ("half_twist", "f8", (3, LANES)),  # N m s
        # of compression alone, and the least normal impulse after restitution
        ("compression", "f8", (LANES,)),  # N s
        ("tangential_compression", "f8", (3, LANES)),  # N s
        ("least_impact", "f8", (LANES,)),  # N s
    ],
    align=True,
)

# one row per slot, of Newton's method; vectors in the world frame
RESPONSE_ROW = np.dtype(
    [
        ("pressing", "f8", (LANES,)),  # kg, response along the normal while it presses
        ("sticking", "f8", (LANES,)),  # kg, response across it while it sticks
        ("limit", "f8", (LANES,)),  # N s, of friction
        ("approach", "f8", (LANES,)),  # m/s, below zero the contact presses
        ("slip", "f8", (3, LANES)),  # m/s
        ("along", "f8", (LANES,)),  # kg, response along the normal at this velocity
        ("across", "f8", (LANES,)),  # kg, across it
        ("change", "f8", (3, LANES)),  # N s: what is lacking, then what the solution adds
        ("velocity_change", "f8", (3, LANES)),  # m/s, by the solution
        ("kept_normal", "f8", (LANES,)),  # N s, before the first iteration
        ("kept_tangential", "f8", (3, LANES)),  # N s, likewise
    ],
    align=True,
)

# one row per block of the matrix of Newton's method, on or below the diagonal
BLOCK = np.dtype([("entry", "f8", (9 * LANES,)), ("used", "i8")], align=True)
# one row per row of blocks: right side, then solution
BLOCK_VECTOR = np.dtype([("component", "f8", (3, LANES))], align=True)
# sums over the contacts of a half-pair, see impulse/contact_matrix.py
CONTACT_SUM = np.dtype([("entry", "f8", (9 * LANES,))], align=True)
CONTACT_SUMS = 8

# a single row
SEARCH = np.dtype(
    [
        ("moves", "i8", (LANES,)),  # 1: sweeps correct the impulses of this world
        ("unsolved", "i8", (LANES,)),
        ("deep", "i8", (LANES,)),  # 1: an overlap is deeper than the rounding of edges
        ("lacking", "f8", (LANES,)),  # (N s)^2, sum over contacts
        ("off", "f8", (LANES,)),  # (N s)^2, likewise of what a sweep would change
        ("scale", "f8", (LANES,)),  # (N s)^2, sum of squares of normal impulses
        ("part", "f8", (LANES,)),  # of the solution that is taken, see impulse/newton_step.py
        ("slope", "f8", (LANES,)),  # J, of the energy there
        ("steepest", "f8", (LANES,)),  # J, minus that at the start
        ("least", "f8", (LANES,)),  # the part is between these two
        ("most", "f8", (LANES,)),
    ],
    align=True,
)

# one row per solid
TENSOR = np.dtype([("component", "f8", (6, LANES))], align=True)  # 1/(kg m^2): xx yy zz xy xz yz
