"""Bodies for scenes with joints in which nothing touches: they share one kernel."""

import math

from physics import Body, Box, Hinge, Scene, World

ROD = Box((0.02, 0.015, 0.25))
MASS = 1.3


def ghost(shape=ROD, mass=MASS, **state):
    """A body that touches nothing."""
    return Body(shape, mass=mass, mask=0, **state)


def about_y(angle):
    """Quaternion of a rotation about y, in rad."""
    return (0.0, math.sin(0.5 * angle), 0.0, math.cos(0.5 * angle))


def pendulum(amplitude, fidelity="accurate", count=1, gravity=(0.0, 0.0, -9.81), **hinge):
    """A rod of 0.5 m on a hinge at its upper end, deflected by an angle in rad."""
    centre = (0.25 * math.sin(amplitude), 0.0, -0.25 * math.cos(amplitude))
    body = ghost(position=centre, orientation=about_y(-amplitude))
    joint = Hinge(0, None, (0, 0, 0), (0, -1, 0), **hinge)
    return World(Scene([body], joints=[joint], gravity=gravity), fidelity, count)


def pendulum_inertia():
    """Moment of inertia of the rod of `pendulum` about its hinge, kg m^2."""
    return float(ROD.inertia(MASS)[1]) + MASS * 0.25**2


def energy(world):
    """[count] J."""
    return world.kinetic_energy() + world.potential_energy()


def film(world, frame, frames):
    """Advances a world by frames of a time in s; returns its states after each, side by side.

    A query of all these worlds takes as long as one of a single world.
    """
    shown, state = World(world.scene, world.fidelity, frames), world._simulation.state
    for k in range(frames):
        world.advance(frame)
        shown._simulation.state.dynamic[k] = state.dynamic[0]
        shown._simulation.state.world[k] = state.world[0]
    shown._simulation.changed()
    return shown


def linkage(corners, masses=None, gravity=(0.0, 0.0, -9.81), fidelity="balanced", motors=None):
    """Bars in a closed loop, on hinges about y at `corners` in x and z; both ends on the world.

    Args:
        corners: [bars + 1] of (x, z) in m.
        masses: kg of each bar; None: 1 each.
        gravity: m/s^2.
        fidelity: of the world.
        motors: Motor of the joint at each corner's index.
    """
    bars, motors = len(corners) - 1, motors or {}
    bodies, joints = [], []
    for i in range(bars):
        (x, z), (u, w) = corners[i], corners[i + 1]
        bar = Box((0.01, 0.01, 0.5 * math.hypot(u - x, w - z)))
        pose = {
            "position": (0.5 * (x + u), 0.0, 0.5 * (z + w)),
            "orientation": about_y(math.atan2(u - x, w - z)),
        }
        bodies.append(ghost(bar, 1.0 if masses is None else masses[i], **pose))
    ends = [(0, None), *((i, i - 1) for i in range(1, bars)), (bars - 1, None)]
    for i, (a, b) in enumerate(ends):
        x, z = corners[i]
        joints.append(Hinge(a, b, (x, 0, z), (0, 1, 0), motor=motors.get(i)))
    return World(Scene(bodies, joints=joints, gravity=gravity), fidelity)
