"""The largest stable step of the spring law.

Kick-drift-kick with forces that see the half-step velocity becomes unstable first in a linear mode
that flips at every step: the velocity u changes its sign, and the force reverses it fully. Let M be
the masses, and h F = A u what a step's force does to a velocity that flips. The limit is where the
largest eigenvalue of M^-1 A reaches 2. A spring and an explicit damper give A = h c + h^2 k / 2,
that is omega h < 2 (sqrt(1 + zeta^2) - zeta) for one degree of freedom. Rotation, damping and modes
of several bodies are all in the matrices.

The normal law relaxes within the step and estimates the load from the last one (see
`hunt_crossley`): f = phi (k d + c u) + (1 - phi) L. A contact that approaches has L = k d, its
upper limit; one that separates has L = f_before + m (u - u_before) / h. With u flipping, A is
phi h c + h^2 k / 2 for the first, and phi (h c + h^2 k / 2) + (1 - phi) (2 m - A of the first) for
the second. In a rocking mode half of the contacts are of either kind; in other modes all contacts
alternate. So A is the mean of the two. In L, m is divided by the n of `spring.mass_splitting`.
"""

import math
from collections import Counter
from collections.abc import Callable
from typing import Any

import numpy as np

from physics.model.features import Features
from physics.model.normal_damping import REST_DAMPING
from physics.model.rocking import face_contacts, largest_eigenvalue
from physics.model.tables import Model
from physics.scene.drives import Drive
from physics.scene.scene import Scene
from physics.scene.solids import Body

Array = np.ndarray

# eigenvalue at which a mode that flips becomes unstable
_FLIP = 2.0
_SHORTEST, _LONGEST = 1e-12, 1e3  # s, between which limits are sought
_PRECISION = 1e-10  # of a step, relative
_MOST = 1e300  # a load beyond it counts as this, so that logarithms are finite
# solids that can touch a body at once, all on faces: a cube has six
_PARTNERS = 6
_TURN = np.diag([0.0, 0.0, 0.0, 1.0, 1.0, 1.0])


def normal_load(half_pair: Any, dashpot: bool, h: float, parts: Any = 1.0) -> Any:
    """A in kg of a half-pair's whole normal stiffness, for contacts that last.

    parts: n of each contact, see `contact_stiffness.mass_parts`. A falls with it.
    """
    k, m = float(half_pair["stiffness"]), float(half_pair["pair_mass"])
    damping = float(half_pair["damping"])
    critical = math.sqrt(k * m)
    if dashpot:
        x = 2.0 * damping * h * math.sqrt(k / m)
        phi = (1.0 + 0.5 * x) / (1.0 + x + 0.5 * x * x)
        return 2.0 * damping * critical * h * phi + 0.5 * h * h * k
    # of a contact that lasts, see normal_damping.rest_time
    c = 2.0 * REST_DAMPING * critical if damping > 0.0 else 0.0
    x = h * c / m
    phi = (1.0 + 0.5 * x) / (1.0 + x + 0.5 * x * x)
    approaching = phi * h * c + 0.5 * h * h * k
    parting = phi * (h * c + 0.5 * h * h * k) + (1.0 - phi) * (2.0 * m / parts - approaching)
    return 0.5 * (approaching + parting)


def shear_load(half_pair: Any, viscous: bool, h: float, grip: Any = 1.0) -> Any:
    """A in kg of a half-pair's whole shear stiffness. `grip`: see `contact_stiffness.grips`."""
    if half_pair["friction"] == 0.0:
        return 0.0
    spring = 0.0 if viscous else 0.5 * h * h * float(half_pair["shear_stiffness"])
    return grip * h * float(half_pair["shear_damping"]) + spring


def twist_load(half_pair: Any, h: float, grip: Any = 1.0) -> Any:
    """A in kg m^2 of a half-pair's whole resistance against rolling and spinning."""
    if half_pair["rolling"] == 0.0 and half_pair["spinning"] == 0.0:
        return 0.0
    spring = 0.5 * h * h * float(half_pair["twist_stiffness"])
    return grip * h * float(half_pair["twist_damping"]) + spring


def servo_load(dynamic: Any, h: float) -> float:
    """A in kg of a drive's servo."""
    return h * float(dynamic["servo_damping"]) + 0.5 * h * h * float(dynamic["servo_stiffness"])


def root(load: Callable[[float], float]) -> float:
    """Step in s at which a load that grows with the step reaches the limit; inf if it doesn't.

    `_SHORTEST` if the load exceeds the limit there already. By regula falsi between logarithms, in
    which loads are nearly straight. An end that stays counts half at each further step (the
    Illinois rule), so that both ends come close.
    """

    def excess(x: float) -> float:
        return math.log(max(min(_MOST, load(math.exp(x))), 1.0 / _MOST) / _FLIP)

    ends = [math.log(_SHORTEST), math.log(_LONGEST)]
    values = [excess(x) for x in ends]
    if values[1] < 0.0:
        return math.inf
    if values[0] >= 0.0:
        return _SHORTEST
    moved = -1
    while ends[1] - ends[0] > _PRECISION:
        low, high = ends
        middle = low + (high - low) * values[0] / (values[0] - values[1])
        margin = 0.25 * _PRECISION  # beyond the root, once that is found
        middle = min(max(middle, low + margin), high - margin)
        value = excess(middle)
        end = int(value >= 0.0)
        ends[end], values[end] = middle, value
        if end == moved:
            values[1 - end] *= 0.5
        moved = end
    return math.exp(ends[0])


def of_servo(dynamic: Any) -> float:
    """Largest stable step in s of a drive that touches nothing."""
    return root(lambda h: servo_load(dynamic, h) * float(dynamic["inverse_mass"]))


def of_scene(scene: Scene, model: Model, features: Features, spacing: float) -> tuple[float, int]:
    """A safe step in s for any state of a scene, and the index of the dynamic body that limits it.

    A bound: each dynamic body lies flat on its six stiffest neighbours at once.
    """
    dynamic_bodies: list[Body | Drive] = [*scene.bodies, *scene.driven_bodies]
    if not dynamic_bodies:
        return math.inf, 0
    steps = [
        _of_dynamic_body(
            model, features, i, face_contacts(dynamic.shape, spacing * dynamic.shape.width)
        )
        for i, dynamic in enumerate(dynamic_bodies)
    ]
    limiting = int(np.argmin(steps))
    return steps[limiting], limiting


def _of_dynamic_body(
    model: Model, features: Features, i: int, faces: list[tuple[Array, Array]]
) -> float:
    """A safe step in s for dynamic body i, whatever it touches.

    Against another dynamic body, the stiffness that counts for it is (1 + its mass / the other's
    mass) times that of the contact.
    """
    this = model.dynamic[i]
    inverse = np.diag([float(this["inverse_mass"])] * 3 + list(this["inverse_inertia"]))
    # by the other solid and, as compounds touch through several half-pairs, by their number
    partners: dict[tuple[int, int], list[Any]] = {}
    met: Counter[tuple[int, int]] = Counter()
    for half_pair in model.half_pair:
        ends = (int(half_pair["owner"]), int(half_pair["surface"]))
        if i in ends:
            other = ends[0] if ends[1] == i else ends[1]
            partners.setdefault((other, met[ends]), []).append(half_pair)
            met[ends] += 1
    ways = {other: ((i, other) in met) + ((other, i) in met) for other, _ in partners}
    along, across = (np.array(parts) for parts in zip(*faces, strict=True))  # [faces, 6, 6]

    def load(h: float) -> float:
        at_servo = servo_load(this, h) * float(this["inverse_mass"])
        if features.impulse:  # its contacts are stable at any step
            return at_servo
        loads = []  # along, across and about the normal, of each partner
        for (other, _), half_pairs in partners.items():
            # two solids that both carry samples share their stiffness between two half-pairs
            fraction = 1.0 / ways[other]
            if other < len(model.dynamic):
                fraction *= 1.0 + model.dynamic[other]["inverse_mass"] / this["inverse_mass"]
            normal = fraction * sum(normal_load(row, features.dashpot, h) for row in half_pairs)
            shear = fraction * sum(shear_load(row, features.viscous, h) for row in half_pairs)
            twist = fraction * sum(twist_load(row, h) for row in half_pairs)
            loads.append((normal, shear, twist))
        normal, shear, twist = np.array(loads).reshape(-1, 3).T[..., None, None, None]
        A = normal * along + shear * across + twist * _TURN  # [partners, faces, 6, 6]
        each = largest_eigenvalue(inverse, A).max(axis=1)
        return float(sum(sorted(each)[-_PARTNERS:]) + at_servo)

    return root(load)
