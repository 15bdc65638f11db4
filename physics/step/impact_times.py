"""Times of impact in one lane: when a sample of a half-pair first touches the surface.

Conservative advancement. In the frame of the surface the distance d from its convex core is a
convex function of the sample's position p, so it never lies below its tangent:

    d(p(t)) >= d(p(0)) + n (p(t) - p(0)) >= d(p(0)) + u t - K t^2 / 2

with the normal n at p(0), the speed u = n p'(0) and a bound K of the acceleration |p''| in that
frame. Up to the root of the right side the sample can't touch, however it moves. The solids advance
to the earliest root of all samples, and distances and speeds are evaluated again, until a sample is
within the tolerance. Nothing is missed: neither what is thin, nor what turns, nor what only passes.

Of a point at r from the centre of a body with the angular velocity omega and its rate alpha, K is
at most |a| + (omega^2 + alpha) r. Where the surface turns as well, the terms of a rotating frame
are added.

A sample that touches and approaches no faster than rest counts as a contact at rest: the contact
law holds it. Until its next evaluation it may move deeper by `HALF_PAIR.free_motion`.
"""

import math

from physics.collision.distances import core_distance
from physics.collision.separations import separation_bound
from physics.collision.surface_kinds import by_surface_kind
from physics.compiler.jit import at, stage
from physics.model.features import BISECTION, BY_TABLE, GENERAL, NO_ROTATION, cached_by_features
from physics.model.workspace import BRACKET
from physics.motion.vectors import cross, rotated_back
from physics.scene.shapes import PARTICLES, PLANE, SPHERE
from physics.step.lane_paths import keep_pose, make_move, make_place, restore_pose

# no sample that approaches
NONE = 1e300
# evaluations in a substep after which its rest isn't examined: speeds that no scene has
MOST = 100_000
# halvings of the bracket of a bisection, at most: as many as a double has bits
MOST_BISECTIONS = 53


@cached_by_features
def make_rotation_bounds(features):
    """Stage: how fast a solid may rotate in lane i within the next `left` s.

    Euler's equations bound |omega'| by omega^2/sqrt(3) + |torque| / J_min, because of moments of
    inertia the difference of two is at most the third. While a body turns by less than half a
    radian, its angular speed grows by less than half.
    """
    rotation = features.rotation
    general = rotation in (GENERAL, BY_TABLE)

    @stage
    def rotation_bounds(model, workspace, m, i, left):
        """Returns upper bounds in rad/s and rad/s^2, and the s, at most `left`, that they hold."""
        if rotation == NO_ROTATION or m >= model.dynamic.shape[0] or not model.dynamic[m].is_body:
            return 0.0, 0.0, left
        w, T, j = (
            workspace.solid[m].angular_velocity,
            workspace.solid[m].torque,
            model.dynamic[m].inverse_inertia,
        )
        jx, jy, jz = at(j[0], i), at(j[1], i), at(j[2], i)
        omega = math.sqrt(w[0, i] * w[0, i] + w[1, i] * w[1, i] + w[2, i] * w[2, i])
        turning = math.sqrt(T[0, i] * T[0, i] + T[1, i] * T[1, i] + T[2, i] * T[2, i])
        driven = turning * max(jx, jy, jz)
        fastest = omega + driven * left
        if general and not jx == jy == jz:
            left = min(left, 0.5 / max(fastest, 1e-300))
            fastest *= 1.5
            driven += fastest * fastest / math.sqrt(3)
        return fastest, driven, left

    return rotation_bounds


@cached_by_features
def make_sample_times(features):
    """Stage that evaluates all samples of a half-pair in lane i."""
    per_world_parameters = features.per_world_parameters

    def make_loop(kind):
        if kind == PARTICLES:
            return None
        distance = core_distance(kind)

        @stage
        def loop(model, half_pair, i, relative, curvature, left, floor):
            """Returns s until one can touch, and of the nearest that approaches m and m/s.

            Args:
                model: of the lane group.
                half_pair: of the model.
                i: lane.
                relative: the owner in the frame of the surface.
                curvature: m/s^2, upper bound of the acceleration of a sample in that frame.
                left: s, upper bound of what is returned.
                floor: m/s, speed that counts as rest.
            """
            R, c, v, omega = (
                relative.rotation,
                relative.position,
                relative.velocity,
                relative.angular_velocity,
            )
            core, face_normals = half_pair.core, half_pair.face_normals != 0
            ca, cb, cc = at(core[0], i), at(core[1], i), at(core[2], i)
            radius, size = at(half_pair.radius, i), at(half_pair.owner_size, i)
            tolerance, sink = half_pair.impact_tolerance, at(half_pair.free_motion, i)
            earliest, nearest, rate = left, NONE, 0.0
            for s in range(half_pair.first_sample, half_pair.first_sample + half_pair.sample_count):
                sx, sy, sz = model.sample[0, s], model.sample[1, s], model.sample[2, s]
                if per_world_parameters:
                    sx, sy, sz = size * sx, size * sy, size * sz
                x = R[0, i] * sx + R[1, i] * sy + R[2, i] * sz
                y = R[3, i] * sx + R[4, i] * sy + R[5, i] * sz
                z = R[6, i] * sx + R[7, i] * sy + R[8, i] * sz
                d, nx, ny, nz = distance(
                    x + c[0, i],
                    y + c[1, i],
                    z + c[2, i],
                    ca,
                    cb,
                    cc,
                    radius,
                    face_normals,
                )
                separation = d - radius
                tx, ty, tz = cross(omega[0, i], omega[1, i], omega[2, i], x, y, z)
                speed = nx * (v[0, i] + tx) + ny * (v[1, i] + ty) + nz * (v[2, i] + tz)
                if separation < nearest and -speed > floor:
                    nearest, rate = separation, speed
                # half of the tolerance: the advance ends within it, and not beyond it by round-off
                apart = separation > tolerance
                gap = separation - 0.5 * tolerance if apart else sink
                if gap + left * (speed - 0.5 * curvature * left) > 0.0:
                    continue  # the bound is concave: it stays above zero until then
                root = math.sqrt(speed * speed + 2.0 * curvature * gap)
                back = 2.0 * gap / (root - speed) if speed < 0.0 else (root + speed) / curvature
                earliest = min(earliest, back)
            return earliest, nearest, rate

        return loop

    return by_surface_kind(features, make_loop)


@cached_by_features
def make_half_pair_time(features):
    """Stage that evaluates a half-pair in lane i at the present poses and velocities."""
    rotation_bounds, sample_times = make_rotation_bounds(features), make_sample_times(features)

    @stage
    def half_pair_time(model, workspace, k, i, left, h):
        """Returns as `make_sample_times`."""
        half_pair = model.half_pair[k]
        o, s = half_pair.owner, half_pair.surface
        owner, surface, frame = (
            workspace.solid[o],
            workspace.solid[s],
            workspace.solid[half_pair.frame],
        )
        whole = half_pair.frame == s
        tolerance = half_pair.impact_tolerance
        ma, mb = at(half_pair.owner_inverse_mass, i), at(half_pair.surface_inverse_mass, i)
        v, u, F, G = owner.velocity, surface.velocity, owner.force, surface.force
        a, b = owner.position, surface.position
        vx, vy, vz = v[0, i] - u[0, i], v[1, i] - u[1, i], v[2, i] - u[2, i]
        dx, dy, dz = a[0, i] - b[0, i], a[1, i] - b[1, i], a[2, i] - b[2, i]
        speed = math.sqrt(vx * vx + vy * vy + vz * vz)
        ax, ay, az = (
            ma * F[0, i] - mb * G[0, i],
            ma * F[1, i] - mb * G[1, i],
            ma * F[2, i] - mb * G[2, i],
        )
        acceleration = math.sqrt(ax * ax + ay * ay + az * az)
        spin, spin_rate, near = rotation_bounds(model, workspace, o, i, left)
        reach = at(model.dynamic[o].core_reach, i) if o < model.dynamic.shape[0] else 0.0
        turn, turn_rate, soon = rotation_bounds(model, workspace, s, i, left)
        if half_pair.kind == SPHERE and whole:  # a ball's surface is the same however it turns
            turn, turn_rate, soon = 0.0, 0.0, left
        distance = math.sqrt(dx * dx + dy * dy + dz * dz)
        swept = (speed + 0.5 * acceleration * left) * left
        # bounding spheres don't turn
        apart = distance - at(half_pair.owner_reach, i) - at(half_pair.surface_reach, i)
        if whole and half_pair.kind != PLANE and apart - tolerance > swept:
            return left, NONE, 0.0
        left = min(near, soon)
        swept = (speed + 0.5 * acceleration * left) * left
        far = distance + reach + swept
        fastest = speed + acceleration * left + spin * reach + turn * far
        curvature = acceleration + (spin * spin + spin_rate) * reach
        curvature += (turn * turn + turn_rate) * far + 2.0 * turn * fastest
        # less than the tolerance in a step isn't worth a cut
        floor = max(at(half_pair.rest_speed, i), tolerance / h)
        if fastest + curvature * left <= floor:
            return left, NONE, 0.0

        relative, A, B = workspace.relative[0], owner.rotation, frame.rotation
        R, c = relative.rotation, relative.position
        for column in range(3):
            x, y, z = rotated_back(B, i, A[column, i], A[3 + column, i], A[6 + column, i])
            R[column, i] = x
            R[3 + column, i] = y
            R[6 + column, i] = z
        e = frame.position
        x, y, z = rotated_back(B, i, a[0, i] - e[0, i], a[1, i] - e[1, i], a[2, i] - e[2, i])
        c[0, i] = x
        c[1, i] = y
        c[2, i] = z
        moved = swept + left * (spin * reach + turn * far)
        if separation_bound(half_pair, i, relative) - tolerance > moved:
            return left, NONE, 0.0
        p, w = owner.angular_velocity, surface.angular_velocity
        tx, ty, tz = cross(w[0, i], w[1, i], w[2, i], dx, dy, dz)
        x, y, z = rotated_back(B, i, vx - tx, vy - ty, vz - tz)
        relative.velocity[0, i] = x
        relative.velocity[1, i] = y
        relative.velocity[2, i] = z
        x, y, z = rotated_back(B, i, p[0, i] - w[0, i], p[1, i] - w[1, i], p[2, i] - w[2, i])
        relative.angular_velocity[0, i] = x
        relative.angular_velocity[1, i] = y
        relative.angular_velocity[2, i] = z
        return sample_times(half_pair.kind, model, half_pair, i, relative, curvature, left, floor)

    return half_pair_time


@cached_by_features
def make_find_impact(features):
    """Stage that moves lane i from `time` s to the next impact, or to the end of the substep.

    Returns that time in s, and whether there is an impact. `again`: what touches at the beginning
    has just collided, or can't, so it is no impact there.
    """
    return (
        make_bisect(features) if features.time_control == BISECTION else make_advance_lane(features)
    )


@cached_by_features
def make_evaluate_here(features):
    """Stage: the earliest of all timed half-pairs, and the nearest sample that approaches."""
    half_pair_time = make_half_pair_time(features)

    @stage
    def evaluate_here(model, workspace, i, left, h):
        """Returns s, at most `left`, until one can touch, m, m/s, and whether any touches."""
        earliest, nearest, rate, touches = left, NONE, 0.0, False
        for k in range(model.half_pair.shape[0]):
            if workspace.timing[k].timed[i]:
                safe, separation, speed = half_pair_time(model, workspace, k, i, left, h)
                earliest = min(earliest, safe)
                if separation < nearest:
                    nearest, rate = separation, speed
                if separation <= model.half_pair[k].impact_tolerance:
                    touches = True
                    # below zero: its list is replaced, so it contains what touches
                    workspace.half_pair[k].remaining_skin[i] = -1.0
        return earliest, nearest, rate, touches

    return evaluate_here


@cached_by_features
def make_evaluate(features):
    """The same, at `time` s after the substep has begun."""
    place, evaluate_here = make_place(features), make_evaluate_here(features)

    @stage
    def evaluate(model, workspace, i, time, h):
        place(model, workspace, i, time - 0.5 * h)
        return evaluate_here(model, workspace, i, max(h - time, 0.0), h)

    return evaluate


@cached_by_features
def make_advance_lane(features):
    """`make_find_impact` by conservative advancement."""
    evaluate, move = make_evaluate(features), make_move(features)

    @stage
    def advance_lane(model, workspace, i, time, h, again):
        evaluations = 0
        while time < h:
            safe, _, _, touches = evaluate(model, workspace, i, time, h)
            if touches and not (again and evaluations == 0):
                return time, True
            evaluations += 1
            left = h - time
            if not safe < left or evaluations == MOST:
                move(model, workspace, i, time, left, h)
                break
            move(model, workspace, i, time, safe, h)
            time += safe
        return h, False

    return advance_lane


@cached_by_features
def make_bisect(features):
    """`make_find_impact` by bisection, with Newton's method inside the bracket."""
    evaluate, move = make_evaluate(features), make_move(features)

    @stage
    def bisect(model, workspace, i, time, h, again):
        tolerance = 0.0
        for k in range(model.half_pair.shape[0]):
            tolerance = model.half_pair[k].impact_tolerance  # of all the same
        keep_pose(model, workspace, BRACKET, i)
        # evaluates the beginning, the end, and then times between
        low, high, t, width = time, h, time, h - time
        for n in range(MOST_BISECTIONS + 2):
            if n > 0:
                restore_pose(model, workspace, BRACKET, i)
                move(model, workspace, i, time, t - time, h)
            _, separation, speed, _ = evaluate(model, workspace, i, t, h)
            if n == 0:
                if separation <= tolerance and not again:
                    return time, True
                t = h
                continue
            if n == 1 and separation >= -tolerance:
                return h, False
            if abs(separation) <= tolerance:
                return t, True
            if separation < 0.0:
                high = t
            else:
                low = t
            newton = t - separation / speed if separation < NONE else low
            halved = high - low <= 0.5 * width or n == 1
            inside = low < newton < high and halved
            width = high - low
            t = newton if inside else 0.5 * (low + high)
        restore_pose(model, workspace, BRACKET, i)
        move(model, workspace, i, time, high - time, h)
        return high, True

    return bisect
