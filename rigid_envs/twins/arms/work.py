"""What is known of the arms of a lane group within a step, and working memory: one record.

Its fields have sizes that compilers know.
"""

import numpy as np

from physics.compiler.jit import LANES

JOINTS = 7  # n, hinges of each arm
ROWS = JOINTS + 3  # of what limits impulses: motors, and a table along three axes
WIDTH = 12  # of arrays of rows: whole vectors

WORK = np.dtype(
    [
        (name, np.float64, (*shape, LANES))
        for name, shape in (
            # hinges: rad, rad/s
            ("angles", (JOINTS,)),
            ("speeds", (JOINTS,)),
            # frames of links and of the hand: rotation, and origin in m
            ("rotation", (JOINTS + 1, 3, 3)),
            ("origin", (JOINTS + 1, 3)),
            # how the hand moves with the hinges: m/s and rad/s per rad/s
            ("jacobian", (6, JOINTS)),
            # mass matrix in kg m^2, its factors, factors with what slows hinges down, and the
            # torque in N m that keeps the speeds
            ("mass_matrix", (JOINTS, JOINTS)),
            ("factored", (2, JOINTS, JOINTS)),
            ("bias", (JOINTS,)),
            # of the dynamics: velocity of what turns about a hinge with 1 rad/s; inertia about the
            # world's origin of a link, later of all that it carries (mass, first moments x, y, z,
            # moments of inertia xx, yy, zz, xy, xz, yz); forces; others
            ("axis", (JOINTS, 6)),
            ("body", (JOINTS, 10)),
            ("force", (JOINTS, 6)),
            ("spatial", (4, 6)),
            # the hand in the engine, m and m/s; how far it is asked to move, and where to, m
            ("position", (3,)),
            ("velocity", (3,)),
            ("asked", (3,)),
            ("target", (3,)),
            ("aim", (JOINTS,)),  # rad, of motors
            # of a table: distance from it in m, impulse on the hand in N s in the substep before
            ("gap", ()),
            ("pressed", ()),
            ("sides", (ROWS,)),  # of rows of `limits`
            # height in m of what is below the hand, and with which force in N it presses on it
            ("support", ()),
            ("load", ()),
            # working memory
            ("matrix", (5, JOINTS, JOINTS)),
            ("vector", (5, JOINTS)),
        )
    ]
    # of one world: limited impulses, see `limits`, and a table's rows of the Jacobian
    + [
        (name, np.float64, shape)
        for name, shape in (
            ("system", (ROWS, WIDTH)),
            ("contact", (3, JOINTS)),
            *((field, (WIDTH,)) for field in ("lack", "low", "high", "side", "impulse", "gain")),
            *((field, (WIDTH,)) for field in ("given", "found", "new_side", "column", "scaled")),
        )
    ]
)
