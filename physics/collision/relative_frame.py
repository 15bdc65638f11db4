"""A half-pair in the frame of its surface, where the surface is at rest.

A row of SOLID holds the owner's rotation, position and velocities relative to the surface, and the
force and torque on the owner in that frame. The frame of a plane is the world frame; each part of a
compound has a frame.
"""

from physics.compiler.jit import LANES, stage
from physics.motion.vectors import rotated_back


@stage
def relative_pose(owner, surface, relative):
    """Rotation and position of the owner in the frame of the surface."""
    A, B, R = owner.rotation, surface.rotation, relative.rotation
    a, b, c = owner.position, surface.position, relative.position
    for i in range(LANES):
        x, y, z = rotated_back(B, i, A[0, i], A[3, i], A[6, i])
        R[0, i] = x
        R[3, i] = y
        R[6, i] = z
        x, y, z = rotated_back(B, i, A[1, i], A[4, i], A[7, i])
        R[1, i] = x
        R[4, i] = y
        R[7, i] = z
        x, y, z = rotated_back(B, i, A[2, i], A[5, i], A[8, i])
        R[2, i] = x
        R[5, i] = y
        R[8, i] = z
        x, y, z = rotated_back(B, i, a[0, i] - b[0, i], a[1, i] - b[1, i], a[2, i] - b[2, i])
        c[0, i] = x
        c[1, i] = y
        c[2, i] = z


@stage
def relative_gravity(surface, gravity, relative):
    """A vector in m/s^2 in the frame of the surface."""
    B, out = surface.rotation, relative.gravity
    for i in range(LANES):
        x, y, z = rotated_back(B, i, gravity[0], gravity[1], gravity[2])
        out[0, i] = x
        out[1, i] = y
        out[2, i] = z


@stage
def relative_velocities(owner, surface, relative):
    """Velocities of the owner relative to the rotating surface; clears force and torque."""
    B, a, b = surface.rotation, owner.position, surface.position
    u, v, p, s = owner.velocity, surface.velocity, owner.angular_velocity, surface.angular_velocity
    velocity, angular_velocity, force, torque = (
        relative.velocity,
        relative.angular_velocity,
        relative.force,
        relative.torque,
    )
    for i in range(LANES):
        dx, dy, dz = a[0, i] - b[0, i], a[1, i] - b[1, i], a[2, i] - b[2, i]
        sx, sy, sz = s[0, i], s[1, i], s[2, i]
        x, y, z = rotated_back(
            B,
            i,
            u[0, i] - v[0, i] - (sy * dz - sz * dy),
            u[1, i] - v[1, i] - (sz * dx - sx * dz),
            u[2, i] - v[2, i] - (sx * dy - sy * dx),
        )
        velocity[0, i] = x
        velocity[1, i] = y
        velocity[2, i] = z
        x, y, z = rotated_back(B, i, p[0, i] - sx, p[1, i] - sy, p[2, i] - sz)
        angular_velocity[0, i] = x
        angular_velocity[1, i] = y
        angular_velocity[2, i] = z
        force[0, i] = 0.0
        force[1, i] = 0.0
        force[2, i] = 0.0
        torque[0, i] = 0.0
        torque[1, i] = 0.0
        torque[2, i] = 0.0
