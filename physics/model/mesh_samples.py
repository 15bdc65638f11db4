"""What the contacts of a fidelity ask of a mesh's samples: how many, and how heavy."""

import math

import numpy as np

from physics.directions import spread_directions
from physics.model.rocking import fastest_modes
from physics.scene.fidelity import Fidelity
from physics.scene.mesh import Mesh
from physics.scene.shapes import Samples

Array = np.ndarray

# m/s^2, where nothing else is known
GRAVITY = 9.81
# rad that a contact advances in a step, beyond which springs are unstable
STIFFEST = 2.0
# directions in which a plane is pressed into a mesh
_DIRECTIONS = 400


def sink(fidelity: Fidelity) -> float:
    """Depth in m to which contacts let a body at rest sink, on earth.

    With Newton's method it is far less; there it is as deep as with the stiffest springs.
    """
    return GRAVITY * (fidelity.substep / min(fidelity.contact_resolution, STIFFEST)) ** 2


def impact_depth(mesh: Mesh, fidelity: Fidelity) -> float:
    """Depth in m to which springs are pressed in by a body that falls from as high as it is long.

    At most half its width: a body that sinks deeper is not at rest on anything.
    """
    speed = math.sqrt(2.0 * GRAVITY * 2.0 * mesh.reach)
    return min(0.5 * mesh.width, speed * fidelity.substep / fidelity.contact_resolution)


def stiffest(mesh: Mesh, fidelity: Fidelity) -> float:
    """Stiffness, relative to bobbing, with which springs advance by 1 rad in a step.

    A body that rocks fast on its flat sides has softer contacts, see `contact_columns`.
    """
    flat = fastest_modes(mesh, 0.5 * mesh.width)[0]
    return flat / fidelity.contact_resolution**2


def pressed(shape: Mesh, samples: Samples, depth: float, most: float) -> tuple[Samples, float]:
    """Samples of a mesh with weights at which springs are stable however deep they are pressed in.

    On a flat side the weights sum to 1. On a round area more samples touch the deeper a plane is
    pressed in. What counts is the largest stiffness per mass, relative to bobbing, that those
    within a depth of a plane have together, in any direction.

    Args:
        shape: the mesh.
        samples: of it.
        depth: m, to which a body is pressed in by an impact.
        most: largest such stiffness, relative to that of its flat sides; weights are lowered
            where it is more.

    Returns:
        The samples, and `HALF_PAIR.crowding`: the largest stiffness that is left over 2, at least
        1. Strong damping of one contact removes all of the approach speed in a step, so with up to
        2 a body rebounds with no more than that.
    """
    positions, weights = samples.positions, samples.weights
    normals = np.concatenate([spread_directions(_DIRECTIONS), shape.sides()])
    heights = normals @ positions.T
    touched = heights >= heights.max(axis=1, keepdims=True) - depth
    scale = np.concatenate([np.ones(3), shape.inertia(1.0) ** -0.5])
    jacobians = []
    for normal, mask in zip(normals, touched, strict=True):
        arms = positions[mask] + samples.radius * normal
        jacobians.append(
            np.concatenate([np.broadcast_to(normal, arms.shape), np.cross(arms, normal)], axis=1)
            * scale
        )

    def stiffness(found: Array) -> Array:
        matrices = [
            (J * found[mask, None]).T @ J for J, mask in zip(jacobians, touched, strict=True)
        ]
        return np.asarray(np.linalg.eigvalsh(np.array(matrices))[:, -1])

    excess = np.where(touched, stiffness(weights)[:, None] / most, 0.0).max(axis=0)
    weights = weights / np.maximum(excess, 1.0)
    return samples._replace(weights=weights), max(1.0, 0.5 * float(stiffness(weights).max()))
