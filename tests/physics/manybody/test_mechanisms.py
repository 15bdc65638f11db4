"""Joints, servos and fields in worlds of many bodies act as in small ones."""

import copy

import numpy as np
import pytest

from physics import (
    Attractor,
    BallJoint,
    Body,
    Box,
    Distance,
    Drag,
    Drive,
    Fidelity,
    Gripper,
    Ground,
    Hinge,
    Material,
    Motor,
    PointSpring,
    Scene,
    SimulationDiverged,
    Slider,
    Sphere,
    SurfaceDrag,
    World,
)  # fmt: skip
from physics.analysis.lane_queries import LaneQueries
from physics.manybody import kinds
from physics.manybody import simulation as many
from physics.manybody.mechanisms import find_mechanisms
from physics.model.build import build
from physics.motion.drive_commands import make_move_command, worlds_last
from physics.step.simulation import Simulation
from tests.physics.manybody.scenes import HALF

pytestmark = pytest.mark.usefixtures("with_all_couplings")


CUBE = Box((HALF, HALF, HALF))
ROUGH = Material(friction=0.5)
STEP = 0.02  # s


def cube(x, y, z=HALF, density=500.0, **more):
    return Body(CUBE, density=density, position=(x, y, z), material=ROUGH, **more)


def workshop() -> Scene:
    """Cubes at rest, of which a gripper and a drive move some; chains; a lift; springs and drag."""
    bodies = [cube(0.06 * (k % 6), 0.06 * (k // 6)) for k in range(36)]
    joints, apart = [], 2.2 * HALF
    for y in (0.0, 0.1, 0.2):  # chains of three with a motor, hung up at one end
        first, x = len(bodies), -0.3
        bodies += [cube(x + apart * k, y, 0.3) for k in range(3)]
        joints += [
            Hinge(first, None, anchor=(x - apart / 2, y, 0.3), axis=(0, 1, 0)),
            Hinge(first + 1, first, anchor=(x + apart / 2, y, 0.3), axis=(0, 1, 0),
                  limits=(-1.0, 1.0), motor=Motor(0.01, velocity=2.0 + y)),
            BallJoint(first + 2, first + 1, anchor=(x + 1.5 * apart, y, 0.3)),
        ]  # fmt: skip
    lift = len(bodies)
    bodies += [cube(0.5, 0.0, 0.2), cube(0.5, 0.0, 0.3, density=300.0)]
    joints += [Slider(lift, None, limits=(-0.19, 0.1)), Distance(lift + 1, lift)]
    beam = Box((2.0 * HALF, HALF, HALF))  # no cube, for a kernel that other scenes have, too
    bodies += [
        cube(0.15, -0.1),
        Body(beam, density=500.0, position=(-0.6, -0.6, HALF), material=ROUGH),
    ]
    drives = [
        Drive(Sphere(HALF), 0.2, 20.0, (-0.1, 0.06 * row, 0.03), material=ROUGH) for row in (0, 1)
    ]
    gripper = Gripper(Box((0.005, 0.005, 0.015)), 0.2, 20.0, 5.0, (0.15, -0.1, 0.03), 0.07,
                      material=ROUGH)  # fmt: skip
    fields = [
        PointSpring(33, to=(0.18, 0.3, 0.3), stiffness=2.0, damping=0.05, rest_length=0.1),
        PointSpring(34, to=35, stiffness=5.0, damping=0.05, rest_length=0.1),
        Drag(linear=0.02),
        Drag(linear=0.01, body=lift),
        Attractor((1.0, 1.0, 0.0), 0.1),
        SurfaceDrag(1.2, 1.0, body=5),
    ]
    return Scene(bodies, [Ground(ROUGH)], drives=[*drives, gripper], joints=joints, fields=fields)


@pytest.fixture(scope="module")
def with_all_couplings():
    """All worlds of many bodies get the kernels of `workshop`: of its couplings and surfaces."""
    whole, united = build(workshop(), Fidelity())[1], kinds._united
    features = {name: True for name, value in whole._asdict().items() if value is True}
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(kinds, "_united", lambda *found: united(*found)._replace(**features))
        yield


def move(simulation, scene):
    """The drives push on, the gripper closes and lifts."""
    target = np.array([[d.position for d in scene.driven_bodies]])
    target[0, :2, 0] += 0.1
    target[0, 2:, 1] += 0.03, -0.03
    target[0, 2:, 2] += 0.05
    make_move_command()(simulation.state.dynamic, simulation.bodies, worlds_last(target), 0.2)
    simulation.changed(poses=False)


@pytest.mark.parametrize(("law", "close"), [("balanced", 1e-6), ("solid", 3e-3)])
def test_mechanisms_move_as_among_all_pairs_and_bitwise_the_same_for_any_threads(
    monkeypatch, law, close
):
    monkeypatch.setattr(many, "_FEWEST_BATCHES", 2)
    scene = workshop()
    worlds = [World(scene, law, threads=n) for n in (1, 2, 4)]
    assert all(isinstance(world._simulation, many.CrowdSimulation) for world in worlds)
    all_pairs = Simulation(scene, worlds[0].fidelity, 1, 1, False)
    simulations = [*(world._simulation for world in worlds), all_pairs]
    for simulation in simulations:
        move(simulation, scene)
    saved = None
    for frame in range(15):
        if frame == 8:
            saved, copied = worlds[1].snapshot(), copy.deepcopy(worlds[1])
        for simulation in simulations:
            simulation.advance(STEP, simulation.everyone)
        states = [simulation.state.dynamic for simulation in simulations]
        assert states[0].tobytes() == states[1].tobytes() == states[2].tobytes()
        # sums in another order: round-off grows, and impulses converge in another way
        for name in ("position", "reference"):
            assert np.abs(states[0][name] - states[3][name]).max() < close
    one = worlds[0]
    assert one.joint_error().max() < 1e-12
    held = one.position[0, 47]
    assert held[2] > HALF + 0.02  # the cube that the gripper has lifted
    assert one.position[0, 0, 0] > 0.01  # pushed by a drive
    after = worlds[1]._simulation.state.dynamic.tobytes()
    restored = World(scene, law, threads=1)
    restored.restore(saved)
    for world in (copied, restored):
        for _ in range(7):
            world.advance(STEP)
        assert world._simulation.state.dynamic.tobytes() == after


def test_mechanisms_of_the_same_structure_stand_side_by_side():
    scene = workshop()
    found = find_mechanisms(scene)
    bodies = len(scene.bodies) + len(scene.driven_bodies)
    assert np.array_equal(found.body[found.place], np.arange(bodies))
    chains = found.group[found.group["joint_count"] == found.group["joint_count"].max()]
    assert len(chains) == 1  # all three: their anchors and motors differ, not what they are made of
    assert chains[0]["block_count"] == 3
    assert found.present.sum() == 36 + 1 - 1 + 3 + 1 + 1 + 2 + 1  # two cubes share a spring
    many_chains = [cube(x, 0.0, 1.0) for x in range(80)]
    joints = [
        BallJoint(k + 1, k, anchor=(k + 0.5, 0.0, 1.0)) for k in range(0, 80, 2)
    ]  # fmt: skip
    found = find_mechanisms(Scene(many_chains, joints=joints))
    assert len(found.group) == 3
    assert found.present.sum(axis=1).tolist() == [16, 16, 8]


def test_solids_that_a_joint_connects_touch_only_if_it_says_so():
    others = [cube(0.1 * k, 1.0, 5.0) for k in range(32)]

    def scene(collide):
        pair = [cube(0.0, 0.0, 1.0), cube(1.9 * HALF, 0.0, 1.0)]  # they overlap
        joint = BallJoint(0, 1, anchor=(HALF, 0.0, 1.0), collide=collide)
        return Scene([*pair, *others], gravity=(0.0, 0.0, 0.0), joints=[joint])

    apart, touching = World(scene(False)), World(scene(True))
    for world in (apart, touching):
        world.advance(0.05)
    assert np.abs(apart.linear_velocity).max() < 1e-12
    assert len(apart.contacts().force) == 0
    assert len(touching.contacts().force) > 0


def test_a_body_that_diverges_is_named_wherever_it_stands():
    scene = workshop()
    world = World(scene)
    world.advance(STEP)
    world._simulation.state.dynamic["momentum"][0, 20] = 1e200
    with pytest.raises(SimulationDiverged, match=scene.solid_names[20]):
        world.advance(STEP)


def test_what_makes_a_step_too_long_is_named_as_in_the_scene():
    bodies = [cube(0.1 * k, 0.0) for k in range(34)]
    slow = [Drive(Sphere(HALF), 0.1, 5.0, (0.1 * k, 1.0, 1.0)) for k in range(2)]
    fast = Drive(Sphere(HALF), 0.1, 5.0, (0.0, 1.0, 1.0), frequency=1e5)
    with pytest.raises(ValueError, match=r"Drive\.frequency 100000 rad/s of drive 2"):
        World(Scene(bodies, [Ground()], drives=[*slow, fast]))
    springs = [PointSpring(3, stiffness=1.0), Drag(linear=0.1), PointSpring(7, stiffness=1e9)]
    with pytest.raises(ValueError, match=r"Scene\.fields\[2\], PointSpring\(body=7"):
        World(Scene(bodies, [Ground()], fields=springs))
    light = cube(5.0, 5.0, density=0.01)
    for order in ([light, *bodies], [*bodies, light]):  # a drag that only the light one can't bear
        with pytest.raises(ValueError, match=r"Scene\.fields\[0\], Drag"):
            World(Scene(order, [Ground()], fields=[Drag(linear=2.0)]))


def test_default_names_of_the_scene_are_kept():
    others = [cube(0.1 * k, 1.0, 5.0) for k in range(32)]
    bodies = [cube(0, 0, 5, name="x"), cube(0.1, 0, 5), cube(0.2, 0, 5, name="body 0")]
    World(Scene([*bodies, *others], joints=[BallJoint(1, 2, anchor=(0.15, 0.0, 5.0))]))


def test_the_largest_stable_step_knows_servos():
    scene, law = workshop(), "balanced"
    world = World(scene, law)
    world.advance(STEP)
    all_pairs = Simulation(scene, world.fidelity, 1, 1, False)
    all_pairs.advance(STEP, all_pairs.everyone)
    expected = LaneQueries(all_pairs).largest_stable_step(0)
    assert world.largest_stable_step(0) == pytest.approx(expected, rel=0.01)
    drive = Drive(Sphere(HALF), 0.1, 5.0, (0.0, 1.0, 1.0))
    alone = World(Scene([cube(0.1 * k, 0.0, 9.0) for k in range(33)], drives=[drive]), "solid")
    assert 1e-3 < alone.largest_stable_step(0) < 1.0


def test_copies_that_fill_lanes_do_not_fail_a_world():
    # the attractor presses bodies onto the ground; copies have no contacts and run away
    bodies = [cube(0.05 * (k % 6) - 0.125, 0.05 * (k // 6) - 0.125) for k in range(33)]
    field = Attractor((0.0, 0.0, 1.0), -100.0, exponent=-1.0)
    world = World(Scene(bodies, [Ground(ROUGH)], fields=[field]), allow_unstable=True)
    world.advance(0.1)
    solid = world._simulation._worlds[0][0].solid
    copies = np.flatnonzero(world._simulation.mechanisms.present.ravel() == 0)
    assert len(copies) == 15
    world._simulation._load = lambda dynamic, w, crowd, load=world._simulation._load: (
        load(dynamic, w, crowd),
        solid["momentum"][-1, 0].__setitem__(15, np.inf),
    )
    world.advance(0.1)
    assert np.isfinite(world.position).all()
