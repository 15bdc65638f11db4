"""Sequential impulses: one sweep over the contact rows of a half-pair.

A soft contact is a spring k and damper c whose force is that at the end of the step. With
a = h (c + h k), effective mass m and the impulse p so far, p changes by

    -(u n + k h/a separation + p/a) m a/(m + a),

which is stable at any step, for any k. At rest it sinks as the spring of that stiffness would,
load / k. The speed at which overlapping bodies are pushed apart is limited.

Friction is rigid: it removes the sliding velocity that remains, with at most mu times the normal
impulse. An anchor remembers how far the point has crept since it came to stick, and pulls it back.
The effective mass across the normal is the smallest in any direction, so that a step can only
decrease the energy even where the cone cuts it. Resistance against rolling and spinning is the same
law for the relative angular velocity.

The sweep that relaxes takes back normal impulses of the last step where the solids are apart, and
friction with them, as far as it exceeds mu times what is left. That gives energy back: as much as
friction took too much, if the sliding velocity is still nearly what it was. This holds for what
slid. What stuck didn't slide at all, and if by now it does, something else drives it, to which
friction must not add: it stays. So do friction and resistance where no normal impulse is left,
for the contact has ended.
"""

import math

from physics.compiler.jit import LANES, at, stage
from physics.impulse.point_impulses import apply_angular_impulse, apply_impulse, relative_velocity
from physics.model.features import cached_by_features

# m/s, largest speed at which overlapping bodies are pushed apart
MAX_PUSH_OUT_SPEED = 1.0
# 1/s, rate at which an anchor pulls back what has crept
ANCHOR_RATE = 5.0
# 1/s, rate at which an anchor forgets. Two points at the same place that came to stick at different
# times could otherwise be at rest only by pulling against each other, ever harder
ANCHOR_DECAY = 0.1
# relative to its square: friction so near its limit slid
_AT_LIMIT = 1e-9


@stage
def soft_response(stiffness, damping, h, weight):
    """The response a in kg of a soft contact, and the rate in 1/s at which its overlap closes.

    `weight`: of the point, times the part of the step that remains.
    """
    rigid = damping + h * stiffness
    return h * weight * rigid, stiffness / rigid


@stage
def target_approach(separation, rate, per_h):
    """m/s: -u n at which a contact gives no impulse."""
    overlapping = max(rate * separation, -MAX_PUSH_OUT_SPEED)
    return separation * per_h if separation > 0.0 else overlapping


@stage
def arrives(point, i, rate):
    """1 for a point that closes its gap fast enough to collide, else 0; `rate` in m/s."""
    return 1.0 if (point.separation[i] > 0.0) & (rate < -point.rest_speed[i]) else 0.0


@stage
def anchor_kept(h, slides):
    """Factor of an anchor in a step."""
    return 0.0 if slides else 1.0 - h * ANCHOR_DECAY


@stage
def resist_rotation(pair, point, i, normal_impulse, rolling, spinning, stays):
    """Corrects the angular impulse of a point against rolling and spinning, unless it stays."""
    owner, surface, A, B = pair.owner[0], pair.surface[0], pair.A, pair.B
    nx, ny, nz = point.normal[0, i], point.normal[1, i], point.normal[2, i]
    # lower bound of the moment of inertia, by the largest row sum of its inverse
    xx, yy, zz = A[0, i] + B[0, i], A[1, i] + B[1, i], A[2, i] + B[2, i]
    xy, xz, yz = abs(A[3, i] + B[3, i]), abs(A[4, i] + B[4, i]), abs(A[5, i] + B[5, i])
    inertia = 1.0 / max(max(xx + xy + xz, xy + yy + yz), max(xz + yz + zz, 1e-300))
    wx = owner.angular_velocity[0, i] - surface.angular_velocity[0, i]
    wy = owner.angular_velocity[1, i] - surface.angular_velocity[1, i]
    wz = owner.angular_velocity[2, i] - surface.angular_velocity[2, i]
    px, py, pz = point.twist[0, i], point.twist[1, i], point.twist[2, i]
    qx, qy, qz = px - inertia * wx, py - inertia * wy, pz - inertia * wz
    along = qx * nx + qy * ny + qz * nz
    qx, qy, qz = qx - along * nx, qy - along * ny, qz - along * nz
    along = min(max(along, -spinning * normal_impulse), spinning * normal_impulse)
    size = math.sqrt(qx * qx + qy * qy + qz * qz)
    cut = rolling * normal_impulse / size if size > rolling * normal_impulse else 1.0
    qx, qy, qz = cut * qx + along * nx, cut * qy + along * ny, cut * qz + along * nz
    qx, qy, qz = px if stays else qx, py if stays else qy, pz if stays else qz
    point.twist[0, i] = qx
    point.twist[1, i] = qy
    point.twist[2, i] = qz
    apply_angular_impulse(pair, i, qx - px, qy - py, qz - pz)


@cached_by_features
def make_sweep(features):
    """Stage that corrects the impulses of a half-pair's points, one after another."""
    friction, resistance = features.friction, features.resistance
    newton = features.newton

    @stage
    def sweep(pair, constants, h, soft, moves):
        """`soft`: with the bias that pushes overlapping bodies apart, by soft contacts.

        With Newton's method only worlds with `moves` are corrected.
        """
        points, owner, surface = pair.points, pair.owner[0], pair.surface[0]
        frictions = constants.friction
        stiffness, damping = constants.sweep_stiffness, constants.sweep_damping
        rolling, spinning = constants.rolling, constants.spinning
        per_h = 1.0 / h
        for n in range(points.shape[0]):
            point = points[n]
            for i in range(LANES):
                mu = at(frictions, i)
                separation, weight = point.separation[i], point.weight[i]
                acting = weight * point.remaining[i]
                a, rate = soft_response(at(stiffness, i), at(damping, i), h, acting)
                nx, ny, nz = point.normal[0, i], point.normal[1, i], point.normal[2, i]
                m, before = point.mass[i], point.normal_impulse[i]
                ux, uy, uz = relative_velocity(owner, surface, point, i)
                un = ux * nx + uy * ny + uz * nz  # then with curvature: the separation rate
                un += point.bend[i] if soft else -point.last_bend[i]
                apart = separation > 0.0
                bias = separation * per_h if apart else 0.0
                mass, leak = m, 0.0
                if soft:
                    yields = not apart
                    leak = m / (m + a) if yields else 0.0
                    mass = a * leak if yields else m
                    bias = target_approach(separation, rate, per_h)
                # What is about to collide must arrive at its full speed. The speed that forces give
                # within a step isn't that of a collision
                least = 0.0
                if not soft:
                    point.arrives[i] = arrives(point, i, un)
                    point.approach[i] = -(un + point.last_bend[i])  # after impacts, before forces
                    # after a collision solids separate, but not because they were pushed apart
                    least = before if point.relaxed[i] != 0.0 else 0.0
                new = max(before - mass * (un + bias) - leak * before, least)
                new = before if point.arrives[i] != 0.0 else new
                new = new if weight > 0.0 else 0.0
                if newton:
                    new = new if moves[i] != 0 else before
                ended = apart & (new == 0.0) & (not soft)
                step = new - before
                point.normal_impulse[i] = new
                apply_impulse(pair, point, i, step * nx, step * ny, step * nz)
                if friction:
                    tangential, anchor = point.tangential_impulse, point.anchor
                    ux, uy, uz = relative_velocity(owner, surface, point, i)
                    un = ux * nx + uy * ny + uz * nz
                    sx, sy, sz = ux - un * nx, uy - un * ny, uz - un * nz
                    arms = point.slip_bend if soft else point.last_slip_bend
                    sign = 1.0 if soft else -1.0
                    sx += sign * arms[0, i]
                    sy += sign * arms[1, i]
                    sz += sign * arms[2, i]
                    if soft:
                        sx += ANCHOR_RATE * anchor[0, i]
                        sy += ANCHOR_RATE * anchor[1, i]
                        sz += ANCHOR_RATE * anchor[2, i]
                    mt = point.shear_mass[i]
                    px, py, pz = tangential[0, i], tangential[1, i], tangential[2, i]
                    qx, qy, qz = px - mt * sx, py - mt * sy, pz - mt * sz
                    limit = mu * new
                    size = math.sqrt(qx * qx + qy * qy + qz * qz)
                    cut = limit / size if size > limit else 1.0
                    qx *= cut
                    qy *= cut
                    qz *= cut
                    if not soft:  # friction stays where the contact stuck or has ended
                        most = mu * before
                        slid = px * px + py * py + pz * pz >= (1.0 - _AT_LIMIT) * most * most
                        stays = ended | (apart & (not slid))
                        qx = px if stays else qx
                        qy = py if stays else qy
                        qz = pz if stays else qz
                    if newton:
                        qx = qx if moves[i] != 0 else px
                        qy = qy if moves[i] != 0 else py
                        qz = qz if moves[i] != 0 else pz
                    tangential[0, i] = qx
                    tangential[1, i] = qy
                    tangential[2, i] = qz
                    if soft:
                        held = anchor_kept(h, size > limit)
                        if newton:
                            held = held if moves[i] != 0 else 1.0
                        anchor[0, i] *= held
                        anchor[1, i] *= held
                        anchor[2, i] *= held
                    apply_impulse(pair, point, i, qx - px, qy - py, qz - pz)
                if resistance:
                    resist_rotation(pair, point, i, new, rolling, spinning, ended)

    return sweep
