"""Stiffness and damping of tangential contact springs, from the normal stiffness and the masses."""

import numpy as np

Array = np.ndarray


# of shear to normal stiffness, each by the mass that feels it. Steel has 2/3 to 1, but the damping
# that goes with it would be too much at a contact resolution of 0.5 for a body that pitches between
# two others: a tower chatters and creeps apart
SHEAR_RATIO = 1.0 / 3.0


def shear_ratio(resolution: float) -> float:
    """Of shear to normal stiffness, of contacts whose stiffness follows from the step.

    Finer steps bear more than SHEAR_RATIO, and need it to stick: in a collision friction is damping
    alone, and at a resolution of 0.2 it left a ball that hit the ground at 1 m/s with slip of
    1.2 mm/s.

    Args:
        resolution: rad a step, `Fidelity.contact_resolution`.
    """
    return min(1.0, SHEAR_RATIO * max(1.0, (0.5 / resolution) ** 2))


def tangential_coefficients(
    stiffness: Array,
    pair_mass: Array,
    shear_mass: Array,
    leverage: Array,
    ratio: Array,
    step: float,
) -> tuple[Array, Array]:
    """Shear stiffness N/m and damping N s/m of pairs, of any shape that broadcasts.

    Args:
        stiffness: N/m, normal.
        pair_mass: kg, reduced mass.
        shear_mass: kg that a tangential force at the surface feels; turning makes it less than the
            pair mass, and the shear spring that much softer, so that no tangential mode is faster
            than the normal ones.
        leverage: stiffness times the square of the height over the face, by the stiffness against
            rocking.
        ratio: of shear to normal stiffness, each by the mass that feels it.
        step: s.
    """
    k = ratio * stiffness * shear_mass / pair_mass
    rocking = 2.0 * k * pair_mass * (1.0 + leverage * k / stiffness)
    slow = k * step
    return k, 0.5 * (np.sqrt(4.0 / 3.0 * (slow * slow) + 4.0 * rocking) - slow)
