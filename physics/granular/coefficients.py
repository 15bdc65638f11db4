"""Coefficients of a contact, from those of the two classes of bodies and from their masses."""

import math

from physics.compiler.jit import stage
from physics.model.tangential import tangential_coefficients


@stage
def contact_coefficients(
    unit_stiffness, stiffness, shear_ratio, leverage, first_compliance, second_compliance,
    first_inverse_mass, second_inverse_mass, step,
):  # fmt: skip
    """Coefficients of two bodies, or of a body and a static.

    Args:
        unit_stiffness: see CONTACT, as the next five.
        stiffness: likewise.
        shear_ratio: likewise.
        leverage: likewise.
        first_compliance: likewise.
        second_compliance: likewise.
        first_inverse_mass: 1/kg, of the owner.
        second_inverse_mass: 1/kg, of the surface; 0 of a static.
        step: s, `Fidelity.substep`.

    Returns:
        Stiffness in N/m, inverse of the pair mass in 1/kg, shear stiffness in N/m, shear damping in
        N s/m.
    """
    inverse_mass = first_inverse_mass + second_inverse_mass
    mass = 1.0 / inverse_mass
    k = stiffness if stiffness > 0.0 else unit_stiffness * mass
    shear_mass = 1.0 / (
        first_compliance * first_inverse_mass + second_compliance * second_inverse_mass
    )
    shear, damping = tangential_coefficients(k, mass, shear_mass, leverage, shear_ratio, step)
    return k, inverse_mass, shear, damping


@stage
def shear_loads(stiffness, damping, first, second, weight, step):
    """Shear loads of a contact on its two bodies, and their part that is due to the spring.

    See `spring.mass_splitting`.

    Args:
        stiffness: N/m, of the shear spring; 0 of viscous friction.
        damping: N s/m, before it is reduced.
        first: 1/kg, inverse shear mass of the owner.
        second: likewise of the surface; 0 of a static.
        weight: of the particle.
        step: s.
    """
    spring, coupling = 0.5 * step * stiffness, math.sqrt(first * second)
    load = weight * step * (damping + spring)
    part = spring / max(damping + spring, 1e-300)
    return load * (first + coupling), load * (second + coupling), part
