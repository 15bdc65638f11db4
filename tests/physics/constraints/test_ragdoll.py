"""A figure of ten boxes on ball joints and hinges falls, lies on the ground and comes to rest."""

import math

import numpy as np

from physics import BallJoint, Body, Box, Hinge
from physics.rotation import rotate
from tests.physics.constraints.jointed import energy
from tests.physics.constraints.test_joints_in_contact import LAWS, world_of

# m above the ground and, as a rotation about a horizontal axis in rad, of the torso
HEIGHT, TILT = 1.06, 0.3
TURN = np.array((0.6 * math.sin(0.5 * TILT), 0.8 * math.sin(0.5 * TILT), 0, math.cos(0.5 * TILT)))


def placed(point):
    """A point of the figure, relative to its torso, in the world frame."""
    x, y, z = rotate(TURN, np.array(point, dtype=float))
    return (x, y, z + HEIGHT)


def figure():
    """Bodies and joints."""
    bodies, joints = [], []

    def limb(centre, half_extents, mass, parent, joint, bend=None):
        bodies.append(
            Body(Box(half_extents), mass=mass, position=placed(centre), orientation=TURN,
                 linear_velocity=(1.0, 0.5, 0.0))
        )  # fmt: skip
        child = len(bodies) - 1
        if bend is not None:
            axis = tuple(rotate(TURN, np.array((0.0, 1.0, 0.0))))
            joints.append(Hinge(child, parent, placed(joint), axis, limits=bend))
        elif parent is not None:
            joints.append(BallJoint(child, parent, placed(joint)))
        return child

    torso = limb((0, 0, 0), (0.07, 0.12, 0.2), 8.0, None, None)
    limb((0, 0, 0.3), (0.06, 0.06, 0.08), 2.0, torso, (0, 0, 0.21))
    for s in (-1, 1):
        y = 0.16 * s
        arm = limb((0, y, 0.05), (0.03, 0.03, 0.13), 1.0, torso, (0, y, 0.18))
        limb((0, y, -0.22), (0.025, 0.025, 0.12), 0.7, arm, (0, y, -0.09), (-2.4, 0.0))
        y = 0.07 * s
        leg = limb((0, y, -0.38), (0.04, 0.04, 0.16), 2.0, torso, (0, y, -0.21))
        limb((0, y, -0.72), (0.035, 0.035, 0.16), 1.2, leg, (0, y, -0.55), (0.0, 2.4))
    return bodies, joints


@LAWS
def test_a_figure_falls_and_comes_to_rest(fidelity):
    bodies, joints = figure()
    world = world_of(bodies, joints, fidelity)
    before = float(energy(world)[0])
    for _ in range(250):
        world.advance(0.02)
        assert float(energy(world)[0]) <= before * (1.0 + 1e-9)
        assert world.joint_error().max() < 1e-10
    bends = world.joint_position()[0]
    for joint, angle in zip(joints, bends, strict=True):
        if isinstance(joint, Hinge):
            assert joint.limits[0] - 1e-9 <= angle <= joint.limits[1] + 1e-9
    assert world.kinetic_energy()[0] < 1e-3
    thinnest = np.array([min(body.shape.half_extents) for body in bodies])
    assert np.all(world.position[0, : len(bodies), 2] > thinnest - 2e-3)
