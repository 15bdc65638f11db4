"""Largest step that springs to points and linear drag allow.

In any state the stiffness that a spring s adds along its line, over mass, is at most
k_s (1/m + r^2/J) of each of its ends: r the arm of the point, J the smallest moment. Springs that
share a body act together at most as the matrix

    A_st = sqrt(k_s k_t) * sum over shared bodies of sqrt((1/m + r_s^2/J) (1/m + r_t^2/J)),

whose largest eigenvalue bounds omega^2. The same matrix of the damping bounds gamma, to which the
linear drag over mass of a body adds. A step is stable if x'' = -omega^2 x - gamma x' is: the scheme
of the integrator, with the velocities of `motion.fields`, is linear in (x, v, a), with the spectral
radius of its matrix at most 1. Pull and drag that grow with closeness or speed (attractors,
quadratic drag, surface drag) have no such limit. The adaptive integrator needs none: its error
control shortens the steps.
"""

import math
from itertools import accumulate, product

import numpy as np

from physics.model.tables import DRAG, POINT_SPRING, Model
from physics.scene.fields import Drag, PointSpring
from physics.scene.scene import Scene

Array = np.ndarray

_LONGEST = 1e6  # s; no field limits the step if such a step is stable


def _ends(row: Array, model: Model) -> dict[int, float]:
    """1/kg along the worst direction, of each body that a spring is attached to."""
    found = {}
    for body, point in ((int(row["body"]), row["point"]), (int(row["other"]), row["to"])):
        if body >= 0:
            constants = model.dynamic[body]
            turning = float(np.sum(point**2)) * float(constants["inverse_inertia"].max())
            found[body] = float(constants["inverse_mass"]) + turning
    return found


def _coupling(rows: Array, model: Model, column: str) -> tuple[float, int]:
    """Largest eigenvalue of A for a column of the springs, and the spring that has most of it."""
    ends = [_ends(row, model) for row in rows]
    matrix = np.zeros((len(rows), len(rows)))
    for s, t in product(range(len(rows)), repeat=2):
        shared = sum(math.sqrt(ends[s][b] * ends[t][b]) for b in ends[s].keys() & ends[t].keys())
        matrix[s, t] = math.sqrt(rows[column][s] * rows[column][t]) * shared
    values, vectors = np.linalg.eigh(matrix)
    return float(values[-1]), int(np.abs(vectors[:, -1]).argmax())


def _is_stable(square: float, gamma: float, h: float, integrator: str) -> bool:
    """Whether a step of x'' = -square x - gamma x' doesn't grow."""
    matrix = _STEPS[integrator](square, gamma, h)
    return bool(np.abs(np.linalg.eigvals(matrix)).max() <= 1.0 + 1e-9)


def _midpoint(square: float, gamma: float, h: float) -> Array:
    """The step of (x, v, a)."""
    half = np.array([[0.0, 1.0, 0.5 * h]])  # velocity in the middle of the step
    x = np.array([[1.0, 0.0, 0.0]]) + h * half
    a = -square * x - gamma * (half + np.array([[0.0, 0.0, 0.5 * h]]))
    return np.concatenate([x, half + 0.5 * h * a, a])


def _euler(square: float, gamma: float, h: float) -> Array:
    """The step of (x, v)."""
    v = np.array([[-h * square, 1.0 - h * gamma]])
    return np.concatenate([np.array([[1.0, 0.0]]) + h * v, v])


def _rk4(square: float, gamma: float, h: float) -> Array:
    """The step of (x, v): the exponential's series to the fourth power."""
    A = h * np.array([[0.0, 1.0], [-square, -gamma]])
    powers = accumulate(range(1, 5), lambda term, n: term @ A / n, initial=np.eye(2))
    return np.asarray(sum(powers))


_STEPS = {"midpoint": _midpoint, "euler": _euler, "rk4": _rk4}


def longest_step(scene: Scene, model: Model, integrator: str) -> tuple[float, int]:
    """Longest stable step in s, inf if nothing limits it, and the index of the limiting field."""
    if integrator not in _STEPS:
        return math.inf, 0
    rows = model.field
    springs = rows[rows["kind"] == POINT_SPRING]
    square, gamma, stiff, damped = 0.0, 0.0, 0, 0
    if len(springs):
        square, stiff = _coupling(springs, model, "stiffness")
        gamma, damped = _coupling(springs, model, "damping")
    rates = [
        float(row["damping"] * model.dynamic[int(row["body"])]["inverse_mass"])
        for row in rows[rows["kind"] == DRAG]
    ]
    most = max(rates, default=0.0)
    if square == gamma + most == 0.0:
        return math.inf, 0
    low, high = 0.0, _LONGEST
    while high - low > 1e-4 * high:
        middle = math.sqrt(max(low, 1e-12) * high)
        stable = _is_stable(square, gamma + most, middle, integrator)
        low, high = (middle, high) if stable else (low, middle)
    drag = max(gamma, most) * low > math.sqrt(square) * low
    if not drag or gamma >= most:
        index = damped if drag else stiff
        fields = [i for i, f in enumerate(scene.fields) if isinstance(f, PointSpring)]
    else:
        index, fields = 0, [i for i, f in enumerate(scene.fields) if isinstance(f, Drag)]
        fields.sort(key=lambda i: -scene.fields[i].linear)  # type: ignore[union-attr]
    return low, fields[index]
