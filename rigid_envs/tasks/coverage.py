"""What part of a goal a T covers, in the plane, as in gym-pusht's PushT.

A pose is (x, y, cosine of the yaw, sine of the yaw), with x and y of the T's centre of mass in m.
The T is two rectangles: a bar along x, and a stem that hangs from its middle.
"""

import math

import numpy as np

from physics.compiler.jit import stage

UNIT = 0.03  # m: the bar is 4 by 1 units, the stem 1 by 3
_TOP = (4.0 * 0.5 + 3.0 * 2.5) / 7.0 * UNIT  # m, from the centre of mass to the top of the bar
# middle on the T's axis of symmetry, half width and half height, in m
BAR = (_TOP - 0.5 * UNIT, 2.0 * UNIT, 0.5 * UNIT)
STEM = (_TOP - 2.5 * UNIT, 0.5 * UNIT, 1.5 * UNIT)
AREA = 7.0 * UNIT**2  # m^2
_LARGER = 1e-14  # m, see `common_area`


@stage
def uncovered(a, b, i):
    """1 minus the part of the goal b[:, i] that a T with the pose a[:, i] covers."""
    own_x, own_y, own_c, own_s = _pose(a, i)
    goal_x, goal_y, goal_c, goal_s = _pose(b, i)
    # position and yaw in the frame of the goal
    dx, dy = own_x - goal_x, own_y - goal_y
    x, y = goal_c * dx + goal_s * dy, goal_c * dy - goal_s * dx
    c, s = own_c * goal_c + own_s * goal_s, own_s * goal_c - own_c * goal_s
    common = 0.0
    for own in (BAR, STEM):
        for goal in (BAR, STEM):
            # middle of the own rectangle in the frame of the goal's
            u, v = x - s * own[0], y + c * own[0] - goal[0]
            common += common_area(u, v, c, s, own[1], own[2], goal[1], goal[2])
    return max(1.0 - common / AREA, 0.0)


@stage
def _pose(p, i):
    """Position, and cosine and sine of the yaw, in doubles and of length 1."""
    c, s = np.float64(p[2, i]), np.float64(p[3, i])
    length = math.sqrt(c * c + s * s)
    return np.float64(p[0, i]), np.float64(p[1, i]), c / length, s / length


@stage
def common_area(x, y, c, s, ax, ay, bx, by):
    """Area in m^2 that two rectangles have in common.

    By Green's theorem it is half the integral of p x dp along the border of what they have in
    common. That border consists of the parts of each rectangle's edges that lie within the other.
    Rectangle a is made larger by 1e-14 m, so that no edges coincide where poses are equal.

    The middle of a is (x, y) in m, c and s are cosine and sine of its yaw. The middle of b is the
    origin, and its yaw is 0. ax, ay, bx and by are half widths and half heights in m.
    """
    ax, ay = ax + _LARGER, ay + _LARGER
    twice = 0.0
    u, v, next_u, next_v = -1.0, -1.0, 1.0, -1.0  # ends of an edge, counterclockwise
    for _ in range(4):
        px, py = x + c * u * ax - s * v * ay, y + s * u * ax + c * v * ay
        qx, qy = x + c * next_u * ax - s * next_v * ay, y + s * next_u * ax + c * next_v * ay
        twice += _inside(px, py, qx, qy, bx, by) * (px * qy - py * qx)
        # an edge of b, in the frame of a
        px, py, qx, qy = u * bx - x, v * by - y, next_u * bx - x, next_v * by - y
        part = _inside(c * px + s * py, c * py - s * px, c * qx + s * qy, c * qy - s * qx, ax, ay)
        twice += part * bx * by * 2.0  # p x q of every edge of b
        u, v, next_u, next_v = next_u, next_v, -next_v, next_u
    return 0.5 * twice


@stage
def _inside(px, py, qx, qy, hx, hy):
    """Which part, 0 to 1, of the edge from p to q lies within |x| <= hx and |y| <= hy."""
    dx, dy = qx - px, qy - py
    low, high = 0.0, 1.0
    # within a side where room + t * rate >= 0, with t from 0 at p to 1 at q
    for room, rate in ((hx - px, -dx), (hx + px, dx), (hy - py, -dy), (hy + py, dy)):
        if rate > 0.0:
            low = max(low, -room / rate)
        elif rate < 0.0:
            high = min(high, -room / rate)
        elif room < 0.0:
            high = -1.0
    return max(high - low, 0.0)
