"""The largest stable step of a world with many contacts, without writing its matrices down.

The load of a step on the velocities, A in `analysis.stability`, is a sum over contacts. Lanczos'
method needs its product with a vector only, so time and memory grow with the contacts. M^-1 A is
symmetric in the product x M y.
"""

import math
from collections.abc import Sequence
from typing import Any

import numpy as np

from physics.analysis import stability
from physics.analysis.contact_stiffness import grips, mass_parts
from physics.rotation import rotation_matrix

Array = np.ndarray

# most products with a vector for the largest eigenvalue, and the residual at which they end, as a
# part of the eigenvalue, whose own error is of the order of its square
_MOST_PRODUCTS = 200
_CONVERGED = 1e-4


class ContactSystem:
    """A world's contacts as a linear system, in displacements and rotations [bodies, 6].

    Args:
        bodies: rows [bodies] of DYNAMIC_STATE.
        constants: rows [bodies] of DYNAMIC.
        ends: [n, 2] solids of each contact; beyond the bodies they don't move.
        point: [n, 3] m.
        normal: [n, 3].
        weight: [n] fraction of the stiffness.
        rows: coefficients, by the names of HALF_PAIR, of all kinds of contacts.
        kind: [n] row of each contact.
        dashpot: see `Features`.
        viscous: see `Features`.
    """

    def __init__(
        self,
        bodies: Array,
        constants: Array,
        ends: Array,
        point: Array,
        normal: Array,
        weight: Array,
        rows: Sequence[Any],
        kind: Array,
        dashpot: bool,
        viscous: bool,
    ) -> None:
        """Rotates the inertia of all bodies to their present orientations."""
        self._count, self._normal, self._weight = len(bodies), normal, weight
        self._rows, self._kind, self._laws = rows, kind, (dashpot, viscous)
        self._ends = [(ends[:, 0], 1.0), (ends[:, 1], -1.0)]
        self._arms = [
            point - bodies["position"][np.minimum(end, self._count - 1)] for end, _ in self._ends
        ]
        turn = rotation_matrix(bodies["orientation"])
        self._inverse_mass = constants["inverse_mass"][:, None]
        self._inverse = np.einsum("bij,bj,bkj->bik", turn, constants["inverse_inertia"], turn)
        inertia = np.where(np.isfinite(constants["inertia"]), constants["inertia"], 0.0)
        self._inertia = np.einsum("bij,bj,bkj->bik", turn, inertia, turn)  # a drive never rotates
        self._constants = constants
        self._grips = grips(ends, weight, [rows[n] for n in kind], self._count)
        self._parts = np.ones(len(kind))
        if not dashpot:
            self._parts = mass_parts(ends, normal, weight, constants["inverse_mass"])

    def largest_stable_step(self) -> float:
        """In s, with the servos of drives; inf if nothing touches and there are none."""
        servos = self._constants["servo_stiffness"] + self._constants["servo_damping"]
        if not len(self._kind) and not np.any(servos):
            return math.inf

        def load(h: float) -> float:
            servo = np.array([stability.servo_load(row, h) for row in self._constants])
            return self._largest_eigenvalue(self._loads(h), servo)

        return stability.root(load)

    def _largest_eigenvalue(self, loads: tuple[Array, Array, Array], servo: Array) -> float:
        """Of M^-1 A, by Lanczos' method from a random start, with full orthogonalisation."""
        x = np.random.default_rng(0).normal(size=(self._count, 6))
        x[:, 3:] *= np.any(self._constants["inverse_inertia"] > 0.0, axis=1)[:, None]
        x /= math.sqrt(np.sum(x * self._momentum(x)))
        vectors, momenta = np.zeros((2, 0, x.size))
        T = np.zeros((_MOST_PRODUCTS + 1, _MOST_PRODUCTS + 1))
        largest = 0.0
        for n in range(min(_MOST_PRODUCTS, x.size)):
            vectors = np.vstack([vectors, x.reshape(1, -1)])
            momenta = np.vstack([momenta, self._momentum(x).reshape(1, -1)])
            y: Any = self._accelerate(loads, servo, x).ravel()
            T[n, n] = momenta[n] @ y
            for _ in range(2):  # once more for what round-off has left
                y -= vectors.T @ (momenta @ y)
            y = y.reshape(x.shape)
            left = math.sqrt(max(np.sum(y * self._momentum(y)), 0.0))
            values, parts = np.linalg.eigh(T[: n + 1, : n + 1])
            largest = float(values[-1])
            if left * abs(parts[-1, -1]) <= _CONVERGED * largest:
                break
            T[n, n + 1] = T[n + 1, n] = left
            x = y / left
        return largest

    def _momentum(self, x: Array) -> Array:
        """M x, of a velocity [bodies, 6]."""
        turning = np.einsum("bij,bj->bi", self._inertia, x[:, 3:])
        return np.concatenate([x[:, :3] / self._inverse_mass, turning], axis=1)

    def _loads(self, h: float) -> tuple[Array, Array, Array]:
        """Of each contact, along the normal and across it in kg, and against rotation in kg m^2."""
        dashpot, viscous = self._laws
        along = np.zeros(len(self._kind))
        for n, row in enumerate(self._rows):
            own = self._kind == n
            along[own] = stability.normal_load(row, dashpot, h, self._parts[own])
        grips, across, twist = self._grips, np.zeros(len(self._kind)), np.zeros(len(self._kind))
        for n, row in enumerate(self._rows):
            own = self._kind == n
            across[own] = stability.shear_load(row, viscous, h, grips[own])
            twist[own] = stability.twist_load(row, h, grips[own])
        return along, across, twist

    def _accelerate(self, loads: tuple[Array, Array, Array], servo: Array, x: Array) -> Array:
        """M^-1 A x, see `analysis.stability`."""
        along, across, twist = loads
        weight, normal = self._weight, self._normal
        moved, turned = np.zeros_like(normal), np.zeros_like(normal)
        for (place, sign), arm in zip(self._ends, self._arms, strict=True):
            of = np.minimum(place, self._count - 1)
            is_body = (place < self._count)[:, None]
            moved += np.where(is_body, sign * (x[of, :3] + np.cross(x[of, 3:], arm)), 0.0)
            turned += np.where(is_body, sign * x[of, 3:], 0.0)
        normal_part = np.sum(moved * normal, axis=1)[:, None] * normal
        force = weight[:, None] * (
            along[:, None] * normal_part + across[:, None] * (moved - normal_part)
        )
        torque = (weight * twist)[:, None] * turned
        out = np.zeros_like(x)
        for (place, sign), arm in zip(self._ends, self._arms, strict=True):
            own = place < self._count
            np.add.at(out[:, :3], place[own], sign * force[own])
            np.add.at(out[:, 3:], place[own], sign * (np.cross(arm, force) + torque)[own])
        out[:, :3] += servo[:, None] * x[:, :3]
        out[:, :3] *= self._inverse_mass
        out[:, 3:] = np.einsum("bij,bj->bi", self._inverse, out[:, 3:])
        return out
