"""Damping coefficients of the normal force, from the restitution that a user asks for."""

from collections.abc import Callable

import numpy as np

Array = np.ndarray


# below this restitution an impact ends within one step in any case
_LEAST_RESTITUTION = 5e-4


# damping of a body at rest, over critical. With critical damping a flat or a tall block, which
# rocks faster than it bobs, would chatter and creep
REST_DAMPING = 0.5


def _bisect(function: Callable[[Array], Array], low: Array, high: Array) -> Array:
    """Roots of increasing functions, one an element, to round-off."""
    for _ in range(200):
        middle = 0.5 * (low + high)
        between = (middle != low) & (middle != high)
        if not between.any():
            break
        below = function(middle) < 0.0
        low = np.where(between & below, middle, low)
        high = np.where(between & ~below, middle, high)
    return 0.5 * (low + high)


def clamped_dashpot_restitution(zeta: Array) -> Array:
    """Restitution of f = max(0, k d + c d') at the damping ratio zeta.

    The contact ends where the acceleration vanishes; there the speed is v exp(-zeta omega t).
    """
    root = np.sqrt(np.abs(1.0 - zeta**2))
    under = np.pi - 2.0 * np.arctan2(zeta, root)
    duration = np.where(zeta < 1.0, under, 2.0 * np.log(zeta + root))
    critical = root == 0.0
    return np.exp(-zeta * np.where(critical, 2.0, duration / np.where(critical, 1.0, root)))


def damping_coefficients(restitution: Array, law: str) -> Array:
    """Dimensionless damping: a of the "hunt_crossley" law, the ratio zeta of the "dashpot".

    Args:
        restitution: of any number of contacts.
        law: of the damping.
    """
    values, where = np.unique(restitution, return_inverse=True)
    e = np.clip(values, _LEAST_RESTITUTION, 1.0)
    if law == "dashpot":
        zeros, most = np.zeros(e.shape), np.full(e.shape, 100.0)
        found = _bisect(lambda zeta: e - clamped_dashpot_restitution(zeta), zeros, most)
    else:
        found = _hunt_crossley(e)
    return np.where(e < 1.0, found, 0.0)[where].reshape(restitution.shape)


def _hunt_crossley(e: Array) -> Array:
    # with s = -ln(1 - a e) the equation is well conditioned up to a = 1/e
    def excess(s: Array) -> Array:
        a = -np.expm1(-s) / e
        return np.asarray(s + np.log1p(a) - a * (1.0 + e))

    # excess falls from 0 before it rises through the root
    return np.asarray(-np.expm1(-_bisect(excess, 1.2 * (1.0 - e), 2.0 / e)) / e)


def damping_errors(restitution: Array, damping: Array, law: str) -> Array:
    """Relative error of a "hunt_crossley" coefficient per (omega h)^2; 0 of a "dashpot".

    Steps of h change what a damping coefficient a does. In units of v and 1/omega, with
    s = omega h and W = ln(1 + a u), the law of a step (`hunt_crossley_force`) is

        W(t + s/2) - W(t - s/2) = -ln(1 + x + x^2/2) = -x + x^3/6 + ...,  x = s a d,
        d(t + s) - d(t) = s u(t + s/2).

    By Taylor expansion smooth u(t) and d(t) obey, up to higher orders of s and with D = d/dt,

        D W = -a d + s^2 (a^3 d^3 / 6 - D^3 W / 24),  D d = u - s^2 D^2 u / 24.

    So the first integral E = u/a - ln(1 + a u)/a^2 + d^2/2 is not constant:
    D E = s^2 a d^3 (3 a u - 1) / 24. Over a contact the integral of d^3 u vanishes, and that of d^3
    is (1 - e^2)/a, so E falls by s^2 (1 - e^2)/24. (First and last touch add nothing of this order,
    because the law takes the mean penetration of a step.) E at the end depends on e, so this is an
    error of e; divided by de/da it is an error of a, which relative to a is

        (1 - e^2) / (24 (e^2/(1 - a e) - 1/(1 + a))),  between 0 (e = 0) and 1/12 (e = 1).

    Where samples of the weight W are in contact, omega^2 is W k/m.
    """
    e, a = np.clip(restitution, _LEAST_RESTITUTION, 1.0), damping
    if law == "dashpot":
        return np.zeros(e.shape)
    out, back = 1.0 + a, 1.0 - a * e
    bounces = e < 1.0 - 1e-6  # above, the difference below is round-off
    slope = np.where(bounces, 24.0 * (e * e * out - back), 1.0)
    return np.where(bounces, (1.0 - e * e) * out * back / slope, 1.0 / 12.0)


def rest_time(damping: Array, omega: Array) -> Array:
    """Time in s in which the load of a contact at rest gives the lower bound of the impact speed.

    That bound damps it by REST_DAMPING.

    Args:
        damping: coefficient of the law, of any number of contacts.
        omega: rad/s, natural frequency of each contact.
    """
    # at the sink g/omega^2 of a load m g the damping is m g a / v; critical is 2 m omega
    return damping / (2.0 * REST_DAMPING * omega)
