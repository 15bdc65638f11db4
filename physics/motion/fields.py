"""Forces of fields on bodies: springs to points, attractors, drag; and wrenches from the user.

While forces are computed, velocities are those of the middle of the last drift, half a step before
the positions. A damping force with such a velocity would be first order in the step. So the fields
take the velocity of the present, v + h F / (2 m), with the total force F of the last step: second
order, exact where the forces balance (terminal velocity), and no force on a body that rests on
others.

An attractor pulls each point with its mass times strength / r^exponent. `per_particle` divides a
body of mass m and principal moments J among six points at +-sqrt(3 s_i) along its principal axes,
with s_i = (J_j + J_k - J_i) / (2 m), the mean of x_i^2. They have the body's mass, centre and
inertia, so their force and torque are those of the body to second order in its size.

A surface drag is summed over points of the body's surface, in the body frame.
"""

import math

from physics.compiler.jit import LANES, at, stage
from physics.model.features import GENERAL, cached_by_features
from physics.model.tables import ATTRACTOR, DRAG, POINT_SPRING, SURFACE_DRAG
from physics.motion.kinematics import make_angular_velocity
from physics.motion.vectors import cross, rotated, rotated_back


@cached_by_features
def make_present_velocities(features):
    """Stage that computes the bodies' velocities at the time of the positions.

    It comes before `gravity`, which clears the forces of the last step.
    """
    fields, angular_velocity = features.fields, make_angular_velocity(features)

    @stage
    def present_velocities(model, workspace, drifted):
        if fields:
            half = 0.5 * drifted
            for m in range(model.dynamic.shape[0]):
                solid, constants = workspace.solid[m], model.dynamic[m]
                P, L, F, T = solid.momentum, solid.angular_momentum, solid.force, solid.torque
                v, omega, q = (
                    solid.present_velocity,
                    solid.present_angular_velocity,
                    solid.orientation,
                )
                j, general = constants.inverse_inertia, constants.rotation == GENERAL
                for i in range(LANES):
                    inverse_mass = at(constants.inverse_mass, i)
                    v[0, i] = inverse_mass * (P[0, i] + half * F[0, i])
                    v[1, i] = inverse_mass * (P[1, i] + half * F[1, i])
                    v[2, i] = inverse_mass * (P[2, i] + half * F[2, i])
                    lx = L[0, i] + half * T[0, i]
                    ly = L[1, i] + half * T[1, i]
                    lz = L[2, i] + half * T[2, i]
                    ox, oy, oz = angular_velocity(general, q, j, i, lx, ly, lz)
                    omega[0, i] = ox
                    omega[1, i] = oy
                    omega[2, i] = oz

    return present_velocities


@stage
def point_of(solid, point, i):
    """Arm from the centre, position and present velocity of a point given in the body frame."""
    ax, ay, az = rotated(solid.rotation, i, point[0], point[1], point[2])
    c, v, omega = solid.position, solid.present_velocity, solid.present_angular_velocity
    wx, wy, wz = cross(omega[0, i], omega[1, i], omega[2, i], ax, ay, az)
    return (
        ax,
        ay,
        az,
        c[0, i] + ax,
        c[1, i] + ay,
        c[2, i] + az,
        v[0, i] + wx,
        v[1, i] + wy,
        v[2, i] + wz,
    )


@stage
def add_force(solid, i, ax, ay, az, fx, fy, fz):
    """Adds a force in N that acts at an arm from the centre in m."""
    tx, ty, tz = cross(ax, ay, az, fx, fy, fz)
    solid.force[0, i] += fx
    solid.force[1, i] += fy
    solid.force[2, i] += fz
    solid.torque[0, i] += tx
    solid.torque[1, i] += ty
    solid.torque[2, i] += tz


@stage
def point_spring(row, workspace):
    """Adds the forces of a spring to both of its ends."""
    body = workspace.solid[row.body]
    for i in range(LANES):
        ax, ay, az, px, py, pz, vx, vy, vz = point_of(body, row.point, i)
        bx, by, bz, wx, wy, wz = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
        qx, qy, qz = row.to[0], row.to[1], row.to[2]
        if row.other >= 0:
            bx, by, bz, qx, qy, qz, wx, wy, wz = point_of(workspace.solid[row.other], row.to, i)
        dx, dy, dz = qx - px, qy - py, qz - pz
        square = dx * dx + dy * dy + dz * dz
        inverse = 1.0 / math.sqrt(square) if square > 0.0 else 0.0
        stretching = (dx * (wx - vx) + dy * (wy - vy) + dz * (wz - vz)) * inverse
        per_length = row.stiffness * (1.0 - row.rest_length * inverse)
        per_length += row.damping * stretching * inverse
        fx, fy, fz = per_length * dx, per_length * dy, per_length * dz
        add_force(body, i, ax, ay, az, fx, fy, fz)
        if row.other >= 0:
            add_force(workspace.solid[row.other], i, bx, by, bz, -fx, -fy, -fz)


@stage
def attraction(row, solid, i, mass, x, y, z):
    """Adds the pull on a point mass in kg at x y z in the body frame."""
    ax, ay, az = rotated(solid.rotation, i, x, y, z)
    c = solid.position
    dx = row.to[0] - c[0, i] - ax
    dy = row.to[1] - c[1, i] - ay
    dz = row.to[2] - c[2, i] - az
    square = dx * dx + dy * dy + dz * dz
    pull = mass * row.strength * square ** (-0.5 * (row.exponent + 1.0))
    add_force(solid, i, ax, ay, az, pull * dx, pull * dy, pull * dz)


@stage
def attractor(row, model, workspace):
    """Adds the pull on all bodies."""
    for m in range(model.dynamic.shape[0]):
        constants, solid = model.dynamic[m], workspace.solid[m]
        if not constants.is_body:
            continue
        for i in range(LANES):
            mass = 1.0 / at(constants.inverse_mass, i)
            if row.per_particle == 0:
                attraction(row, solid, i, mass, 0.0, 0.0, 0.0)
                continue
            J = constants.inertia
            jx, jy, jz = at(J[0], i), at(J[1], i), at(J[2], i)
            x = math.sqrt(1.5 * max(jy + jz - jx, 0.0) / mass)
            y = math.sqrt(1.5 * max(jx + jz - jy, 0.0) / mass)
            z = math.sqrt(1.5 * max(jx + jy - jz, 0.0) / mass)
            part = mass / 6.0
            attraction(row, solid, i, part, x, 0.0, 0.0)
            attraction(row, solid, i, part, -x, 0.0, 0.0)
            attraction(row, solid, i, part, 0.0, y, 0.0)
            attraction(row, solid, i, part, 0.0, -y, 0.0)
            attraction(row, solid, i, part, 0.0, 0.0, z)
            attraction(row, solid, i, part, 0.0, 0.0, -z)


@stage
def drag(row, workspace):
    """Adds the drag on a body."""
    solid = workspace.solid[row.body]
    v, F = solid.present_velocity, solid.force
    for i in range(LANES):
        speed = math.sqrt(v[0, i] * v[0, i] + v[1, i] * v[1, i] + v[2, i] * v[2, i])
        factor = row.damping + row.quadratic * speed
        F[0, i] -= factor * v[0, i]
        F[1, i] -= factor * v[1, i]
        F[2, i] -= factor * v[2, i]


@cached_by_features
def make_surface_drag(features):
    """Stage that adds a surface drag on a body."""
    per_world_parameters = features.per_world_parameters

    @stage
    def size_of(row, constants, i):
        """Factor on a body's lengths."""
        size = 1.0
        if per_world_parameters:
            inertia, inverse_mass = at(constants.inertia[0], i), at(constants.inverse_mass, i)
            size = math.sqrt(inertia * inverse_mass / row.unit_inertia)
        return size

    @stage
    def surface_drag(row, model, workspace):
        constants, solid, own = (
            model.dynamic[row.body],
            workspace.solid[row.body],
            workspace.relative[0],  # scratch: velocities and sums in the body frame
        )
        R, v, omega = solid.rotation, solid.present_velocity, solid.present_angular_velocity
        u, spin, force, torque = own.velocity, own.angular_velocity, own.force, own.torque
        for i in range(LANES):
            x, y, z = rotated_back(
                R, i, v[0, i] - row.flow[0], v[1, i] - row.flow[1], v[2, i] - row.flow[2]
            )
            u[0, i] = x
            u[1, i] = y
            u[2, i] = z
            x, y, z = rotated_back(R, i, omega[0, i], omega[1, i], omega[2, i])
            size = size_of(row, constants, i)  # a point at size 1 gets the speed of the real one
            spin[0, i] = size * x
            spin[1, i] = size * y
            spin[2, i] = size * z
            for c in range(3):
                force[c, i] = 0.0
                torque[c, i] = 0.0
        for p in range(row.first_point, row.first_point + row.point_count):
            point = model.surface_point[:, p]
            x, y, z, nx, ny, nz = point[0], point[1], point[2], point[3], point[4], point[5]
            pressure, tangential = row.pressure * point[6], row.tangential * point[6]
            for i in range(LANES):
                ux, uy, uz = cross(spin[0, i], spin[1, i], spin[2, i], x, y, z)
                ux, uy, uz = u[0, i] + ux, u[1, i] + uy, u[2, i] + uz
                s = max(0.0, ux * nx + uy * ny + uz * nz)
                along, across = -s * s * (pressure - tangential), -s * tangential
                fx = along * nx + across * ux
                fy = along * ny + across * uy
                fz = along * nz + across * uz
                force[0, i] += fx
                force[1, i] += fy
                force[2, i] += fz
                torque[0, i] += y * fz - z * fy
                torque[1, i] += z * fx - x * fz
                torque[2, i] += x * fy - y * fx
        for i in range(LANES):
            size = size_of(row, constants, i)
            area, arm = size * size, size * size * size
            x, y, z = rotated(R, i, area * force[0, i], area * force[1, i], area * force[2, i])
            solid.force[0, i] += x
            solid.force[1, i] += y
            solid.force[2, i] += z
            x, y, z = rotated(R, i, arm * torque[0, i], arm * torque[1, i], arm * torque[2, i])
            solid.torque[0, i] += x
            solid.torque[1, i] += y
            solid.torque[2, i] += z

    return surface_drag


@cached_by_features
def make_fields(features):
    """Stage that adds the forces of all fields."""
    fields, any_surface_drag = features.fields, features.surface_drag
    surface_drag = make_surface_drag(features)

    @stage
    def add_fields(model, workspace):
        if fields:
            for n in range(model.field.shape[0]):
                row = model.field[n]
                if row.kind == POINT_SPRING:
                    point_spring(row, workspace)
                elif row.kind == ATTRACTOR:
                    attractor(row, model, workspace)
                elif row.kind == DRAG:
                    drag(row, workspace)
                if any_surface_drag and row.kind == SURFACE_DRAG:
                    surface_drag(row, model, workspace)

    return add_fields


@cached_by_features
def make_wrenches(features):
    """Stage that adds the forces and torques of `World.apply_wrench`."""
    wrench = features.wrench

    @stage
    def wrenches(state, workspace):
        if wrench and state.wrench.shape[0] > 0:
            for i in range(LANES):
                w = workspace.lane[0].world[i]
                if w >= 0:
                    for m in range(state.wrench.shape[1]):
                        solid = workspace.solid[m]
                        for c in range(3):
                            solid.force[c, i] += state.wrench[w, m, c]
                            solid.torque[c, i] += state.wrench[w, m, 3 + c]

    return wrenches
