"""The arrays of a heap: what its kernels read and write.

Bodies are sorted by where they are; a *place* is an index in that order, LANES of them make a lane
group. The particles of a body follow each other, in the order of places. Work is divided into SLABS
*slabs* whatever the number of threads, and sums are made in the order of the slabs, so the result
does not depend on the number of threads.
"""

from typing import NamedTuple

import numpy as np

from physics.compiler.jit import LANES

Array = np.ndarray

# Parts of the work. Two threads share them evenly even if one of the cores is busy for a while;
# each part has forces of its own on the bodies near its border, which are summed afterwards
SLABS = 16

# one row per lane group of places
BODY = np.dtype(
    [
        ("position", "f8", (3, LANES)),  # m
        ("orientation", "f8", (4, LANES)),
        ("momentum", "f8", (3, LANES)),  # kg m/s
        ("angular_momentum", "f8", (3, LANES)),  # kg m^2/s
        ("force", "f8", (3, LANES)),  # N
        ("torque", "f8", (3, LANES)),  # N m
        # when the list of neighbours was made
        ("listed_position", "f8", (3, LANES)),  # m
        ("listed_orientation", "f8", (4, LANES)),
    ],
    align=True,
)

# columns of Heap.motion: what a contact reads of a body
CENTER, VELOCITY, SPIN, TURN = 0, 3, 6, 9  # m, m/s, rad/s, quaternion x y z w
# 1/kg; row and column of Model.contact; of its particles; and the largest eigenvalue of a step's
# friction on it in the last step, see spring/mass_splitting.py
INVERSE_MASS, CLASS, WEIGHT, SHEAR_LOAD, MOTION = range(13, 18)

# one row per pair of classes of bodies, or class of body and static. Classes have the same material
# and shape, up to size. The kernel derives stiffness and friction from it and from the two masses
CONTACT = np.dtype(
    [
        ("unit_stiffness", "f8"),  # 1/s^2, of a pair mass of 1 kg
        ("stiffness", "f8"),  # N/m of the materials, or 0: unit_stiffness times the pair mass
        ("damping", "f8"),  # ratio of the dashpot
        ("friction", "f8"),
        ("shear_ratio", "f8"),  # see `tangential_coefficients`
        ("leverage", "f8"),  # likewise, of both
        ("first_compliance", "f8"),  # inverse shear mass of the owner times its mass
        ("second_compliance", "f8"),  # likewise of the surface; 0 for statics
    ],
    align=True,
)

# one row per static
STATIC = np.dtype(
    [
        ("kind", "i8"),
        ("position", "f8", (3,)),  # m
        ("rotation", "f8", (9,)),  # matrix, row by row
        ("core", "f8", (3,)),  # m, parameters of its surface
        ("radius", "f8"),  # m, rounding
    ],
    align=True,
)

# one row per level of the grid: a grid for each class of sizes
LEVEL = np.dtype(
    [
        ("cells_per_meter", "f8"),
        ("base", "i8"),  # number of its first cell
        ("count", "i8", (3,)),  # cells along x, y and z without the border
        ("largest_radius", "f8"),  # m, of its particles
    ],
    align=True,
)

# elements of Heap.counts
# force evaluations that contacts remember; which of two lists is valid; lists since the bodies were
# sorted; steps since the list was made; 0: the list must be made again
EVALUATION, PARITY, REBUILDS, SINCE, VALID, COUNTS = range(6)
# elements of Heap.scale
# m, the skin; and corners of the box that the grid covers
SKIN, LOW, HIGH, SCALES = 0, 1, 4, 7


class Constants(NamedTuple):
    """What never changes.

    Attributes:
        contact: [classes, classes] of CONTACT, owner first.
        static_contact: [classes, statics] of CONTACT.
        static: [statics] of STATIC.
        skins: [2] m, smallest and largest skin.
        step: s, `Fidelity.substep`, for which tangential coefficients hold.
    """

    contact: Array
    static_contact: Array
    static: Array
    skins: Array
    step: float


class Heap(NamedTuple):
    """One world: hidden state included. A deep copy continues bitwise identically.

    Attributes:
        order: [bodies] index in the scene of the body at each place.
        rank: [bodies] of a pair, the body with the lower one is the owner of the contact.
        dynamic: [1] of DYNAMIC if all bodies are equal; else [groups] with a value for each lane.
        reach: [groups * LANES] m, from the centre to the farthest point of the surface.
        first: [groups * LANES + 1] first particle of each place.
        body_of: [n] place of the body of each particle.
        level_of: [n] level of each particle in the grid.
        local: [n, 4] x y z in the body's frame, and radius; m. Of one body if all are equal.
        body: [groups] of BODY.
        particle: [n, 4] x y z in the world, and radius; m.
        motion: [groups * LANES, MOTION] see CENTER.
        pair: [lists, SLABS, room, 2] particles of the neighbours, owner first.
        pair_count: [lists, SLABS].
        pair_range: [lists, n, 2] which pairs the search found from each particle, as index into
            the flattened slabs and number; empty without history.
        shear: [lists, SLABS * room, 4] N, force of the tangential spring in the frame of the
            second body, and the evaluation in which they last touched; empty without history.
        wall: [lists, SLABS, room, 2] particle and static of neighbours.
        wall_count: [lists, SLABS].
        wall_range: [lists, n, 2] likewise.
        wall_shear: [lists, SLABS * room, 4] N, in the world frame, and the evaluation.
        force_range: [SLABS, 3] first and last place on which a slab's pairs act, and where these
            begin in `Scratch.force`.
        counts: [COUNTS] see EVALUATION.
        scale: [SCALES] see SKIN.
    """

    order: Array
    rank: Array
    dynamic: Array
    reach: Array
    first: Array
    body_of: Array
    level_of: Array
    local: Array
    body: Array
    particle: Array
    motion: Array
    pair: Array
    pair_count: Array
    pair_range: Array
    shear: Array
    wall: Array
    wall_count: Array
    wall_range: Array
    wall_shear: Array
    force_range: Array
    counts: Array
    scale: Array

    @property
    def nbytes(self) -> int:
        """Bytes of all arrays."""
        return sum(array.nbytes for array in self)


# columns of Scratch.moved: largest motion of any particle; largest due to rotation; and smallest
# and largest displacement of a centre along x, y and z; all in m
MOST, ROTATION, LEAST_OF, MOST_OF, MOVES = 0, 1, 2, 5, 8
# elements of Scratch.result
# see DONE; steps that have been made; room that is needed; 1: the forces that are computed next
# belong to no step
STATUS, STEPS, NEEDED, REFRESH, RESULTS = range(5)
# why a call returns
DONE, SORT, MORE_PAIRS, MORE_WALLS, MORE_FORCES, DIVERGED = range(6)
# elements of Scratch.sync: counter of the barrier; and for each thread one of its slabs that have
# been taken, TICKETS apart, so that each has a cache line
BARRIER, TICKET, TICKETS = 0, 32, 8


class Scratch(NamedTuple):
    """Working memory, whose content means nothing between two calls of `advance`.

    Attributes:
        solid: [threads] of SOLID.
        block: [threads, ROWS * BLOCK] contacts that are being computed, see pair_forces.py.
        touching: [threads, room] indices of pairs that touch.
        near: [threads, n] neighbours of a particle.
        force: [room, 8] force and torque on a body, of one slab.
        cell_of: [n] cell of each particle.
        cell_range: [SLABS, 2] smallest and largest of them, of the particles of a slab of bodies.
        cell_start: [cells + 1].
        level: [levels] of LEVEL.
        sorted_particle: [n, 4] `Heap.particle`, sorted by cell.
        sorted_index: [n] of these.
        moved: [SLABS, MOVES, LANES] motion since the list was made, see MOST.
        bad: [SLABS] place of the first body that isn't finite, or -1.
        total: [SLABS] particles in a range of cells; then pairs that a slab has found.
        wall_total: [SLABS] likewise pairs with statics.
        result: [RESULTS] see STATUS.
        sync: [TICKET + TICKETS * threads] see BARRIER.
    """

    solid: Array
    block: Array
    touching: Array
    near: Array
    force: Array
    cell_of: Array
    cell_range: Array
    cell_start: Array
    level: Array
    sorted_particle: Array
    sorted_index: Array
    moved: Array
    bad: Array
    total: Array
    wall_total: Array
    result: Array
    sync: Array


class HeapFeatures(NamedTuple):
    """Compile-time switches of the kernels of heaps.

    Attributes:
        integrator: MIDPOINT or EULER.
        rotation: ISOTROPIC or GENERAL.
        friction: some pair has friction.
        viscous: viscous friction, without history.
        equal: all bodies are equal.
        kinds: kinds of surface of the statics.
    """

    integrator: int
    rotation: int
    friction: bool
    viscous: bool
    equal: bool
    kinds: tuple[int, ...]

    @property
    def history(self) -> bool:
        """Whether contacts remember their tangential spring."""
        return self.friction and not self.viscous
