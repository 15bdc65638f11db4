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


def pendulum(amplitude, fidelity="accurate", count=1, **hinge):
    """A rod of 0.5 m on a hinge at its upper end, deflected by an angle in rad."""
    centre = (0.25 * math.sin(amplitude), 0.0, -0.25 * math.cos(amplitude))
    body = ghost(position=centre, orientation=about_y(-amplitude))
    joint = Hinge(0, None, (0, 0, 0), (0, -1, 0), **hinge)
    return World(Scene([body], joints=[joint]), fidelity, count)


def pendulum_inertia():
    """Moment of inertia of the rod of `pendulum` about its hinge, kg m^2."""
    return float(ROD.inertia(MASS)[1]) + MASS * 0.25**2


def energy(world):
    """[count] J."""
    return world.kinetic_energy() + world.potential_energy()
