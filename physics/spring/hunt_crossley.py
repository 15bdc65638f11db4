"""Normal force of a touching sample: the spring law, with two kinds of damping.

`hunt_crossley` (default): f = k d (1 + a d'/v), with penetration d, its rate d' and the impact
speed v (Hunt and Crossley 1975). Damping vanishes with the penetration, so the force has no jump at
first touch. With u = d', integrating m u du/dd = -f from u = v to the end of the
contact gives the restitution e:

    a (1 + e) = ln((1 + a) / (1 - a e)),

which `physics.model.normal_damping` solves for a.

Where samples touch one after the other, as those of a cube that lands on its corner, the force of
all of them is K(d) (1 + a d'/v) if they have the same v, with a sum K(d) of their springs. The
integral is then the same for any K(d), and so is e. So a sample that joins others that still
approach takes over their ratio v/d', the mean with the forces as weights, but no more than their
mean v. Where all of them move alike this is their v; one that comes slowly from another side, as a
wall does that a body on the floor touches, keeps its own.

In discrete time the law needs two details.

1. The rate relaxes within the step. Let u be the rate at which it starts, c = k d a / v,
   x = c h / m, and L the load that presses the contact from outside. Then m u' = L - k d - c u has
   the mean force phi (k d + c u) + (1 - phi) L with phi = (1 - exp(-x)) / x. Replacing exp(-x) by
   1/(1 + x + x^2/2) keeps second order, and damping of any strength removes at most the whole
   approach speed.

   With L = 0 this is again a spring times 1 + a u/v, since phi depends on d alone. So e stays exact
   however strong the relaxation, and whatever part of a face's stiffness touches.

   L follows from the last step: L = f + q m (u - u_before) / h, limited to 0 ... k d. (Only a part
   of m counts here where several solids touch one of the two, see `mass_splitting`.) Both f and L
   are those of a sample scaled as if it had the pair's whole stiffness; the true ones are these
   times its weight. With W the weight of the samples in contact in the last step, and F their
   normal force, q is

   - f / F for a contact that collides. Each sample then gets its part of what the whole pair
     carries, which is nothing for a free body. By its weight, the corner of a cube would be given
     a load because its neighbours, which have just touched, bear less: e would be 0.1 too high.
   - 1 / W for a contact that lasts, as samples that had all of the stiffness would carry the mass
     m / W. By force, the samples of a leaning tower would act as softening springs, and it falls.

   A contact lasts if v is at most `_CALM` times the speed L / (m omega), which a body reaches that
   is set down under the load L without penetration; for a > 2, at most the `floor` of that load.

2. The kick of a step is the mean force over the step centred at the present position, during which
   the penetration moves by b = h |u| / 2 either way. Where it crosses zero, the mean of max(0, d)
   is (d + b)^2 / (4 b). So restitution does not depend on the phase of the step at first touch
   (docs/decisions/0007-normal-force.md).

The impact speed is reset whenever a contact turns from separating to approaching, so that a body
that has landed is damped by its present motion. `floor` is its least value.

`dashpot`: f = max(0, k d + c d') with a constant c, for comparison with other codes. It jumps at
first touch.
"""

import math

from physics.collision.contact_point import TOUCH_TOLERANCE
from physics.compiler.jit import stage

# A contact counts as lasting while its impact speed is at most max(a, this) * (load / m) / omega.
# A body that is set down without penetration reaches 1; the rest is a margin
_CALM = 2.0


@stage
def hunt_crossley_force(
    penetration,
    approach,
    k,
    a,
    floor,
    inverse_mass,
    speed_per_load,
    h,
    load_rate,
    inverse_mean_force,
    mean_impact_speed,
    impact_ratio,
    impact_speed,
    previous_force,
    previous_approach,
    exists,
):
    """Normal force of a sample that carries the whole pair's stiffness.

    Args:
        penetration: m; negative if apart.
        approach: m/s, rate of the penetration.
        k: N/m.
        a: damping coefficient.
        floor: m/s, lower bound of the impact speed.
        inverse_mass: 1/kg, inverse of the pair mass; for an owner with a single sample, inverse
            of the effective mass at its contact point, to which rotation contributes.
        speed_per_load: m/s per N, 1/(m omega) of the mass of `inverse_mass`.
        h: s.
        load_rate: kg/s, m / (W h).
        inverse_mean_force: 1/N, W / F of the last step, 0 where nothing was in contact.
        mean_impact_speed: m/s, of the pair in the last step; samples that separated count as 0.
        impact_ratio: of impact speed to rate of the samples that approached in the last step.
        impact_speed: m/s, remembered; negative while separating, 0 while apart.
        previous_force: N, f of the last step.
        previous_approach: m/s, of the last step.
        exists: whether the slot holds a sample; an empty one gives zeros.

    Returns:
        Force in N, impact speed to remember in m/s, and persistence: 1 for a contact that lasts,
        inversely proportional to the impact speed for a faster one, or to its approach times
        max(a / 2, 1) if that is more.
    """
    b = 0.5 * h * abs(approach) + 1e-30
    reach = penetration + b
    deep = penetration > b
    # mean penetration S/D, kept as a fraction: the whole force then takes one division
    S = penetration if deep else reach * reach
    D = 1.0 if deep else 4.0 * b
    begins = impact_speed == 0.0
    # a candidate that has just been listed has no rate of the last step
    joined = previous_approach * impact_ratio if previous_approach != 0.0 else mean_impact_speed
    # only a sample that comes through the surface joins: not one that was inside and changed face
    enters = penetration <= h * approach + TOUCH_TOLERANCE
    joined = min(joined, mean_impact_speed) if enters else 0.0
    # after turning around it is negative while the sample approaches, and `approach` is larger
    remembered = impact_speed if approach > 0.0 else abs(impact_speed)
    speed = max(max(joined if begins else remembered, approach), floor)
    calm_per_load = max(a, _CALM) * speed_per_load
    change = load_rate * (approach - previous_approach)
    by_force = previous_force + change * (previous_force * inverse_mean_force)
    lasts = speed <= max(floor, calm_per_load * by_force)
    load = previous_force + change if lasts else by_force
    load = 0.0 if begins else max(min(load, k * penetration), 0.0)
    v = max(speed, a * speed_per_load * load)
    # numerators over r: a d / v = y / r, and the x of the docstring is x / r
    r = v * D
    y = a * S
    x = h * k * inverse_mass * y
    numerator = k * (v * S + y * approach) * (r + 0.5 * x) + 0.5 * x * (r + x) * load
    divisor = r * r + r * x + 0.5 * x * x
    # near e = 0 any impact is slow compared with `floor`, but not with the speed that a load gives
    fastest = max(v, abs(approach) * max(a / _CALM, 1.0))
    # for both quotients: divisions are the expensive part
    inverse = 1.0 / (divisor * fastest)
    force = numerator * fastest * inverse
    # a sample that is apart, in reach only through b, and separates already, never touched
    touching = (reach > 0.0) & ((impact_speed != 0.0) | (approach > 0.0) | (penetration > 0.0))
    touching &= exists
    force = force if touching & (force > 0.0) else 0.0
    impact_speed = speed if approach > 0.0 else -speed
    impact_speed = impact_speed if touching else 0.0
    calm = max(floor, calm_per_load * load)
    return force, impact_speed, min(1.0, calm * divisor * inverse)


@stage
def dashpot_force(
    penetration,
    approach,
    k,
    zeta,
    floor,
    inverse_mass,
    speed_per_load,
    h,
    load_rate,
    inverse_mean_force,
    mean_impact_speed,
    impact_ratio,
    impact_speed,
    previous_force,
    previous_approach,
    exists,
):
    """As `hunt_crossley_force`, by the clamped linear dashpot.

    Its damping force is the mean over a step in which nothing else acts. It ignores `floor`, the
    load and what contacts remember.
    """
    rate = 2.0 * zeta * math.sqrt(k * inverse_mass)
    x = rate * h
    damped = rate / inverse_mass * approach * (1.0 + 0.5 * x) / (1.0 + x + 0.5 * x * x)
    force = k * penetration + damped
    force = force if (penetration > 0.0) & (force > 0.0) & exists else 0.0
    return force, 0.0, 1.0
