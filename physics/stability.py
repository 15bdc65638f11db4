"""The largest stable step of the spring law.

Kick-drift-kick with damping taken at the half step maps a mode with M x'' + C x' + K x = 0 to
eigenvalues that leave the unit circle through -1, where (4 M - 2 h C - h^2 K) is singular. For one
degree of freedom that is omega h < 2 (sqrt(1 + zeta^2) - zeta). With mu = 1/h it is the quadratic
eigenproblem 4 M mu^2 - 2 C mu - K = 0; the largest real mu gives the smallest such step. Rotation,
damping and modes of several bodies are all in the matrices.
"""

import math

import numpy as np

from physics import diagnostics
from physics.features import Features
from physics.model import Model
from physics.scene import Body, Scene
from physics.state import State

Array = np.ndarray


def largest_step(inverse_mass: Array, stiffness: Array, damping: Array) -> float:
    """Largest stable step in s of the linear system with these matrices [n, n]; inf if free."""
    n = len(stiffness)
    companion = np.zeros((2 * n, 2 * n))
    companion[:n, n:] = np.eye(n)
    companion[n:, :n] = 0.25 * inverse_mass @ stiffness
    companion[n:, n:] = 0.5 * inverse_mass @ damping
    values = np.linalg.eigvals(companion)
    real = values[np.abs(values.imag) <= 1e-6 * (1e-300 + np.abs(values))].real
    largest = float(real.max(initial=0.0))
    return 1.0 / largest if largest > 1e-9 else math.inf


def of_contacts(model: Model, features: Features, state: State, world: int) -> float:
    """Largest stable step in s of a world with the contacts that it has now."""
    stiffness, damping = diagnostics.contact_stiffness(model, features, state, world)
    return largest_step(diagnostics.inverse_masses(model, state, world), stiffness, damping)


def _face_factors(body: Body, spacing: float, shear: float) -> float:
    """How much stiffer a face's contact is to a body's fastest mode than to its centre.

    The largest eigenvalue of m M^-1 K for unit stiffness, over landings on each side of the body.
    """
    assert body.mass is not None
    positions, weights, radius = body.shape.samples(spacing, 0.0)
    inverse = np.diag([1.0] * 3 + list(body.mass / body.shape.inertia(body.mass)))
    largest = 1.0
    for axis in range(3):
        normal = np.eye(3)[axis]
        lowest = positions[:, axis] <= positions[:, axis].min() + 1e-9
        K = np.zeros((6, 6))
        for r, w in zip(positions[lowest] - radius * normal, weights[lowest], strict=True):
            cross = np.array([[0, r[2], -r[1]], [-r[2], 0, r[0]], [r[1], -r[0], 0]])
            jacobian = np.hstack([np.eye(3), cross])
            along = np.outer(normal, normal)
            K += w * jacobian.T @ (along + shear * (np.eye(3) - along)) @ jacobian
        largest = max(largest, float(np.linalg.eigvals(inverse @ K).real.max()))
    return largest


def of_scene(scene: Scene, model: Model, spacing: float) -> tuple[float, int]:
    """A safe step in s for any state of a scene, and the index of the body that binds it.

    A bound: each body lands flat on its six stiffest partners at once; a contact with another
    free body counts twice, for both may move against each other.
    """
    worst, binding = math.inf, 0
    count = len(scene.bodies)
    for i, body in enumerate(scene.bodies):
        assert body.mass is not None
        rates: dict[int, tuple[float, float]] = {}
        for side in model.side:
            ends = (int(side["owner"]), int(side["surface"]))
            if i not in ends:
                continue
            other = ends[0] if ends[1] == i else ends[1]
            shear = float(side["shear_stiffness"] / side["stiffness"])
            factor = _face_factors(body, spacing * body.shape.width, shear)
            factor *= (2.0 if other < count else 1.0) / body.mass
            rates[other] = (
                factor * float(side["stiffness"]),
                factor * float(side["shear_damping"] * (side["friction"] > 0.0)),
            )
        strongest = sorted(rates.values(), reverse=True)[:6]
        K, C = (sum(column) for column in zip((0.0, 0.0), *strongest, strict=True))
        if K > 0.0:
            # 4 - 2 h C - h^2 K = 0
            step = (math.sqrt(C * C + 4.0 * K) - C) / K
            if step < worst:
                worst, binding = step, i
    return worst, binding
