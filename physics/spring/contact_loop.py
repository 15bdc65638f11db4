"""Contact forces of the candidates of one half-pair against one kind of surface.

Everything is computed in the frame of the surface, where the surface is at rest. A slot holds one
candidate per lane, or zeros; the loop over lanes has no branch, so LLVM can vectorise it.
"""

import math

import numpy as np

from physics.collision.contact_point import HIDDEN, make_touch
from physics.compiler.jit import LANES, at, stage
from physics.model.contact_memory import contact_memory
from physics.model.features import cached_by_features
from physics.scene.shapes import BOX, CYLINDER, PLANE
from physics.spring.coulomb import friction_force, is_set_down, twist_torque, viscous_force, winding
from physics.spring.energy_correction import rotational_inverse_mass
from physics.spring.hunt_crossley import dashpot_force, hunt_crossley_force
from physics.spring.mass_splitting import splits_mass

# m/s, least lower bound of the impact speed
LEAST_SPEED = 1e-9
# m/s, below any other: the impact speed that contacts of a state that was set remember
SLOWEST = 1e-200

# one row per slot: what `World.contacts` reports of the candidates there
REPORT = np.dtype(
    [
        ("penetration", "f8", (LANES,)),  # m
        ("point", "f8", (3, LANES)),  # m, in the frame of the surface, as the next two
        ("normal", "f8", (3, LANES)),
        ("force", "f8", (3, LANES)),  # N, on the owner
        ("weight", "f8", (LANES,)),
    ],
    align=True,
)


def weighs_on_solids(features):
    """Whether the lower bound of the impact speed depends on the normal, as on inclined statics."""
    return not features.dashpot and (features.slope or not features.friction)


@cached_by_features
def make_contact_loop(features, kind, report):
    """Loop over the slots of a half-pair; with `report` it also writes a row for each candidate."""
    viscous, resistance = features.viscous, features.resistance
    friction = features.friction and not viscous
    slope, lever = features.slope, features.lever
    normal_force = dashpot_force if features.dashpot else hunt_crossley_force
    plane, box, compound = kind == PLANE, kind == BOX, features.compound
    keeps_normals = not plane and splits_mass(features)
    has_faces = kind in (BOX, CYLINDER)
    weighs = not plane and weighs_on_solids(features)
    touch = make_touch(features, kind)
    memory_rows = contact_memory(features)
    FORCE, SPEED, APPROACH = (
        memory_rows.normal_force,
        memory_rows.impact_speed,
        memory_rows.approach,
    )
    SHEAR, TWIST, FACE = memory_rows.shear, memory_rows.twist, memory_rows.face

    @stage
    def contact_loop(slots, candidate, relative, constants, h, any_face, rows):
        """`any_face`: a sample whose face is another than that it remembers is no new contact."""
        R, c = relative.rotation, relative.position
        v, omega = relative.velocity, relative.angular_velocity
        force, torque, normal_force_sum = relative.force, relative.torque, relative.normal_force_sum
        radii, owner_radii, core = constants.radius, constants.owner_radius, constants.core
        stiffness, damping, floors = constants.stiffness, relative.damping, relative.rest_speed
        rest_times = constants.rest_time
        shear_stiffness, shear_damping = constants.shear_stiffness, constants.shear_damping
        frictions, pair_mass = constants.friction, constants.pair_mass
        mean_impact_speeds, impact_ratios = relative.mean_impact_speed, relative.impact_ratio
        impact_sum, closing_sum = relative.impact_sum, relative.closing_sum
        inverse_masses, speeds_per_load = relative.inverse_mass, relative.speed_per_load
        load_rates, inverse_mean_forces = relative.load_rate, relative.inverse_mean_force
        grips = relative.grip
        current_weight, normal_sum = relative.current_weight, relative.normal_sum
        inverse_inertia, centre = constants.surface_inverse_inertia, constants.surface_centre
        face_normals, axial = constants.face_normals != 0, constants.axial != 0
        any_face |= not face_normals
        overlap_share = constants.overlap_share
        gravity, fall, steep = constants.gravity, relative.gravity, constants.slide_slope
        rolling, spinning = constants.rolling, constants.spinning
        twist_stiffness, twist_damping = constants.twist_stiffness, constants.twist_damping
        for n in range(slots):
            row = candidate[n]
            weights, memory = row.weight, row.memory
            for i in range(LANES):
                weight, mu = weights[i], at(frictions, i)
                radius, owner_radius = at(radii, i), at(owner_radii, i)
                ca, cb, cc = at(core[0], i), at(core[1], i), at(core[2], i)
                k, a = at(stiffness, i), damping[i]
                shear_k, shear_c = at(shear_stiffness, i), grips[i] * at(shear_damping, i)
                mass, load_rate = at(pair_mass, i), load_rates[i]
                share = at(overlap_share, i)
                inverse_mass, speed_per_load = inverse_masses[i], speeds_per_load[i]
                rx, ry, rz, nx, ny, nz, penetration, face = touch(
                    row, i, R, c, ca, cb, cc, radius, owner_radius, share, face_normals, axial
                )
                if box and compound:
                    weight = 0.0 if face == HIDDEN else weight
                floor = floors[i]
                if weighs:
                    load = fall[0, i] * nx + fall[1, i] * ny + fall[2, i] * nz
                    floor = max(-at(rest_times, i) * load, floor)
                if lever and not plane:
                    rotational = rotational_inverse_mass(
                        at(inverse_inertia[0], i),
                        at(inverse_inertia[1], i),
                        at(inverse_inertia[2], i),
                        rx + c[0, i] - at(centre[0], i),
                        ry + c[1, i] - at(centre[1], i),
                        rz + c[2, i] - at(centre[2], i),
                        nx,
                        ny,
                        nz,
                    )
                    inverse_mass += rotational
                    lighter = 1.0 + mass * rotational
                    load_rate *= 1.0 / lighter
                    speed_per_load *= math.sqrt(lighter)
                ux = v[0, i] + omega[1, i] * rz - omega[2, i] * ry
                uy = v[1, i] + omega[2, i] * rx - omega[0, i] * rz
                uz = v[2, i] + omega[0, i] * ry - omega[1, i] * rx
                approach = -uz if plane else -(ux * nx + uy * ny + uz * nz)
                impact_speed = memory[SPEED, i]
                if has_faces:  # a sample that changed the face is a new contact
                    same = (face == memory[FACE, i]) | any_face
                    impact_speed = impact_speed if same else 0.0
                begins = abs(impact_speed) <= SLOWEST
                normal, impact_speed, persistence = normal_force(
                    penetration,
                    approach,
                    k,
                    a,
                    floor,
                    inverse_mass,
                    speed_per_load,
                    h,
                    load_rate,
                    inverse_mean_forces[i],
                    mean_impact_speeds[i],
                    impact_ratios[i],
                    impact_speed,
                    memory[FORCE, i],
                    memory[APPROACH, i],
                    weight > 0.0,
                )
                if report:  # the force of the last step, whose mean it was, if there was one
                    last, rate = memory[FORCE, i], memory[APPROACH, i]
                    normal = last if (last != 0.0) | (rate != 0.0) else normal
                memory[SPEED, i] = impact_speed
                memory[FORCE, i] = normal
                # an empty slot stays empty, whatever the lane's state
                memory[APPROACH, i] = approach if weight > 0.0 else 0.0
                touching = weight if normal > 0.0 else 0.0
                current_weight[i] += touching
                if keeps_normals:
                    normal_sum[0, i] += touching * nx
                    normal_sum[1, i] += touching * ny
                    normal_sum[2, i] += touching * nz
                if has_faces:
                    memory[FACE, i] = face if weight > 0.0 else 0.0
                if plane:
                    fx, fy, fz = 0.0, 0.0, normal
                else:
                    fx, fy, fz = normal * nx, normal * ny, normal * nz
                if friction:
                    sx, sy, sz = memory[SHEAR, i], memory[SHEAR + 1, i], memory[SHEAR + 2, i]
                    wound = None
                    if slope:
                        if plane:
                            wound = winding(
                                mass, mu, steep, gravity[0], gravity[1], gravity[2], 0.0, 0.0, 1.0
                            )
                        else:
                            wound = winding(
                                mass, mu, steep, fall[0, i], fall[1, i], fall[2, i], nx, ny, nz
                            )
                        along = ux * wound[0] + uy * wound[1] + uz * wound[2]
                        set_down = begins & is_set_down(
                            approach, along, gravity[0], gravity[1], gravity[2], h, wound
                        )
                        sx -= wound[0] if set_down else 0.0
                        sy -= wound[1] if set_down else 0.0
                        sz -= wound[2] if set_down else 0.0
                    if plane:
                        gx, gy, gz, sx, sy, sz = friction_force(
                            normal,
                            ux,
                            uy,
                            0.0,
                            shear_k,
                            shear_c,
                            mu,
                            h,
                            sx,
                            sy,
                            0.0,
                            persistence,
                            wound,
                        )
                        fx, fy = gx, gy
                    else:
                        along = sx * nx + sy * ny + sz * nz
                        gx, gy, gz, sx, sy, sz = friction_force(
                            normal,
                            ux + approach * nx,
                            uy + approach * ny,
                            uz + approach * nz,
                            shear_k,
                            shear_c,
                            mu,
                            h,
                            sx - along * nx,
                            sy - along * ny,
                            sz - along * nz,
                            persistence,
                            wound,
                        )
                        fx += gx
                        fy += gy
                        fz += gz
                        memory[SHEAR + 2, i] = sz
                    memory[SHEAR, i] = sx
                    memory[SHEAR + 1, i] = sy
                if viscous:
                    gx, gy, gz = viscous_force(
                        normal,
                        ux + approach * nx,
                        uy + approach * ny,
                        uz + approach * nz,
                        shear_c,
                        mu,
                    )
                    fx += gx
                    fy += gy
                    fz += gz
                if resistance:
                    tx, ty, tz, sx, sy, sz = twist_torque(
                        normal,
                        omega[0, i],
                        omega[1, i],
                        omega[2, i],
                        nx,
                        ny,
                        nz,
                        at(twist_stiffness, i),
                        grips[i] * at(twist_damping, i),
                        rolling,
                        spinning,
                        h,
                        memory[TWIST, i],
                        memory[TWIST + 1, i],
                        memory[TWIST + 2, i],
                    )
                    memory[TWIST, i] = sx
                    memory[TWIST + 1, i] = sy
                    memory[TWIST + 2, i] = sz
                    torque[0, i] += tx * weight if weight > 0.0 else 0.0
                    torque[1, i] += ty * weight if weight > 0.0 else 0.0
                    torque[2, i] += tz * weight if weight > 0.0 else 0.0
                fx = fx * weight if weight > 0.0 else 0.0
                fy = fy * weight if weight > 0.0 else 0.0
                fz = fz * weight if weight > 0.0 else 0.0
                force[0, i] += fx
                force[1, i] += fy
                force[2, i] += fz
                torque[0, i] += ry * fz - rz * fy
                torque[1, i] += rz * fx - rx * fz
                torque[2, i] += rx * fy - ry * fx
                normal_force_sum[i] += weight * normal
                closing_force = weight * normal if approach > 0.0 else 0.0
                impact_sum[i] += closing_force * impact_speed
                closing_sum[i] += closing_force * approach
                if report:
                    out = rows[n]
                    out.penetration[i] = penetration
                    out.point[0, i] = rx + c[0, i]
                    out.point[1, i] = ry + c[1, i]
                    out.point[2, i] = rz + c[2, i]
                    out.normal[0, i] = 0.0 if plane else nx
                    out.normal[1, i] = 0.0 if plane else ny
                    out.normal[2, i] = 1.0 if plane else nz
                    out.force[0, i] = fx
                    out.force[1, i] = fy
                    out.force[2, i] = fz
                    out.weight[i] = weight

    return contact_loop
