"""Normal force of a touching sample: the spring law, with two kinds of damping.

`overlap` (default), after Hunt and Crossley: f = k d (1 + a d'/v), with overlap d, its rate d' and
the impact speed v. Damping vanishes with the overlap, so there is no jump at first touch. From
m d'' = -f and an impact at speed v the rebound ratio e obeys, by integrating v dv/dd,

    a (1 + e) = ln((1 + a) / (1 - a e)),

which `damping_coefficient` solves for a. Two details make the discrete law as good as that:

- The rate relaxes within the step. With u the half-step rate before it, c = k d a / v, x = c h / m
  and the load L that presses the contact from outside, m u' = L - k d - c u has the mean force
  phi (k d + c u) + (1 - phi) L, phi = (1 - exp(-x)) / x. For exp(-x) stands 1/(1 + x + x^2/2):
  second order, and a damping however strong takes at most the whole approach speed.
  L follows from the last step, L = f + m (u - u_before) / h, kept within 0 and k d.
  A face, an edge and a corner bear different shares W of the pair's stiffness, however many samples
  stand for them. f is that of a whole face, so for L it moves m / W, with the W that last touched.
  Let F be the pair's normal force in the last step, and so F / W the mean of f over what touched.
  Where a cube lands on its corner, the samples around it come to touch and bear little yet. Were
  all alike, the corner would seem loaded with what they can't take, and rebound a tenth too fast.
  So a sample whose f is above `_AHEAD` times the mean counts by its force, with f / F in place of
  1 / W; so does one below the mean whose approach slows, u < u_before, for it can't give what it
  doesn't bear. By either rule alone the loads of all samples sum to F + m (u - u_before) / h; where
  both are at work L is estimated a little too high.
- The kick of a step is the mean force over the step centred at the present position, along which
  the overlap moves by b = h |u| / 2 either way: where it crosses zero, the mean of max(0, d) is
  (d + b)^2 / (4 b). Restitution no longer depends on where in a step the touch falls: at
  omega h = 0.2 and e = 0.5 the spread over all phases was 9e-6 when tried, without it 1.7e-3.

The impact speed of a contact that lasts starts anew whenever it turns from separating to
approaching, with a floor at rest, so that a body that has landed is damped by its present motion.

`dashpot`: f = max(0, k d + c d'), for comparison with other codes. It jumps at first touch. Because
the force is never allowed to pull, the contact ends before the overlap does, and the usual
zeta = -ln e / sqrt(pi^2 + ln^2 e) gives too high an e; the formula here is for the clamped force.
"""

import math

import numpy as np

from physics.jit import stage

Array = np.ndarray

# of the speed that a contact's load gives it in 1/omega, below which it doesn't count as colliding
_CALM = 2.0
# times the mean force of what touches. Those of a cube that leans in a tower differ by less: there
# a share that grows with the force would be a spring that softens, and at `fast` every fifth tower
# of three would sway apart
_AHEAD = 1.6


@stage
def overlap_force(
    overlap, approach, k, a, floor, inverse_mass, h, mass_rate, per_mean, memory, load, before
):
    """Normal force [N] of a sample that carries the whole pair's stiffness, its new memory, `rest`.

    `rest` is 1 for a contact that lasts and falls to 0 with the speed of a collision.

    Args:
        overlap: m; negative if apart.
        approach: m/s, rate of the overlap.
        k: N/m.
        a: damping coefficient.
        floor: m/s.
        inverse_mass: 1/kg of the pair, at this point if it is its only sample.
        h: s.
        mass_rate: kg/s, m / (W h), of the same mass: else the load that it tells swings.
        per_mean: 1/N, W / F of the last step, 0 where nothing bore.
        memory: m/s, impact speed, negative while separating, 0 while apart.
        load: N, last step's force.
        before: m/s, last step's approach.
    """
    b = 0.5 * h * abs(approach) + 1e-30
    s = overlap + b
    deep = overlap > b
    # mean overlap S/D, kept as a fraction: the whole force then takes one division
    S = overlap if deep else s * s
    D = 1.0 if deep else 4.0 * b
    turned = (memory < 0.0) & (approach > 0.0)
    speed = 0.0 if turned else abs(memory)
    speed = max(max(speed, approach), floor)
    change, ahead = approach - before, load * per_mean
    by_force = (ahead > _AHEAD) | ((ahead < 1.0) & (change < 0.0))
    rate = mass_rate * (ahead if by_force else 1.0)
    outside = load + rate * change if memory != 0.0 else 0.0
    outside = min(max(outside, 0.0), k * max(overlap, 0.0))
    # a pressed contact is at rest under its load as a lying body is under its weight
    loaded = outside * math.sqrt(inverse_mass / k)
    slowest = max(speed, a * loaded)
    y = a * S
    x = h * k * inverse_mass * y
    r = slowest * D
    pushed = k * (slowest * S + y * approach) * (r + 0.5 * x) + 0.5 * x * (r + x) * outside
    divisor = r * r + r * x + 0.5 * x * x
    inverse = 1.0 / (divisor * slowest)  # for both quotients: a division costs as much as the rest
    force = pushed * slowest * inverse
    # what is met only by the mean over the drift, and leaves already, has never been met
    touching = (s > 0.0) & ((memory != 0.0) | (approach > 0.0) | (overlap > 0.0))
    force = force if touching & (force > 0.0) else 0.0
    memory = speed if approach > 0.0 else -speed
    memory = memory if touching else 0.0
    # as slow as its load would make it in a step or two, it lasts
    calm = max(floor, max(a, _CALM) * loaded)
    return force, memory, min(1.0, calm * divisor * inverse)


@stage
def dashpot_force(
    overlap, approach, k, zeta, floor, inverse_mass, h, mass_rate, per_mean, memory, load, before
):
    """As `overlap_force`, by the clamped linear dashpot; damping is exact over a step."""
    rate = 2.0 * zeta * math.sqrt(k * inverse_mass)
    x = rate * h
    force = k * overlap + rate / inverse_mass * approach * (1.0 + 0.5 * x) / (1.0 + x + 0.5 * x * x)
    force = force if (overlap > 0.0) & (force > 0.0) else 0.0
    return force, 0.0, 1.0
