"""The largest stable step of the spring law.

Kick-drift-kick, with forces that see the half-step velocity, loses a linear mode when it flips at
every step: u changes its sign, and the force's share at that rhythm reverses it fully. With masses
M and h F = A u for what a step's force does to a velocity that flips, that is where the largest
eigenvalue of M^-1 A reaches 2. A spring and an explicit damper give A = h c + h^2 k / 2, which is
omega h < 2 (sqrt(1 + zeta^2) - zeta) for one degree of freedom. Rotation, damping and modes of
several bodies are all in the matrices.

The normal law relaxes within the step and estimates the load from the last one. With the share phi
of spring and damper, f = phi (k d + c u) + (1 - phi) L, L = f_before + m (u - u_before) / h, but at
most k d, which is what it is at rest: a contact that approaches has L = k d, and one that parts the
estimate. With u flipping, A is then phi h c + h^2 k / 2 of the one and phi (h c + h^2 k / 2) +
(1 - phi) (2 m - A of the one) of the other. In a mode that rocks, half of the contacts are either;
in others they take turns: A is the mean.
"""

import math
from collections import Counter
from collections.abc import Callable
from typing import Any

import numpy as np

from physics.analysis import diagnostics
from physics.model.features import Features
from physics.model.rocking import landings
from physics.model.state import State
from physics.model.tables import Model
from physics.scene.scene import Body, Drive, Scene

Array = np.ndarray

# A mode that flips is lost at 2
_FLIP = 2.0
_LONGEST = 1e3  # s, a step that no contact limits
# partners that a body can lie between at once: a cube has six faces
_PARTNERS = 6
_TURN = np.diag([0.0, 0.0, 0.0, 1.0, 1.0, 1.0])


def _normal(side: Any, dashpot: bool, h: float) -> float:
    """A in kg of a side's whole normal stiffness, for a contact that lasts."""
    k, m, damping = float(side["stiffness"]), float(side["pair_mass"]), float(side["damping"])
    critical = math.sqrt(k * m)
    if dashpot:
        x = 2.0 * damping * h * math.sqrt(k / m)
        share = (1.0 + 0.5 * x) / (1.0 + x + 0.5 * x * x)
        return 2.0 * damping * critical * h * share + 0.5 * h * h * k
    # a contact that lasts is damped half critically, see normal_force.rest_speed
    c = critical if damping > 0.0 else 0.0
    x = h * c / m
    phi = (1.0 + 0.5 * x) / (1.0 + x + 0.5 * x * x)
    approaching = phi * h * c + 0.5 * h * h * k
    parting = phi * (h * c + 0.5 * h * h * k) + (1.0 - phi) * (2.0 * m - approaching)
    return 0.5 * (approaching + parting)


def _across(side: Any, viscous: bool, h: float) -> float:
    """A in kg of a side's whole shear stiffness."""
    if side["friction"] == 0.0:
        return 0.0
    spring = 0.0 if viscous else 0.5 * h * h * float(side["shear_stiffness"])
    return h * float(side["shear_damping"]) + spring


def _twist(side: Any, h: float) -> float:
    """A in kg m^2 of a side's whole resistance against rolling and spinning."""
    if side["rolling"] == 0.0 and side["spinning"] == 0.0:
        return 0.0
    return h * float(side["twist_damping"]) + 0.5 * h * h * float(side["twist_stiffness"])


def _servo(mover: Any, h: float) -> float:
    """A in kg of a drive's servo."""
    return h * float(mover["servo_damping"]) + 0.5 * h * h * float(mover["servo_stiffness"])


def _root(load: Callable[[float], float]) -> float:
    """Step in s at which a growing load reaches the flip; inf if it never does."""
    if load(_LONGEST) < _FLIP:
        return math.inf
    low, high = 1e-12, _LONGEST
    for _ in range(60):  # in ratios: 1e15 to 1e-3 of a percent
        middle = math.sqrt(low * high)
        low, high = (middle, high) if load(middle) < _FLIP else (low, middle)
    return low


def _largest(inverse_mass: Array, A: Array) -> float:
    """Largest eigenvalue of M^-1 A, both symmetric and not negative."""
    return float(np.linalg.eigvals(inverse_mass @ A).real.max(initial=0.0))


def of_contacts(model: Model, features: Features, state: State, world: int) -> float:
    """Largest stable step in s of a world with the contacts that it has now; inf if free."""
    shares = {} if features.impulse else diagnostics.contact_shares(model, features, state, world)
    model = model.of_world(world)
    inverse = diagnostics.inverse_masses(model, state, world)

    def load(h: float) -> float:
        A = np.zeros_like(inverse)
        for k, (along, across, turn) in shares.items():
            side = model.side[k]
            A += _normal(side, features.dashpot, h) * along
            A += _across(side, features.viscous, h) * across + _twist(side, h) * turn
        for i, mover in enumerate(model.mover):
            block = slice(6 * i, 6 * i + 3)
            A[block, block] += _servo(mover, h) * np.eye(3)
        return _largest(inverse, A)

    return _root(load)


def of_servo(mover: Any) -> float:
    """Largest stable step in s of a drive that touches nothing."""
    return _root(lambda h: _servo(mover, h) * float(mover["inverse_mass"]))


def of_scene(scene: Scene, model: Model, features: Features, spacing: float) -> tuple[float, int]:
    """A safe step in s for any state of a scene, and the index of the mover that binds it.

    A bound: each mover lies flat on its six stiffest partners at once.
    """
    movers: list[Body | Drive] = [*scene.bodies, *scene.tools]
    if not movers:
        return math.inf, 0
    steps = [
        _of_mover(model, features, i, landings(mover.shape, spacing * mover.shape.width))
        for i, mover in enumerate(movers)
    ]
    binding = int(np.argmin(steps))
    return steps[binding], binding


def _of_mover(
    model: Model, features: Features, i: int, sides_of: list[tuple[Array, Array]]
) -> float:
    """A safe step in s for mover i in any company.

    Against another that moves, its own share of their mode is (1 + its mass / the other's) of the
    contact.
    """
    row = model.mover[i]
    inverse = np.diag([float(row["inverse_mass"])] * 3 + list(row["inverse_inertia"]))
    # by the other solid and, as compounds meet through several sides either way, by their count
    partners: dict[tuple[int, int], list[Any]] = {}
    met: Counter[tuple[int, int]] = Counter()
    for side in model.side:
        ends = (int(side["owner"]), int(side["surface"]))
        if i in ends:
            other = ends[0] if ends[1] == i else ends[1]
            partners.setdefault((other, met[ends]), []).append(side)
            met[ends] += 1
    ways = {other: ((i, other) in met) + ((other, i) in met) for other, _ in partners}

    def load(h: float) -> float:
        each = []
        for (other, _), sides in partners.items():
            # two solids that both carry samples share their stiffness between two sides
            share = 1.0 / ways[other]
            if other < len(model.mover):
                share *= 1.0 + model.mover[other]["inverse_mass"] / row["inverse_mass"]
            normal = share * sum(_normal(side, features.dashpot, h) for side in sides)
            shear = share * sum(_across(side, features.viscous, h) for side in sides)
            twist = share * sum(_twist(side, h) for side in sides) * _TURN
            each.append(max(_largest(inverse, normal * n + shear * t + twist) for n, t in sides_of))
        if features.impulse:  # soft contacts are solved for the end of the step
            each = []
        return float(sum(sorted(each)[-_PARTNERS:]) + _servo(row, h) * row["inverse_mass"])

    return _root(load)
