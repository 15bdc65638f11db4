"""Stiffness and damping of tangential contact springs, from the normal stiffness and the masses."""

import numpy as np

from physics.compiler.jit import stage
from physics.scene.fidelity import Fidelity

Array = np.ndarray


# ratio of shear to normal stiffness, each divided by its effective mass. Steel has 2/3 to 1, but at
# a contact resolution of 0.5 the damping that belongs to it makes a body that pitches between two
# others unstable: a tower chatters and creeps apart
SHEAR_RATIO = 1.0 / 3.0
# eigenvalue of a step at which a mode only changes its sign
FLIP = 2.0


def shear_ratio(resolution: float) -> float:
    """Ratio of shear to normal stiffness of contacts whose stiffness follows from the step.

    Finer steps allow more than SHEAR_RATIO, and need it to stick: friction in a collision is
    damping alone. At a resolution of 0.2, SHEAR_RATIO left a ball that hit the ground at 1 m/s
    sliding at 1.2 mm/s.

    Args:
        resolution: rad per step, `Fidelity.contact_resolution`.
    """
    # so that the shear oscillation advances by the same phase per step as at the default resolution
    return min(1.0, SHEAR_RATIO * max(1.0, (Fidelity.contact_resolution / resolution) ** 2))


@stage
def tangential_coefficients(
    stiffness: Array,
    pair_mass: Array,
    shear_mass: Array,
    rocking_leverage: Array,
    ratio: Array,
    step: float,
) -> tuple[Array, Array]:
    """Shear stiffness N/m and damping N s/m of pairs, of any shape that broadcasts.

    Args:
        stiffness: N/m, normal.
        pair_mass: kg, reduced mass.
        shear_mass: kg, effective mass of a tangential force at the surface. Rotation makes it
            smaller than the pair mass, and the shear spring softer by the same ratio, so no
            tangential mode is faster than the normal ones.
        rocking_leverage: see `rocking.rocking_leverage`.
        ratio: of shear to normal stiffness, each divided by its effective mass.
        step: s.
    """
    k = ratio * stiffness * shear_mass / pair_mass
    rocking = 2.0 * k * pair_mass * (1.0 + rocking_leverage * k / stiffness)
    slow = k * step
    return k, 0.5 * (np.sqrt(4.0 / 3.0 * (slow * slow) + 4.0 * rocking) - slow)


@stage
def grip_of(load: float, spring_part: float) -> float:
    """Factor on the damping of friction with which a body's load doesn't exceed that of a flip.

    Args:
        load: of all contacts of a body, see `spring.mass_splitting`.
        spring_part: the part of a contact's own load that its spring has; its damping has the rest.
    """
    whole = FLIP / max(load, FLIP)
    return max(whole - spring_part, 0.0) / (1.0 - spring_part)
