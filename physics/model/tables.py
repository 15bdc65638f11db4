"""The constants of a scene at a fidelity: one table per kind of thing, with named columns.

Solids are the dynamic bodies (the scene's bodies, then its drives), then the statics. A pair of
solids touches through one or two half-pairs: the samples of one solid, the owner, against the
surface of the other.

Identical worlds share one row per dynamic body and half-pair. With per-world parameters each lane
group (LANES worlds side by side) has rows of its own, and the columns named in *_PER_WORLD hold one
value per lane. Kernels read both kinds by `at` of `physics.compiler.jit`, which compiles to nothing
where worlds are identical.
"""

from typing import NamedTuple

import numpy as np

from physics.compiler.jit import LANES

Array = np.ndarray

# one row per dynamic body. A drive never rotates: its inertia is infinite
DYNAMIC = np.dtype(
    [
        ("is_body", "i8"),  # 1 for a body, 0 for a drive
        ("rotation", "i8"),  # that of the scene, see `features`: of kernels for any rotation
        ("core_reach", "f8"),  # m, from the centre to the farthest point that rotation moves
        ("inverse_mass", "f8"),  # 1/kg
        ("inertia", "f8", (3,)),  # kg m^2, principal moments; infinite for drives
        ("inverse_inertia", "f8", (3,)),  # 1/(kg m^2); 0 for drives
        ("weight", "f8", (3,)),  # N; 0 for drives, whose carriage holds them
        ("servo_stiffness", "f8"),  # N/m
        ("servo_damping", "f8"),  # N s/m
        ("force_limit", "f8"),  # N along each axis
        ("gripper_partner", "i8"),  # index of the other finger of a gripper, or -1
        ("grip_limit", "f8"),  # N between the two fingers
    ],
    align=True,
)
DYNAMIC_PER_WORLD = ("core_reach", "inverse_mass", "inertia", "inverse_inertia", "weight")

# one row per half-pair
HALF_PAIR = np.dtype(
    [
        ("owner", "i8"),  # solid that carries the samples
        ("surface", "i8"),  # solid whose surface they are tested against
        ("frame", "i8"),  # row of Workspace.solid in whose frame that surface is described
        ("kind", "i8"),  # of that surface
        ("reverse", "i8"),  # half-pair of the same pair with the roles exchanged, or -1
        ("next_in_pair", "i8"),  # next half-pair of the same pair; the last one names the first
        ("first_sample", "i8"),  # into Model.sample
        ("sample_count", "i8"),
        ("extent", "f8", (3,)),  # m at size 1, half extents of the samples in the owner's frame
        ("first_partner", "i8"),  # into Model.sample: the particles of a particle surface
        ("partner_count", "i8"),
        ("first_slot", "i8"),  # into State.candidate
        ("slot_count", "i8"),
        ("grid", "i8"),  # row of Model.grid that is the surface, or -1
        ("keeps_all", "i8"),  # 1: a solid is a mesh, its manifold is not reduced
        ("axial", "i8"),  # 1: the samples turn to face the surface, see `collision.facing`
        ("driven", "i8"),  # 1: a solid is a drive
        ("face_normals", "i8"),  # 1: samples of what has faces, see `box_distance`
        # gravity of the owner less that of the surface, m/s^2, in the world frame
        ("gravity", "f8", (3,)),
        # slope above which a body slides on a ground or static, over mu: more than 1 if it can
        # roll; inf of other pairs
        ("slide_slope", "f8"),
        ("crowding", "f8"),  # factor on how fast damping relaxes, see `mesh_samples.pressed`
        ("core", "f8", (3,)),  # m, parameters of the surface's core
        ("owner_radius", "f8"),  # m, of the samples
        ("radius", "f8"),  # m, of the samples and the surface's rounding together
        ("owner_reach", "f8"),  # m, radius of the owner's bounding sphere
        ("surface_reach", "f8"),  # m, of the surface's
        ("owner_size", "f8"),  # factor on the samples' positions
        ("surface_size", "f8"),  # factor on the partners' positions
        ("load_share", "f8"),  # fraction of the pair's load, factor on the samples' weights
        ("skin", "f8"),  # m
        # of time control: m per substep that counts as slow, and m at which an impact has arrived
        ("free_motion", "f8"),
        ("impact_tolerance", "f8"),
        ("stiffness", "f8"),  # N/m of a whole face
        ("damping", "f8"),  # coefficient of the law
        # impulse law, of the soft contacts of sweeps: N/m and N s/m
        ("sweep_stiffness", "f8"),
        ("sweep_damping", "f8"),
        ("damping_error", "f8"),  # relative, per (omega h)^2, see normal_damping.py
        ("restitution", "f8"),
        # s in which the load of a contact gives it the closing speed that counts as rest: the lower
        # bound of the impact speed, or with impulses the fastest approach that is no collision
        ("rest_time", "f8"),
        ("rest_speed", "f8"),  # m/s, the same of the whole weight; time control makes no cut below
        ("pair_mass", "f8"),  # kg, reduced mass
        ("owner_inverse_mass", "f8"),  # 1/kg
        ("surface_inverse_mass", "f8"),  # 1/kg; 0 for statics
        ("overlap_share", "f8"),  # of the owner, see contact_point.py
        ("surface_centre", "f8", (3,)),  # m, centre of mass of the surface's solid, in its frame
        ("surface_inverse_inertia", "f8", (3,)),  # 1/(kg m^2) of that solid, where it matters
        ("shear_stiffness", "f8"),  # N/m
        ("shear_damping", "f8"),  # N s/m
        # eigenvalues of a step's friction and resistance if each body touches one solid only, see
        # spring/mass_splitting.py
        ("owner_shear_load", "f8"),
        ("surface_shear_load", "f8"),
        ("spring_part", "f8"),  # of these, due to the springs
        ("friction", "f8"),
        ("rolling", "f8"),  # m, rolling resistance
        ("spinning", "f8"),  # m, spinning resistance
        ("twist_stiffness", "f8"),  # N m
        ("twist_damping", "f8"),  # N m s
    ],
    align=True,
)
HALF_PAIR_PER_WORLD = (
    "core",
    "owner_radius",
    "radius",
    "owner_reach",
    "surface_reach",
    "owner_size",
    "surface_size",
    "load_share",
    "skin",
    "free_motion",
    "stiffness",
    "damping",
    "sweep_stiffness",
    "sweep_damping",
    "damping_error",
    "restitution",
    "rest_speed",
    "rest_time",
    "pair_mass",
    "owner_inverse_mass",
    "surface_inverse_mass",
    "overlap_share",
    "surface_centre",
    "surface_inverse_inertia",
    "shear_stiffness",
    "shear_damping",
    "owner_shear_load",
    "surface_shear_load",
    "spring_part",
    "friction",
    "twist_stiffness",
    "twist_damping",
)

# one row per part of a compound that has a surface of its own
COMPOUND_PART = np.dtype(
    [
        ("solid", "i8"),  # that it belongs to
        ("position", "f8", (3,)),  # m, of its centre in that solid's frame
        ("rotation", "f8", (9,)),  # matrix, row by row: the part's frame to that solid's
        ("first_hidden_face", "i8"),  # into Model.hidden_face
        ("hidden_face_count", "i8"),
    ],
    align=True,
)
COMPOUND_PART_PER_WORLD = ("position",)

# one row per rectangle of a part's face that another part hides, see `internal_faces.HiddenFace`
HIDDEN_FACE = np.dtype(
    [
        ("axis", "i8"),
        ("sign", "f8"),
        ("face", "f8"),  # m at size 1, as are the ends below
        ("low", "f8", (2,)),
        ("high", "f8", (2,)),
    ],
    align=True,
)

# one row per distance grid of a mesh, in the mesh's frame at size 1
GRID_TABLE = np.dtype(
    [
        ("first", "i8"),  # into Model.grid_value, where its distances begin
        ("count", "i8", (3,)),  # nodes along each axis
        ("origin", "f8", (3,)),  # m, of the first node
        ("cell", "f8"),  # m
        ("low", "f8", (3,)),  # m, corners of the mesh's bounding box
        ("high", "f8", (3,)),
        ("first_point", "i8"),  # likewise, where x y z of its surface points begin
        ("point_count", "i8"),
    ],
    align=True,
)

# one row per field and, of a Drag or SurfaceDrag on all bodies, per body
POINT_SPRING, ATTRACTOR, DRAG, SURFACE_DRAG = range(4)
FIELD = np.dtype(
    [
        ("kind", "i8"),
        ("body", "i8"),  # on which a spring or drag acts
        ("other", "i8"),  # body at the other end of a spring, or -1
        ("point", "f8", (3,)),  # m, where the spring is attached, in the body frame
        ("to", "f8", (3,)),  # m, its other end, in the frame of `other`; or the attractor
        ("stiffness", "f8"),  # N/m
        ("damping", "f8"),  # N s/m, of a spring or linear drag
        ("quadratic", "f8"),  # N s^2/m^2
        ("rest_length", "f8"),  # m
        ("strength", "f8"),  # m^(1 + exponent)/s^2
        ("exponent", "f8"),
        ("per_particle", "i8"),
        ("first_point", "i8"),  # into Model.surface_point, of a surface drag, as all below
        ("point_count", "i8"),
        ("pressure", "f8"),  # kg/m^3, half the density times the coefficient
        ("tangential", "f8"),  # kg/m^3, likewise of the friction
        ("flow", "f8", (3,)),  # m/s
        ("unit_inertia", "f8"),  # m^2, first moment of inertia over mass at size 1
    ],
    align=True,
)

# one row per scalar constraint of a joint, see constraints/rows.py; `a` and `b` are rows of
# Workspace.solid, `b` may be that of the world
ALONG, PERPENDICULAR, DISTANCE, ANGLE = range(4)  # kinds
EQUALITY, LOW_LIMIT, HIGH_LIMIT, MOTOR = range(4)  # roles
JOINT_ROW = np.dtype(
    [
        ("joint", "i8"),  # index in the scene
        ("kind", "i8"),
        ("role", "i8"),
        ("a", "i8"),
        ("b", "i8"),
        ("point_a", "f8", (3,)),  # m, anchor in the frame of a
        ("point_b", "f8", (3,)),  # m, anchor in the frame of b
        ("axis_a", "f8", (3,)),  # in the frame of a
        ("axis_b", "f8", (3,)),  # in the frame of b
        ("pivot", "f8", (3,)),  # ANGLE: the axis of rotation in the frame of b
        ("target", "f8"),  # m or rad: length, or limit
        ("scale", "f8"),  # m or 1, size of what the value is computed from
        ("force_limit", "f8"),  # N or N m, of a motor
        ("frequency", "f8"),  # 1/s, of a servo
        ("motor", "i8"),  # index in State.motor, or -1
        ("middle", "f8"),  # rad, of a motor: the position at which its row's value is zero
        ("limits", "f8", (2,)),  # rad or m, of a motor's joint, from there
        ("first", "i8"),  # first row that it is coupled to, and from there on
        ("entry", "i8"),  # of that row, in Workspace.joint_factor
    ],
    align=True,
)
# those of mechanisms side by side differ between lanes, see manybody/mechanisms.py
JOINT_ROW_PER_LANE = (
    "point_a", "point_b", "axis_a", "axis_b", "pivot", "target", "scale", "force_limit",
    "frequency", "middle", "limits",
)  # fmt: skip


class Model(NamedTuple):
    """The constants of a scene.

    Attributes:
        dynamic: [m] of DYNAMIC; with per-world parameters [groups, m].
        half_pair: [k] of HALF_PAIR; with per-world parameters [groups, k].
        compound_part: [q] of COMPOUND_PART; with per-world parameters [groups, q].
        hidden_face: [c] of HIDDEN_FACE.
        static: [s, 7] position in m and quaternion x y z w of the statics.
        sample: [4, p] x y z in m in the owner's frame at size 1, and weight.
        field: [f] of FIELD.
        joint_row: [r] of JOINT_ROW.
        grid: [g] of GRID_TABLE.
        grid_value: [n] m at size 1, of each grid the distances at its nodes, then surface points.
        surface_point: [7, p] position x y z in m at size 1, normal x y z and area in m^2.
    """

    dynamic: Array
    half_pair: Array
    compound_part: Array
    hidden_face: Array
    static: Array
    sample: Array
    field: Array
    joint_row: Array
    grid: Array
    grid_value: Array
    surface_point: Array

    @property
    def nbytes(self) -> int:
        """Bytes of all arrays: once for all worlds."""
        return sum(array.nbytes for array in self)

    def of_world(self, world: int) -> "Model":
        """The model of one world, by itself."""
        if self.dynamic.ndim == 1:
            return self
        group, lane = divmod(world, LANES)
        tables = []
        for table, dtype, fields in (
            (self.dynamic, DYNAMIC, DYNAMIC_PER_WORLD),
            (self.half_pair, HALF_PAIR, HALF_PAIR_PER_WORLD),
            (self.compound_part, COMPOUND_PART, COMPOUND_PART_PER_WORLD),
        ):
            rows = np.zeros(table.shape[1], dtype=dtype)
            for name in dtype.names or ():
                values = table[name][group]
                rows[name] = values[..., lane] if name in fields else values
            tables.append(rows)
        return self._replace(dynamic=tables[0], half_pair=tables[1], compound_part=tables[2])

    def of_group(self, group: int) -> "Model":
        """The model of one lane group, as the kernels take it."""
        if self.dynamic.ndim == 1:
            return self
        alone = slice(group, group + 1)
        return self._replace(
            dynamic=self.dynamic[alone],
            half_pair=self.half_pair[alone],
            compound_part=self.compound_part[alone],
        )
