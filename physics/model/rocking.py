"""Rocking: how a body that lies flat on one of its sides moves on the stiffness of its contacts.

A body on a face has modes besides moving up and down (bobbing): it rocks about the face's axes. A
rod or plate rocks faster than it bobs, which limits the stiffness that a time step can carry.
"""

import numpy as np

from physics.scene.compound import Compound
from physics.scene.cylinder import Cylinder
from physics.scene.mesh import Mesh
from physics.scene.particles import Particles
from physics.scene.shapes import Box, Samples, Shape
from physics.scene.torus import Torus

Array = np.ndarray


def point_jacobian(arm: Array) -> Array:
    """[3, 6]: how a point at `arm` [3] m from the centre moves with displacement and rotation."""
    x, y, z = arm
    return np.array(
        [[1.0, 0.0, 0.0, 0.0, z, -y], [0.0, 1.0, 0.0, -z, 0.0, x], [0.0, 0.0, 1.0, y, -x, 0.0]]
    )


def largest_eigenvalue(inverse_mass: Array, A: Array) -> Array:
    """Largest eigenvalue [...] of M^-1 A [..., n, n], both symmetric and positive semidefinite."""
    return np.asarray(np.linalg.eigvals(inverse_mass @ A).real.max(axis=-1, initial=0.0))


def outward_sides(shape: Shape) -> Array:
    """Outward normals [k, 3] of the sides on which a solid can lie.

    Particles have sides of their own, all other shapes the six normal to their axes, and a mesh its
    flat sides besides.
    """
    if isinstance(shape, Particles):
        return shape.sides
    axes = np.concatenate([np.eye(3), -np.eye(3)])
    return np.concatenate([axes, shape.sides()]) if isinstance(shape, Mesh) else axes


def face_contacts(shape: Shape, spacing: float) -> list[tuple[Array, Array]]:
    """Unit stiffness along and across the normal, [6, 6] each, for each side it can lie on.

    The samples that touch share the stiffness by their weights.
    """
    samples = shape.samples(spacing, 0.0)
    weights, radius = samples.weights, samples.radius
    radii = np.broadcast_to(radius, len(weights))
    found = []
    for normal in -outward_sides(shape):
        positions = facing(samples, normal)
        height = positions @ normal - radii
        lowest = height <= height.min() + 1e-9
        along, across = np.zeros((6, 6)), np.zeros((6, 6))
        for k in np.flatnonzero(lowest):
            jacobian, weight = point_jacobian(positions[k] - radii[k] * normal), weights[k]
            normal_part = jacobian.T @ np.outer(normal, normal) @ jacobian
            along += weight * normal_part
            across += weight * (jacobian.T @ jacobian - normal_part)
        found.append((along, across))
    return found


def facing(samples: Samples, normal: Array) -> Array:
    """Positions [n, 3] m of samples, turned to face a plane with a normal [3] if they are axial."""
    length = float(np.hypot(normal[0], normal[1]))
    if not samples.axial or length == 0.0:
        return samples.positions
    x, y = -normal[:2] / length
    return np.asarray(samples.positions @ np.array([[x, y, 0.0], [-y, x, 0.0], [0.0, 0.0, 1.0]]))


def fastest_modes(shape: Shape, spacing: float) -> tuple[float, float]:
    """Stiffness per mass of the fastest mode along and across the normal, relative to bobbing."""
    inverse = np.diag([1.0] * 3 + list(1.0 / shape.inertia(1.0)))
    along, across = 1.0, 1.0
    for n, t in face_contacts(shape, spacing):
        along = max(along, float(largest_eigenvalue(inverse, n)))
        across = max(across, float(largest_eigenvalue(inverse, t)))
    return along, across


def rocking_leverage(shape: Shape) -> float:
    """Stiffness times the squared height over the face, divided by the stiffness against rocking.

    For a box on its widest face, which is where a body that slides comes to rest; a compound is
    taken on the side with the least leverage, as are a mesh, a cylinder, a torus and particles;
    balls and capsules don't rock.
    """
    if isinstance(shape, Compound | Cylinder | Torus | Particles):
        samples = shape.samples(0.5 * shape.width, 0.0)
        return _leverage_of_samples(samples.positions, samples.weights, samples.radius)
    if isinstance(shape, Mesh):
        return _leverage_of_mesh(shape)
    if not isinstance(shape, Box):
        return 0.0
    height, *sides = sorted(shape.half_extents)
    # three quarters of a face's weight lie on the two edges across the motion, one on its middle
    return sum(height**2 / (0.75 * side**2) for side in sides) / 2.0


def _leverage_of_samples(positions: Array, weights: Array, radii: float | Array) -> float:
    """The least leverage of the six sides that a solid with these samples can lie on."""
    # m^2, below which the extent of a side is round-off: the solid can't lie on a line
    found, least = [], (1e-6 * np.abs(positions).max()) ** 2
    for axis in range(3):
        others = [k for k in range(3) if k != axis]
        for height in (positions[:, axis] + radii, -positions[:, axis] + radii):
            lowest = height >= height.max() - 1e-6 * np.abs(height).max()
            fraction = weights[lowest] / weights[lowest].sum()
            places = positions[lowest][:, others]
            spread = fraction @ (places - fraction @ places) ** 2
            if np.all(spread > least):
                found.append(float(height.max() ** 2 * np.mean(1.0 / spread)))
    return min(found, default=0.0)


def _leverage_of_mesh(mesh: Mesh) -> float:
    """The least leverage of the flat sides of a mesh; 0 without any: it rolls."""
    samples = mesh.samples(0.5 * mesh.width, 0.0)
    positions, weights = samples.positions, samples.weights
    found, least = [], (1e-6 * np.abs(positions).max()) ** 2
    for normal in mesh.sides():
        height = positions @ normal
        lowest = height >= height.max() - 1e-6 * height.max()
        fraction = weights[lowest] / weights[lowest].sum()
        across = np.linalg.svd(normal[None])[2][1:]
        places = positions[lowest] @ across.T
        places = places - fraction @ places
        spread = np.linalg.eigvalsh(np.einsum("k,ki,kj->ij", fraction, places, places))
        if np.all(spread > least):
            found.append(float(height.max() ** 2 * np.mean(1.0 / spread)))
    return min(found, default=0.0)
