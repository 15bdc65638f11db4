"""Meshes in motion: like boxes where they are boxes; knights and bowls rest and hold things."""

import numpy as np
import pytest

from physics import Body, Box, Fidelity, Ground, Material, Mesh, Scene, Sphere, Static, World
from physics.reference import meshes
from physics.rotation import rotate, rotate_back

ROUGH = Material(friction=0.5, restitution=0.0)
BOX = Box((0.02, 0.02, 0.02))


def mesh_of(triangles, **settings):
    return Mesh(vertices=triangles[0], faces=triangles[1], **settings)


CUBE = mesh_of(meshes.cuboid(BOX.half_extents), cells=24)


def at(mesh, position, orientation=(0.0, 0.0, 0.0, 1.0)):
    place, turn = mesh.placed(position, orientation)
    return {"position": place, "orientation": turn, "material": ROUGH}


def alone(shape, fidelity="balanced", restitution=0.0, **state):
    """A world of one body on the ground. A cube and a box have the same kernel."""
    material = Material(friction=0.5, restitution=restitution)
    body = Body(shape, mass=0.1, material=material, **state)
    return World(Scene([body], [Ground(material)]), fidelity)


# --- against Box ----------------------------------------------------------------------------------


def test_a_meshed_cube_slides_as_far_as_a_box():
    distance = []
    for shape in (BOX, CUBE):
        world = alone(shape, position=(0, 0, 0.01985), linear_velocity=(0.5, 0.1, 0.0))
        world.advance(1.0)
        distance.append(world.position[0, 0])
    np.testing.assert_allclose(distance[1], distance[0], atol=2e-4)
    assert distance[0][0] > 0.02


@pytest.mark.parametrize("restitution", [0.5, 1.0])
def test_a_meshed_cube_bounces_as_high_as_a_box(restitution):
    speed = []
    for shape in (BOX, CUBE):
        world = alone(shape, restitution=restitution, position=(0, 0, 0.1))
        world.advance(0.16)
        speed.append(world.linear_velocity[0, 0])
    np.testing.assert_allclose(speed[1], speed[0], atol=1e-9)
    assert speed[0][2] > 0.0


def spin_after_landing_on_an_edge(shape):
    fidelity = Fidelity(substep=5e-4, contact_resolution=0.2)
    turned = {"position": (0, 0, 0.06), "orientation": (0.0, 0.26, 0.0, 0.97)}
    world = alone(shape, fidelity, **turned)
    world.advance(0.12)
    return world.angular_velocity[0, 0, 1]


def test_a_landing_on_an_edge_converges_to_that_of_a_box_with_the_cells():
    """Samples are inset by 1.5 cells, which rounds the edges and moves the point of landing."""
    exact, errors = spin_after_landing_on_an_edge(BOX), []
    for cells in (12, 24, 48, 96):
        cube = mesh_of(meshes.cuboid(BOX.half_extents), cells=cells)
        errors.append(abs(spin_after_landing_on_an_edge(cube) / exact - 1.0))
    assert np.all(np.diff(errors) < 0.0)
    assert errors[-1] < 0.01


def test_particles_of_a_meshed_cube_carry_it_at_the_height_of_a_box():
    fidelity = Fidelity(geometry="particle", spacing=0.25)
    heights = []
    for shape in (BOX, CUBE):
        world = alone(shape, fidelity, position=(0, 0, 0.02))
        world.advance(0.5)
        heights.append(world.position[0, 0, 2])
    assert heights[1] == pytest.approx(heights[0], abs=1e-9)


def test_particles_that_leave_the_corners_of_a_mesh_are_found_before_they_overlap():
    """Balls of a lattice may reach farther than the mesh itself, here by 3 mm of 20 mm."""
    shape = mesh_of(meshes.ball(0.02))
    samples = shape.particles(0.02)
    assert np.linalg.norm(samples.positions, axis=1).max() + samples.radius > 0.023
    low = np.argmin(samples.positions @ (0.0, 0.6, 0.8))
    way = samples.positions[low] / np.linalg.norm(samples.positions[low])
    fidelity = Fidelity(law="impulse", geometry="particle", spacing=0.5)
    bodies = [
        Body(shape, mass=0.1, position=tuple(far * way), linear_velocity=tuple(-speed * way),
             material=Material(restitution=0.5, friction=0.0))
        for far, speed in ((0.0, 0.0), (0.048, 1.0))
    ]  # fmt: skip
    world = World(Scene(bodies, gravity=(0.0, 0.0, 0.0)), fidelity)
    deepest = 0.0
    for _ in range(10):
        world.advance(fidelity.substep)
        deepest = max(deepest, world.contacts().penetration.max(initial=0.0))
    assert deepest < fidelity.substep
    assert world.linear_velocity[0] @ way == pytest.approx((-0.75, -0.25), rel=1e-3)


# --- resting, rolling and holding, all in one scene, which has one kernel ------------------------

NAMES = ("bowl", "ball", "standing", "tipped", "large ball")


def scene():
    bowl = mesh_of(meshes.bowl(0.05, 0.036, 32), cells=32)
    knight = mesh_of(meshes.knight(around=20, along=40), cells=32)
    slab = mesh_of(meshes.cuboid((0.1, 0.1, 0.02)), cells=24)
    tipped = at(knight, (-0.5, 0, 0.05), (0.6, 0.1, 0.0, 0.79))
    bodies = [
        Body(bowl, mass=0.3, name="bowl", **at(bowl, (0, 0, 0.04))),
        Body(Sphere(0.01), mass=0.02, position=(0.02, 0, 0.04), material=ROUGH, name="ball"),
        Body(knight, mass=0.05, name="standing", **at(knight, (-0.3, 0, 0))),
        Body(knight, mass=0.05, name="tipped", **tipped),
        # far larger than the margin of the slab's grid
        Body(Sphere(0.08), mass=0.1, position=(0, 0.5, 0.12), material=ROUGH, name="large ball"),
    ]
    for i, shapes in enumerate(((BOX,) * 3, (CUBE,) * 3, (CUBE, BOX, CUBE), (BOX, CUBE, CUBE))):
        for k, shape in enumerate(shapes):
            place = (0.3, 0.2 * i, 0.02 + 0.04 * k)
            bodies.append(Body(shape, mass=0.1, position=place, material=ROUGH))
    return Scene(bodies, [Ground(ROUGH), Static(slab, position=(0, 0.5, 0.02), material=ROUGH)])


@pytest.fixture(scope="module", params=["balanced", "solid"])
def settled(request):
    """The scene after 4 s, and the heights of all bodies until then."""
    world, heights = World(scene(), request.param), []
    for _ in range(80):
        world.advance(0.05)
        heights.append(world.position[0, :, 2].copy())
    return world, np.array(heights)


def test_nothing_collides_while_all_is_at_rest(settled):
    """Of the bowl's samples some bear nothing, and tremble while a ball rolls in it."""
    world, _ = settled
    if world.fidelity.law == "spring":
        return
    simulation = world._simulation
    for _ in range(20):
        world.advance(world.fidelity.substep)
        workspace = simulation.take_workspace()
        assert not workspace.lane["colliding"].any()
        simulation.return_workspace(workspace)


def test_towers_of_meshed_cubes_stand_as_those_of_boxes_do(settled):
    """Also those of both kinds: boxes on meshes, and meshes on boxes."""
    world, _ = settled
    towers = world.position[0, 5:].reshape(4, 3, 3) - np.array((0.3, 0.0, 0.0))
    towers = towers - np.array([(0.0, 0.2 * i, 0.0) for i in range(4)])[:, None]
    np.testing.assert_allclose(towers[0, :, 2], (0.02, 0.06, 0.1), atol=2e-3)
    for tower in towers[1:]:
        np.testing.assert_allclose(tower, towers[0], atol=2e-4)
    assert np.abs(world.linear_velocity[0, 5:]).max() < 2e-3


def test_a_ball_stays_in_a_bowl(settled):
    world, heights = settled
    bowl, ball = world.position[0, 0], world.position[0, 1]
    assert np.linalg.norm(ball[:2] - bowl[:2]) < 0.026
    assert np.all(heights[:, 1] < 0.045)
    assert np.all(heights[:, 1] > 0.012)  # it does not sink through
    assert np.ptp(heights[-20:, 1]) < 0.5 * np.ptp(heights[:20, 1])  # it comes to rest


def test_a_knight_stands(settled):
    world, heights = settled
    i = NAMES.index("standing")
    assert np.ptp(heights[10:, i]) < 5e-4
    assert np.abs(world.angular_velocity[0, i]).max() < 0.01
    assert np.linalg.norm(world.position[0, i, :2] - np.array((-0.3, 0.0))) < 2e-3


def test_a_tipped_knight_rolls_onto_its_side_and_rests(settled):
    world, heights = settled
    i = NAMES.index("tipped")
    assert heights[-1, i] < 0.015
    assert np.linalg.norm(world.linear_velocity[0, i]) < 1e-3
    assert np.linalg.norm(world.position[0, i, :2] - np.array((-0.5, 0.0))) > 0.01


def test_a_ball_larger_than_the_grid_rests_on_a_meshed_static(settled):
    world, heights = settled
    i = NAMES.index("large ball")
    assert heights[-1, i] == pytest.approx(0.12, abs=3e-4)
    np.testing.assert_allclose(world.position[0, i, :2], (0.0, 0.5), atol=1e-3)


def test_momentum_is_conserved_between_two_meshes():
    """In the air, about their common centre of mass, which falls freely."""
    world = World(scene())
    pair = [NAMES.index("standing"), 8]  # a knight and a meshed cube
    position, velocity = world.position.copy(), world.linear_velocity.copy()
    omega = world.angular_velocity.copy()
    position[0, pair] = (0.0, 0.0, 5.0), (0.06, 0.0, 5.0)
    velocity[0, pair] = (0.2, 0.01, 0.0), (0.0, 0.0, 0.0)
    omega[0, pair] = (0.0, 0.0, 0.0), (3.0, 2.0, 1.0)
    world.set_state(position=position, linear_velocity=velocity, angular_velocity=omega)
    before = momenta(world, pair)
    world.advance(0.6)
    (p, L), fall = momenta(world, pair), np.array((0.0, 0.0, -9.81 * 0.15 * 0.6))
    assert np.linalg.norm(world.linear_velocity[0, 8, :2]) > 0.01  # they have touched
    np.testing.assert_allclose(p, before[0] + fall, atol=1e-12)
    np.testing.assert_allclose(L, before[1], atol=1e-12)


def momenta(world, pair):
    """Of two bodies: momentum in kg m/s, angular momentum about their centre in kg m^2/s."""
    bodies = [world.scene.bodies[i] for i in pair]
    mass = np.array([body.mass for body in bodies])[:, None]
    inertia = np.array([body.shape.inertia(body.mass) for body in bodies])
    p, c = mass * world.linear_velocity[0, pair], world.position[0, pair]
    q = world.orientation[0, pair]
    own = rotate(q, inertia * rotate_back(q, world.angular_velocity[0, pair]))
    arm = c - (mass * c).sum(axis=0) / mass.sum()
    return p.sum(axis=0), (np.cross(arm, p) + own).sum(axis=0)
